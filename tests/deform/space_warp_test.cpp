#include "filigree/pose.h"

#include "filigree/mesh.h"
#include "filigree/mesh/normals.h"
#include "threads.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <array>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <numbers>
#include <random>
#include <string>

namespace filigree {
namespace {

constexpr std::array kAxes = {Axis::x, Axis::y, Axis::z};

Box make_box(const Vec3d& min, const Vec3d& max) {
    Box box;
    box.extend(min);
    box.extend(max);
    return box;
}

const Box kBox = make_box({-1, 0.5, 2}, {3, 2, 2.75});

std::vector<Vec3d> random_points(const Box& box, std::size_t count, std::uint64_t seed) {
    std::mt19937_64 generator(seed);
    const auto next = [&] { return static_cast<double>(generator() >> 11) * 0x1p-53; };
    std::vector<Vec3d> points(count);
    for (Vec3d& p : points) p = box.min + Vec3d(next(), next(), next()).cwiseProduct(box.size());
    return points;
}

/// Points inside and out to half a box beyond.
std::vector<Vec3d> points_around(const Box& box) {
    return random_points(make_box(box.min - 0.5 * box.size(), box.max + 0.5 * box.size()), 300, 5);
}

Mat3d central_difference(const SpaceWarp& warp, const Vec3d& p, double h) {
    Mat3d gradient;
    for (int k = 0; k < 3; ++k) {
        const Vec3d step = h * Vec3d::Unit(k);
        gradient.col(k) = (warp.position(p + step) - warp.position(p - step)) / (2 * h);
    }
    return gradient;
}

struct NamedWarp {
    std::string name;
    std::unique_ptr<SpaceWarp> warp;
};

std::unique_ptr<SpaceWarp> make_test_rbf(const Box& box) {
    const std::vector<Vec3d> centres = random_points(box, 23, 7);
    std::vector<Vec3d> displacements = random_points(make_box(-0.2 * box.size(), 0.2 * box.size()), 23, 8);
    return make_rbf(centres, displacements);
}

std::vector<NamedWarp> all_warps(const Box& box) {
    std::vector<NamedWarp> warps;
    for (const Axis axis : kAxes) {
        const std::string suffix = "_" + std::to_string(static_cast<int>(axis));
        warps.push_back({"stretch" + suffix, make_stretch(box, axis, -1.7).value()});
        warps.push_back({"squeeze" + suffix, make_squeeze(box, axis, 0.4).value()});
        warps.push_back({"taper" + suffix, make_taper(box, axis, 0.3).value()});
        for (const double degrees : {0.0, 1e-7, 60.0, -90.0, 180.0, 360.0}) {
            warps.push_back({"bend" + suffix + "_" + std::to_string(degrees), make_bend(box, axis, degrees)});
            warps.push_back({"twist" + suffix + "_" + std::to_string(degrees), make_twist(box, axis, degrees)});
        }
    }
    warps.push_back({"smooth random", make_smooth_random(box, 0.25, 3)});
    warps.push_back({"rbf", make_test_rbf(box)});
    std::vector<std::unique_ptr<SpaceWarp>> links;
    links.push_back(make_bend(box, Axis::x, 70));
    links.push_back(make_smooth_random(box, 0.1, 4));
    links.push_back(make_squeeze(box, Axis::y, 2).value());
    warps.push_back({"chain", make_chain(std::move(links))});
    return warps;
}

/// Whether p is so near to an end of the box that a difference would straddle it.
bool near_an_end(const Box& box, const Vec3d& p, double h) {
    return ((p - box.min).cwiseAbs().minCoeff() < 2 * h) || ((p - box.max).cwiseAbs().minCoeff() < 2 * h);
}

TEST(SpaceWarp, GradientsMatchCentralDifferences) {
    const double h = 1e-5;
    for (const auto& [name, warp] : all_warps(kBox))
        for (const Vec3d& p : points_around(kBox)) {
            if (near_an_end(kBox, p, h)) continue;
            const Warped warped = warp->warp(p);
            ASSERT_EQ(warped.position, warp->position(p)) << name;
            ASSERT_LT((warped.gradient - central_difference(*warp, p, h)).norm(), 1e-6)
                << name << " at " << p.transpose();
        }
}

TEST(SpaceWarp, EndsOfTheBoxHaveTheGradientOfTheInside) {
    for (const auto& [name, warp] : all_warps(kBox))
        for (const double end : {0.0, 1.0}) {
            const Vec3d corner = kBox.min + end * kBox.size();
            const Vec3d inside = corner + 1e-9 * (kBox.centre() - corner),
                        outside = corner - 1e-9 * (kBox.centre() - corner);
            EXPECT_LT((warp->warp(corner).gradient - warp->warp(inside).gradient).norm(), 1e-7) << name;
            EXPECT_LT((warp->position(inside) - warp->position(outside)).norm(), 1e-7) << name; // no jump
        }
}

TEST(SpaceWarp, TheMiddleOfTheBoxStaysUnderBendTwistStretch) {
    for (const Axis axis : kAxes) {
        EXPECT_LT((make_bend(kBox, axis, 123)->position(kBox.centre()) - kBox.centre()).norm(), 1e-15);
        EXPECT_LT((make_twist(kBox, axis, 123)->position(kBox.centre()) - kBox.centre()).norm(), 1e-15);
        EXPECT_LT((make_stretch(kBox, axis, 3).value()->position(kBox.centre()) - kBox.centre()).norm(), 1e-15);
    }
}

TEST(SpaceWarp, SqueezeKeepsVolume) {
    for (const Axis axis : kAxes)
        for (const double factor : {0.01, 0.5, 1.0, 7.0})
            EXPECT_NEAR(make_squeeze(kBox, axis, factor).value()->warp(kBox.min).gradient.determinant(), 1, 1e-14);
}

TEST(SpaceWarp, StretchScalesTheBoxAboutItsCentre) {
    const Vec3d moved = make_stretch(kBox, Axis::y, 2).value()->position(kBox.max);
    EXPECT_LT((moved - Vec3d(3, 2.75, 2.75)).norm(), 1e-15);
}

TEST(SpaceWarp, BendKeepsTheLengthOfItsCentreLine) {
    for (const Axis axis : kAxes) {
        const int a = static_cast<int>(axis);
        for (const double degrees : {0.0, 90.0, 180.0, 360.0, -250.0}) {
            const auto warp = make_bend(kBox, axis, degrees);
            for (int i = -5; i <= 15; ++i) { // half a box beyond either end too
                Vec3d p = kBox.centre();
                p[a] = kBox.min[a] + 0.1 * i * kBox.size()[a];
                EXPECT_NEAR(warp->warp(p).gradient.col(a).norm(), 1, 1e-14) << degrees;
            }
        }
    }
}

TEST(SpaceWarp, BendMakesTheArcItNames) {
    const Box box = make_box({-2, -1, -1}, {2, 1, 1});
    const double length = 4, radius = length / std::numbers::pi; // 180 degrees
    const auto warp = make_bend(box, Axis::x, 180);
    for (int i = 0; i <= 8; ++i) { // the centre line lies on a circle about (0, radius)
        const Vec3d p = warp->position({-2 + 0.5 * i, 0, 0.3});
        EXPECT_NEAR((p - Vec3d(0, radius, 0.3)).norm(), radius, 1e-14);
    }
    EXPECT_LT((warp->position({2, 0, 0}) - Vec3d(radius, radius, 0)).norm(), 1e-14);
    EXPECT_LT((warp->position({3, 0, 0}) - Vec3d(radius, radius + 1, 0)).norm(), 1e-14); // straight on, upwards
    EXPECT_LT((warp->position({-3, 0, 0}) - Vec3d(-radius, radius + 1, 0)).norm(), 1e-14);
    // 360 degrees: both ends meet.
    const auto ring = make_bend(box, Axis::x, 360);
    EXPECT_LT((ring->position({-2, 0.4, 0.1}) - ring->position({2, 0.4, 0.1})).norm(), 1e-14);
}

TEST(SpaceWarp, BendIsSymmetricAboutItsMiddle) {
    const Box box = make_box({-2, -1, -1}, {2, 1, 1});
    const auto warp = make_bend(box, Axis::x, 77);
    for (const Vec3d& p : points_around(box)) {
        const Vec3d there = warp->position(p), mirrored = warp->position({-p.x(), p.y(), p.z()});
        EXPECT_LT((there - Vec3d(-mirrored.x(), mirrored.y(), mirrored.z())).norm(), 1e-14);
    }
}

TEST(SpaceWarp, BendOfNearlyNothingIsNearlyTheIdentity) {
    for (const double degrees : {0.0, 1e-300, 1e-12})
        for (const Vec3d& p : points_around(kBox))
            EXPECT_LT((make_bend(kBox, Axis::x, degrees)->position(p) - p).norm(), 1e-12);
}

TEST(SpaceWarp, TwistTurnsTheEndsByHalfTheAngleEach) {
    const Box box = make_box({-1, -1, -2}, {1, 1, 2});
    const auto warp = make_twist(box, Axis::z, 90);
    const double s = std::sqrt(0.5);
    EXPECT_LT((warp->position({1, 0, 2}) - Vec3d(s, s, 2)).norm(), 1e-15);
    EXPECT_LT((warp->position({1, 0, -2}) - Vec3d(s, -s, -2)).norm(), 1e-15);
    EXPECT_LT((warp->position({1, 0, 5}) - Vec3d(s, s, 5)).norm(), 1e-15); // rigid beyond
    for (const Vec3d& p : points_around(box)) EXPECT_NEAR(warp->warp(p).gradient.determinant(), 1, 1e-13);
}

TEST(SpaceWarp, TaperScalesTheHighEnd) {
    const Box box = make_box({0, -1, -1}, {4, 1, 1});
    const auto warp = make_taper(box, Axis::x, 0.5).value();
    EXPECT_LT((warp->position({0, 1, 1}) - Vec3d(0, 1, 1)).norm(), 1e-15);
    EXPECT_LT((warp->position({4, 1, 1}) - Vec3d(4, 0.5, 0.5)).norm(), 1e-15);
    EXPECT_LT((warp->position({2, 1, 0}) - Vec3d(2, 0.75, 0)).norm(), 1e-15);
    EXPECT_LT((warp->position({40, 1, 0}) - Vec3d(40, 0.5, 0)).norm(), 1e-15);
}

TEST(SpaceWarp, BoxesWithoutLengthAreDefined) {
    const Box flat = make_box({-1, -1, 3}, {1, 1, 3}), point = make_box({1, 2, 3}, {1, 2, 3});
    for (const Box& box : {flat, point, Box{}})
        for (const auto& [name, warp] : all_warps(box)) {
            if (box.empty() && (name == "rbf" || name == "chain")) continue; // no points to put in them
            for (const Vec3d& p : {Vec3d(0.3, 0.2, 3), Vec3d(1, 2, 3), Vec3d(0.3, 0.2, 3.5), Vec3d(-9, 9, -9)}) {
                const Warped warped = warp->warp(p);
                EXPECT_TRUE(warped.position.allFinite() && warped.gradient.allFinite()) << name;
            }
        }
    for (const double degrees : {180.0, -30.0}) {
        EXPECT_EQ(make_bend(flat, Axis::z, degrees)->position({0.5, 0.25, 4}), Vec3d(0.5, 0.25, 4));
        EXPECT_EQ(make_twist(flat, Axis::z, degrees)->position({0.5, 0.25, 4}), Vec3d(0.5, 0.25, 4));
    }
    EXPECT_EQ(make_taper(flat, Axis::z, 3).value()->position({0.5, 0.25, 4}), Vec3d(0.5, 0.25, 4));
}

TEST(SpaceWarp, WarpsFollowTheBoxWhenItIsMovedAndScaled) {
    const Vec3d shift(100, -50, 20);
    const double scale = 1e-3;
    const Box moved = make_box(scale * kBox.min + shift, scale * kBox.max + shift);
    const std::vector<NamedWarp> here = all_warps(kBox), there = all_warps(moved);
    for (std::size_t w = 0; w < here.size(); ++w)
        for (const Vec3d& p : points_around(kBox)) {
            if (near_an_end(kBox, p, 1e-9)) continue;
            const Warped a = here[w].warp->warp(p), b = there[w].warp->warp(scale * p + shift);
            ASSERT_LT((b.position - scale * a.position - shift).norm(), 1e-12) << here[w].name;
            ASSERT_LT((b.gradient - a.gradient).norm(), 1e-9) << here[w].name;
        }
}

TEST(SpaceWarp, SmoothRandomIsSeededAndHasTheAmplitudeAsked) {
    const Vec3d p = kBox.centre();
    EXPECT_EQ(make_smooth_random(kBox, 0.1, 1)->position(p), make_smooth_random(kBox, 0.1, 1)->position(p));
    EXPECT_NE(make_smooth_random(kBox, 0.1, 1)->position(p), make_smooth_random(kBox, 0.1, 2)->position(p));
    EXPECT_EQ(make_smooth_random(kBox, 0, 1)->position(p), p);
    // Displacements grow with the amplitude, and eight bumps cannot add up to more than eight times it.
    const Vec3d one = make_smooth_random(kBox, 0.1, 1)->position(p) - p,
                two = make_smooth_random(kBox, 0.2, 1)->position(p) - p;
    EXPECT_LT((two - 2 * one).norm(), 1e-12);
    for (const Vec3d& q : points_around(kBox))
        EXPECT_LE((make_smooth_random(kBox, 0.1, 1)->position(q) - q).norm(), 0.8 * kBox.diagonal());
}

TEST(SpaceWarp, RbfInterpolates) {
    for (const std::size_t count : {1u, 2u, 3u, 4u, 5u, 8u, 60u}) {
        const std::vector<Vec3d> centres = random_points(kBox, count, 11);
        const std::vector<Vec3d> displacements = random_points(make_box({-1, -1, -1}, {1, 1, 1}), count, 12);
        const auto warp = make_rbf(centres, displacements);
        for (std::size_t i = 0; i < count; ++i)
            EXPECT_LT((warp->position(centres[i]) - centres[i] - displacements[i]).norm(), 1e-10) << count;
    }
    EXPECT_EQ(make_rbf({}, {})->position({1, 2, 3}), Vec3d(1, 2, 3));
}

TEST(SpaceWarp, RbfReproducesAffineMaps) {
    Mat3d A;
    A << 1, 2, 0.5, -0.3, 0.7, 0, 0.1, -1, 2;
    const Vec3d b(3, -1, 2);
    const std::vector<Vec3d> centres = random_points(kBox, 20, 11);
    std::vector<Vec3d> displacements;
    for (const Vec3d& c : centres) displacements.push_back(A * c + b - c);
    const auto warp = make_rbf(centres, displacements);
    for (const Vec3d& p : points_around(kBox)) {
        EXPECT_LT((warp->position(p) - A * p - b).norm(), 1e-10);
        EXPECT_LT((warp->warp(p).gradient - A).norm(), 1e-10);
    }
}

TEST(SpaceWarp, RbfWithDegenerateCentres) {
    // All in the plane z = 2, where nothing is known about z.
    std::vector<Vec3d> centres = random_points(make_box({0, 0, 2}, {1, 1, 2}), 12, 11);
    std::vector<Vec3d> displacements = random_points(kBox, 12, 12);
    const auto flat = make_rbf(centres, displacements);
    for (std::size_t i = 0; i < centres.size(); ++i)
        EXPECT_LT((flat->position(centres[i]) - centres[i] - displacements[i]).norm(), 1e-10);
    EXPECT_TRUE(flat->position({5, 5, 5}).allFinite());
    // A centre twice: the mean of what is asked for.
    centres.push_back(centres[0]);
    displacements.push_back(displacements[0] + Vec3d(1, 0, 0));
    const auto doubled = make_rbf(centres, displacements);
    EXPECT_LT((doubled->position(centres[0]) - centres[0] - displacements[0] - Vec3d(0.5, 0, 0)).norm(), 1e-10);
}

TEST(SpaceWarp, ChainsAreAppliedInOrder) {
    std::vector<std::unique_ptr<SpaceWarp>> links;
    links.push_back(make_twist(kBox, Axis::x, 40));
    links.push_back(make_taper(kBox, Axis::y, 2).value());
    const auto chain = make_chain(std::move(links));
    const auto twist = make_twist(kBox, Axis::x, 40), taper = make_taper(kBox, Axis::y, 2).value();
    for (const Vec3d& p : points_around(kBox)) EXPECT_EQ(chain->position(p), taper->position(twist->position(p)));
    EXPECT_EQ(make_chain({})->position({1, 2, 3}), Vec3d(1, 2, 3));
    EXPECT_EQ(make_chain({})->warp({1, 2, 3}).gradient, Mat3d::Identity());
}

/// An open grid of n x n quads over the unit square, bulging in z.
Mesh make_bulge(Index n) {
    Mesh mesh;
    for (Index j = 0; j <= n; ++j)
        for (Index i = 0; i <= n; ++i) {
            const float u = static_cast<float>(i) / static_cast<float>(n),
                        v = static_cast<float>(j) / static_cast<float>(n);
            mesh.positions.emplace_back(u, v, 0.3f * u * (1 - u) + 0.2f * v * v);
        }
    for (Index j = 0; j < n; ++j)
        for (Index i = 0; i < n; ++i) {
            const Index a = j * (n + 1) + i;
            mesh.add_face(std::array{a, a + 1, a + n + 2, a + n + 1});
        }
    return mesh;
}

Box box_of(const Mesh& mesh) { return bounds(mesh.positions); }

TEST(WarpMesh, TransformsNormalsWithTheSurface) {
    // The tangents of the bulge are known; so are their images, and the normal is across them.
    Mesh mesh = make_bulge(20);
    const Mesh rest = mesh;
    std::vector<std::array<Vec3d, 2>> tangents;
    for (const Vec3f& p : mesh.positions) {
        tangents.push_back({Vec3d(1, 0, 0.3 * (1 - 2 * p.x())), Vec3d(0, 1, 0.4 * p.y())});
        mesh.normals.values.push_back(
            (2 * tangents.back()[0].cross(tangents.back()[1])).cast<float>()); // not of unit length
    }
    const auto warp = make_bend(box_of(rest), Axis::x, 100);
    warp_mesh(*warp, mesh, RunContext(1));
    for (std::size_t i = 0; i < tangents.size(); ++i) {
        const Warped warped = warp->warp(rest.positions[i].cast<double>());
        const Vec3d normal = (warped.gradient * tangents[i][0]).cross(warped.gradient * tangents[i][1]).normalized();
        ASSERT_LT((mesh.normals.values[i].cast<double>() - normal).norm(), 1e-6);
        ASSERT_LT((mesh.positions[i].cast<double>() - warped.position).norm(), 1e-6);
    }
}

TEST(WarpMesh, MirroringTurnsNormalsAsItTurnsTheWinding) {
    Mesh mesh = make_bulge(4);
    mesh.normals.values.assign(mesh.vertex_count(), Vec3f(0, 0, 1));
    warp_mesh(*make_stretch(box_of(mesh), Axis::x, -1).value(), mesh, RunContext(1));
    for (const Vec3f& n : mesh.normals.values) EXPECT_EQ(n, Vec3f(0, 0, -1));
}

TEST(WarpMesh, SharedNormalsBecomeOneForEachVertex) {
    Mesh mesh = make_bulge(3);
    mesh.normals.values = {Vec3f(0, 0, 1), Vec3f(7, 7, 7)}; // one for all corners, and one in no use
    mesh.normals.corners.assign(mesh.corner_count(), 0);
    const Box box = box_of(mesh);
    const Mesh rest = mesh;
    const auto warp = make_bend(box, Axis::x, 90);
    warp_mesh(*warp, mesh, RunContext(1));
    EXPECT_EQ(mesh.normals.values.size(), mesh.vertex_count() + 1);
    EXPECT_EQ(mesh.normals.values[1], Vec3f(7, 7, 7));
    EXPECT_EQ(mesh.corners, rest.corners);
    for (std::size_t c = 0; c < mesh.corner_count(); ++c) {
        const Mat3d A = warp->warp(rest.positions[mesh.corners[c]].cast<double>()).gradient;
        const Vec3d normal = (A.inverse().transpose() * Vec3d::UnitZ()).normalized(); // no mirroring here
        ASSERT_LT((mesh.normals.values[mesh.normals.corners[c]].cast<double>() - normal).norm(), 1e-6);
    }
    // Once every vertex has its own, nothing is added any more.
    warp_mesh(*warp, mesh, RunContext(1));
    EXPECT_EQ(mesh.normals.values.size(), mesh.vertex_count() + 1);
}

TEST(WarpMesh, CollapseKeepsTheNormalThatHasNoImage) {
    Mesh mesh = make_bulge(2);
    mesh.normals.values.assign(mesh.vertex_count(), Vec3f(1, 0, 0));
    mesh.normals.values[0] = Vec3f::Zero();
    std::vector<Vec3d> centre = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, to_origin;
    for (const Vec3d& c : centre) to_origin.push_back(-c);
    warp_mesh(*make_rbf(centre, to_origin), mesh, RunContext(1)); // everything goes to one point
    for (const Vec3f& n : mesh.normals.values) EXPECT_TRUE(n.allFinite());
    EXPECT_EQ(mesh.normals.values[0], Vec3f::Zero());
}

TEST(SpaceWarp, LongestAxis) {
    EXPECT_EQ(longest_axis({{-1, 0, 0}, {1, 3, 2}}), Axis::y);
    EXPECT_EQ(longest_axis({{0, 0, 0}, {1, 1, 2}}), Axis::z);
    EXPECT_EQ(longest_axis({{5, 5, 5}, {6, 6, 6}}), Axis::x); // the first of equals
}

TEST(WarpMesh, FarFromTheOriginNothingIsLost) {
    const Vec3d far(500000, 5400000, 300);
    Mesh near = make_bulge(8), away = near;
    away.origin = far;
    Box box = box_of(near), far_box = box;
    far_box.min += far;
    far_box.max += far;
    warp_mesh(*make_bend(box, Axis::x, 120), near, RunContext(1));
    warp_mesh(*make_bend(far_box, Axis::x, 120), away, RunContext(1));
    for (std::size_t i = 0; i < near.vertex_count(); ++i)
        EXPECT_LT((near.positions[i] - away.positions[i]).norm(), 1e-6f); // half a double's digit at 5,400,000
}

TEST(WarpMesh, PoseAgreesWithPositionsAndBytesWithAnyThreadCount) {
    FILIGREE_NEEDS_TWO_THREADS();
    const Mesh mesh = make_bulge(150); // several pieces of the parallel loop
    const auto warp = make_smooth_random(box_of(mesh), 0.2, 9);
    const Pose one = warp_pose(*warp, mesh.positions, mesh.origin, RunContext(1));
    const Pose two = warp_pose(*warp, mesh.positions, mesh.origin, RunContext(3));
    EXPECT_EQ(one.positions, two.positions);
    EXPECT_EQ(one.gradients, two.gradients);
    EXPECT_EQ(one.positions, warp_positions(*warp, mesh.positions, mesh.origin, RunContext(2)));
    EXPECT_TRUE(warp_positions(*warp, {}, Vec3d::Zero(), RunContext(2)).empty());
}

/// A model whose driver is the whole mesh, as far as poses go.
Model model_of(Mesh mesh) {
    Model model;
    Level driver;
    for (Index v = 0; v < mesh.vertex_count(); ++v) driver.vertices.push_back(v);
    model.levels.push_back(std::move(driver));
    model.mesh = std::move(mesh);
    return model;
}

TEST(SpaceWarp, TheSameFarFromTheOrigin) {
    const RunContext context(1);
    const Mesh near = make_bar({.resolution = 8, .length = 3});
    Mesh far = near;
    far.origin = Vec3d(500'000, -250'000, 1'000'000);
    const auto bend_of = [](const Mesh& mesh) { return make_bend(world_bounds(mesh), Axis::x, 90); };

    const Pose expected = warp_pose(*bend_of(near), model_of(near), context);
    const Pose pose = warp_pose(*bend_of(far), model_of(far), context);
    Mesh bent = far;
    warp_mesh(*bend_of(far), bent, context);
    double moved = 0;
    for (Index v = 0; v < near.vertex_count(); ++v) {
        moved = std::max(moved, double((pose.positions[v] - far.positions[v]).norm()));
        ASSERT_LT((pose.positions[v] - expected.positions[v]).norm(), 1e-6f);
        ASSERT_LT((pose.gradients[v] - expected.gradients[v]).norm(), 1e-6f);
        ASSERT_EQ(bent.positions[v], pose.positions[v]);
    }
    EXPECT_GT(moved, 0.1);
    EXPECT_LT(moved, 3); // a box relative to the origin would send the bar hundreds of kilometres round an arc
}

TEST(SpaceWarp, FactorsThatLeaveNothingAreRefused) {
    const Box box{Vec3d::Zero(), Vec3d::Ones()};
    const double nan = std::nan("");
    for (const double factor : {0.0, nan, double(INFINITY)}) {
        const auto stretch = make_stretch(box, Axis::x, factor);
        ASSERT_FALSE(stretch.ok()) << factor;
        EXPECT_EQ(stretch.error().code, ErrorCode::usage);
    }
    EXPECT_TRUE(make_stretch(box, Axis::x, -1).ok()) << "a mirror";
    for (const double factor : {0.0, -1.0, nan, double(INFINITY)})
        for (const auto& made : {make_squeeze(box, Axis::x, factor), make_taper(box, Axis::x, factor)}) {
            ASSERT_FALSE(made.ok()) << factor;
            EXPECT_EQ(made.error().code, ErrorCode::usage);
        }
}

} // namespace
} // namespace filigree
