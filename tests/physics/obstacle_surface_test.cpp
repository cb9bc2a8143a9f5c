// Triangles as walls with two sides: what is closest, what a way meets, and where points are held.
#include "filigree/core/random.h"
#include "filigree/mesh.h"
#include "filigree/physics/contact/obstacle_trace.h"
#include "obstacle_meshes.h"
#include "threads.h"

#include <gtest/gtest.h>

namespace filigree {

using namespace obstacle_meshes;

namespace {

ObstacleSurface surface_of(const Mesh& mesh, double scale = 1) {
    return ObstacleSurface::create(mesh, scale, kAllThreads).value();
}

Vec3d random_in_cube(std::uint64_t seed, std::size_t n) {
    return Vec3d(random_unit(seed, 3 * n), random_unit(seed, 3 * n + 1), random_unit(seed, 3 * n + 2)) * 2 -
           Vec3d::Ones();
}

/// By all triangles, in plain arithmetic.
double first_by_brute_force(const ObstacleSurface& surface, const Vec3d& from, const Vec3d& to) {
    double first = 2;
    for (const Triangle& t : surface.triangles()) {
        const Vec3d a = surface.positions()[t[0]].cast<double>(), b = surface.positions()[t[1]].cast<double>(),
                    c = surface.positions()[t[2]].cast<double>(), n = (b - a).cross(c - a);
        const double s = n.dot(from - a), e = n.dot(to - a);
        if ((s < 0) == (e < 0)) continue;
        const Vec3d x = from + s / (s - e) * (to - from);
        if (n.dot((b - a).cross(x - a)) >= 0 && n.dot((c - b).cross(x - b)) >= 0 && n.dot((a - c).cross(x - c)) >= 0)
            first = std::min(first, s / (s - e));
    }
    return first;
}

} // namespace

TEST(ObstacleSurface, TheFirstCrossingIsThatOfAllTriangles) {
    for (const Mesh& mesh : {terrain(30), sphere(0.5f, 24, 12), turned_over(terrain(9)), box_shell(0.7f, 1)}) {
        const ObstacleSurface surface = surface_of(mesh);
        std::size_t crossings = 0;
        for (std::size_t n = 0; n < 2000; ++n) {
            const double length = n % 2 == 0 ? 0.05 : 1; // long ways are looked at in pieces
            const Vec3d from = random_in_cube(1, n), to = from + length * random_in_cube(2, n);
            const double wanted = first_by_brute_force(surface, from, to);
            const std::optional<WallCrossing> met = surface.first_crossing(from, to);
            ASSERT_EQ(met.has_value(), wanted <= 1) << n;
            if (!met) continue;
            ++crossings;
            EXPECT_NEAR(met->at, wanted, 1e-6);
            EXPECT_GT(met->normal.dot(from) - met->plane, 0) << "the normal looks back";
        }
        EXPECT_GT(crossings, 100u);
    }
}

TEST(ObstacleSurface, TheClosestPointIsSignedWhereTheMeshIsClosed) {
    const ObstacleSurface ball = surface_of(sphere(0.5f, 48, 24)),
                          inside_out = surface_of(turned_over(sphere(0.5f, 48, 24)));
    const ObstacleSurface sheet = surface_of(terrain(20));
    EXPECT_TRUE(ball.is_closed());
    EXPECT_FALSE(ball.looked_inwards());
    EXPECT_TRUE(inside_out.is_closed());
    EXPECT_TRUE(inside_out.looked_inwards());
    EXPECT_FALSE(sheet.is_closed());
    for (std::size_t n = 0; n < 500; ++n) {
        const Vec3d p = random_in_cube(3, n);
        EXPECT_NEAR(ball.closest(p).distance, p.norm() - 0.5, 0.01);
        EXPECT_NEAR(inside_out.closest(p).distance, p.norm() - 0.5, 0.01);
        EXPECT_GT(ball.closest(p).normal.dot(p.normalized()), 0.9);
        EXPECT_GE(sheet.closest(p).distance, 0);
        EXPECT_LE(sheet.clearance(p, 0.3), 0.3);
        EXPECT_LE(sheet.clearance(p, 9), sheet.closest(p).distance);
        EXPECT_GT(sheet.clearance(p, 9), sheet.closest(p).distance - 1e-5);
    }
    EXPECT_EQ(sheet.closest({0, 5, 0}, 1).triangle, kNoIndex);
}

TEST(ObstacleSurface, ACornerOfABoxIsSignedByTheMeanOfItsFaces) {
    const ObstacleSurface box(Cuboid{{0, 0, 0}, {2, 2, 2}});
    const ClosestWall corner = box.closest({1.1, 1.2, 1.3});
    EXPECT_GT(corner.distance, 0);
    EXPECT_LT((corner.normal - Vec3d(1, 1, 1).normalized()).norm(), 1e-6);
    EXPECT_NEAR(box.closest({0.9, 0.2, 0}).distance, -0.1, 1e-6);
}

/// Random walks in steps from a thousandth to ten times the size of things never get to the other side.
TEST(ObstacleSurface, FollowedPlacesNeverPass) {
    for (const Mesh& mesh : {sphere(0.5f, 24, 12), turned_over(sphere(0.5f, 24, 12)), box_shell(0.5f, 1),
                             box_shell(0.5f, 8), doubled(box_shell(0.5f, 4)), thick_shell(0.5f, 0.01f)}) {
        const ObstacleSurface room = surface_of(mesh);
        for (const double step : {1e-3, 0.05, 1.0, 10.0}) {
            Vec3d place = {0.1, 0.05, 0}, target = place;
            std::size_t touches = 0;
            for (std::size_t n = 0; n < 2000; ++n) {
                target += step * random_in_cube(4, n);
                const WallTouch touch = room.follow(place, target);
                touches += touch.depth > 0;
                ASSERT_LT(place.cwiseAbs().maxCoeff(), 0.5) << "step " << step << " at " << n;
                if (touch.depth > 0) {
                    ASSERT_NEAR(touch.normal.norm(), 1, 1e-6);
                    ASSERT_GT(touch.normal.dot(place - target), 0);
                    target = place + 0.5 * (target - place);
                } else {
                    ASSERT_EQ(place, target);
                }
            }
            EXPECT_TRUE(touches > 100 || step < 0.01) << touches; // short walks do not get there
        }
    }
}

TEST(ObstacleSurface, APlaceSlidesToTheClosestPointOfItsSide) {
    const ObstacleSurface plate = surface_of(box_mesh({-1, -0.0005f, -1}, {1, 0.0005f, 1}));
    Vec3d place(0.1, 0.2, 0.3);
    WallTouch touch = plate.follow(place, {0.1, -0.1, 0.3});
    EXPECT_NEAR(touch.depth, 0.1005, 1e-7);
    EXPECT_LT((touch.normal - Vec3d::UnitY()).norm(), 1e-9);
    touch = plate.follow(place, {0.6, -0.1, -0.7});
    EXPECT_LT((place - Vec3d(0.6, 0.0005, -0.7)).norm(), 1e-7) << place;
    touch = plate.follow(place, {1.2, -0.1, 0}); // over the edge it is free
    EXPECT_EQ(touch.depth, 0);

    const ObstacleSurface room = surface_of(box_shell(1, 3));
    place = Vec3d(0.9, 0.9, 0.9);
    touch = room.follow(place, {1.1, 1.2, 1.3});
    EXPECT_LT((place - Vec3d::Ones()).norm(), 1e-7) << "held by three walls";
    EXPECT_NEAR(touch.depth, Vec3d(0.1, 0.2, 0.3).norm(), 1e-6);

    Obstacle obstacle;
    obstacle.shape = Ball{{0, 0, 0}, 0.5};
    const ObstacleShape ball(obstacle);
    place = Vec3d(0, 2, 0.01);
    touch = ball.follow(place, {0, -3, 0.01}); // in one step to the other side
    EXPECT_GT(place.y(), 0.49);
    EXPECT_NEAR(touch.depth, 3.5, 0.1);
    touch = ball.follow(place, {0.3, 0.3, 0});
    EXPECT_NEAR(touch.depth, 0.5 - std::sqrt(0.18), 1e-6);
}

TEST(ObstacleSurface, SheetsThatAreThereTwiceAreThere) {
    const Result<MeshObstacle> made = make_mesh_obstacle(doubled(terrain(5)), 1, 0, kAllThreads);
    ASSERT_TRUE(made.ok());
    Vec3d place(0, 1, 0);
    EXPECT_GT(made->surface->follow(place, {0, -1, 0}).depth, 0.5);
    EXPECT_FALSE(make_mesh_obstacle(Mesh{}, 1, 0, kAllThreads).ok());
}

} // namespace filigree
