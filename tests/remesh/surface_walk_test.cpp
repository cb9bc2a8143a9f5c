#include "filigree/remesh/surface_walk.h"

#include "filigree/mesh/closest_point.h"
#include "manifold_check.h"
#include "prepared.h"

namespace filigree {
namespace {

using namespace filigree_test;

TrianglePoint random_point(const Prepared& on, std::mt19937& random) {
    Vec3d b(double(random() % 1000), double(random() % 1000), double(random() % 1000));
    b += Vec3d::Ones();
    return {static_cast<Index>(random() % on.surface.triangles.size()), b / b.sum()};
}

TEST(SurfaceWalk, ReachesTheClosestPlaceOfConvexSurfaces) {
    const Prepared on(make_ball({0, 0, 0}, 1));
    const SurfaceWalk walk = on.walk();
    std::vector<Vec3f> positions;
    for (const Vec3d& p : on.surface.positions) positions.push_back(p.cast<float>());
    const ClosestPointTree tree(positions, on.surface.triangles);
    std::mt19937 random(3);
    for (int i = 0; i < 500; ++i) {
        const TrianglePoint start = random_point(on, random);
        const Vec3d here = walk.position(start), far = walk.position(random_point(on, random));
        const Vec3d target = 1.2 * (here + 0.3 * (far - here)).normalized(); // outside
        const SurfaceWalk::Place place = walk.walk(start, target);
        EXPECT_NEAR((place.position - target).norm(), tree.closest(target.cast<float>()).distance, 1e-6);
        EXPECT_LT((place.position - walk.position(place.point)).norm(), 1e-12);
        EXPECT_NEAR(walk.normal(place.point).norm(), 1, 1e-12);
        EXPECT_GT(walk.normal(place.point).dot(target), 0);
    }
}

TEST(SurfaceWalk, NeverGoesFurtherAway) {
    for (const Mesh& mesh : {bumpy_torus(), ridged_sheet(), machined_part()}) {
        const Prepared on(mesh);
        const SurfaceWalk walk = on.walk();
        std::mt19937 random(4);
        for (int i = 0; i < 500; ++i) {
            const TrianglePoint start = random_point(on, random);
            const Vec3d target = walk.position(random_point(on, random));
            const SurfaceWalk::Place place = walk.walk(start, target);
            EXPECT_LE((place.position - target).norm(), (walk.position(start) - target).norm() + 1e-12);
            EXPECT_GE(place.point.barycentric.minCoeff(), 0);
            EXPECT_NEAR(place.point.barycentric.sum(), 1, 1e-12);
        }
    }
}

TEST(SurfaceWalk, StaysOnItsSheet) {
    // two parallel squares, a hundredth of a side apart, as one mesh
    const Mesh square = make_wavy_plane({.resolution = 8, .amplitude = 0});
    Mesh both;
    append(both, square);
    append(both, square, Vec3f(0, 0, 0.01f));
    const Prepared on(both);
    const SurfaceWalk walk = on.walk();
    const TrianglePoint start{0, Vec3d::Constant(1.0 / 3)};
    const double height = walk.position(start).z();
    const SurfaceWalk::Place place = walk.walk(start, Vec3d(0.3, 0.2, height == 0 ? 0.01 : 0.0));
    EXPECT_EQ(place.position.z(), height);
    EXPECT_NEAR((place.position - Vec3d(0.3, 0.2, height)).norm(), 0, 1e-9);
}

TEST(SurfaceWalk, DoesNotCrossFeatures) {
    // a roof so flat that the way over its ridge is always downhill
    Mesh roof = make_wavy_plane({.resolution = 16, .amplitude = 0});
    for (Vec3f& p : roof.positions) p.z() = -0.5f * std::abs(p.x());
    for (const double angle : {40.0, 180.0}) {
        const Prepared on(roof, 100, angle);
        const SurfaceWalk walk = on.walk();
        for (Index t = 0; t < on.surface.triangles.size(); ++t) {
            const TrianglePoint start{t, Vec3d::Constant(1.0 / 3)};
            const Vec3d here = walk.position(start), mirrored(-here.x(), here.y(), here.z());
            const Vec3d there = walk.walk(start, mirrored).position;
            if (angle < 180) {
                EXPECT_NEAR(there.x(), 0, 1e-9) << "not at the ridge";
            } else {
                EXPECT_LT((there - mirrored).norm(), 1e-9) << "there is no feature in the way";
            }
        }
    }
}

TEST(SurfaceWalk, SlidesAlongCurvesAndStopsAtCorners) {
    const Prepared on(ridged_sheet());
    const SurfaceWalk walk = on.walk();
    std::size_t slid = 0;
    for (Index h = 0; h < on.twins.size(); ++h) {
        if (!on.features[h]) continue;
        TrianglePoint start{h / 3, Vec3d::Zero()};
        start.barycentric[h % 3] = start.barycentric[next_half_edge(h) % 3] = 0.5;
        const Vec3d here = walk.position(start);
        for (const Vec3d& step : {Vec3d(0.11, 0, 0), Vec3d(-0.11, 0, 0), Vec3d(0, 0.11, 0), Vec3d(0, -0.11, 0),
                                  Vec3d(9, 9, 0), Vec3d(-9, -9, 0)}) {
            const SurfaceWalk::Place place = walk.slide(start, here + step);
            EXPECT_LT(on.distance_to_curves(place.position), 1e-9);
            EXPECT_LT((place.position - walk.position(place.point)).norm(), 1e-12);
            EXPECT_LE((place.position - here - step).norm(), step.norm() + 1e-12);
            slid += (place.position - here).norm() > 0.05;
            // straight curves, from corner to corner: both ends of the way are on the same one
            if (std::abs(here.x()) < 1e-6 || std::abs(here.x()) > 0.499999) {
                EXPECT_NEAR(place.position.x(), here.x(), 1e-6);
            } else {
                EXPECT_NEAR(place.position.y(), here.y(), 1e-6);
            }
        }
    }
    EXPECT_GT(slid, 100u);
}

TEST(SurfaceWalk, AwayFromCurvesStaysWhereItIs) {
    const Prepared on(make_ball({0, 0, 0}, 1));
    const TrianglePoint start{5, Vec3d::Constant(1.0 / 3)};
    const SurfaceWalk walk = on.walk();
    EXPECT_EQ(walk.slide(start, Vec3d(3, 2, 1)).position, walk.position(start));
}

} // namespace
} // namespace filigree
