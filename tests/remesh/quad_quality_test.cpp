#include "filigree/remesh/quad_quality.h"

#include "filigree/mesh.h"
#include "threads.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <numbers>

namespace filigree {
namespace {

double jacobian(const std::array<Vec3d, 4>& q) { return scaled_jacobian(q[0], q[1], q[2], q[3]); }

Mesh single_quad(const std::array<Vec3f, 4>& corners) {
    Mesh mesh;
    mesh.positions.assign(corners.begin(), corners.end());
    mesh.add_face(std::array<Index, 4>{0, 1, 2, 3});
    return mesh;
}

TEST(ScaledJacobian, OfRectanglesIsOneAndOfRhombsTheSine) {
    EXPECT_DOUBLE_EQ(scaled_jacobian({0, 0, 0}, {5, 0, 0}, {5, 0, 1}, {0, 0, 1}), 1);
    for (const double angle : {10.0, 45.0, 90.0, 120.0}) {
        const double t = angle * std::numbers::pi / 180;
        const Vec3d along(3, 0, 0), up = 3 * Vec3d(std::cos(t), std::sin(t), 0);
        EXPECT_NEAR(scaled_jacobian({0, 0, 0}, along, along + up, up), std::sin(t), 1e-15);
    }
}

TEST(ScaledJacobian, OfStraightAndReflexCorners) {
    EXPECT_DOUBLE_EQ(scaled_jacobian({0, 0, 0}, {1, 0, 0}, {0.5, 0.5, 0}, {0, 1, 0}), 0);      // straight at the third
    EXPECT_NEAR(scaled_jacobian({0, 0, 0}, {2, 0, 0}, {0.5, 0.5, 0}, {0, 2, 0}), -0.8, 1e-15); // turned in: a dart
    EXPECT_LT(scaled_jacobian({0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}), 0);                 // a bow tie
}

TEST(ScaledJacobian, OfNothingIsMinusOne) {
    EXPECT_EQ(scaled_jacobian({0, 0, 0}, {0, 0, 0}, {1, 1, 0}, {0, 1, 0}), -1); // two corners at one place
    EXPECT_EQ(scaled_jacobian({0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}), -1); // a line
    EXPECT_EQ(scaled_jacobian({1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}), -1);
}

TEST(ScaledJacobian, DoesNotDependOnPlaceSizeOrFirstCorner) {
    const std::array<Vec3d, 4> q = {Vec3d(0, 0, 0.1), Vec3d(1.2, 0.1, 0), Vec3d(0.9, 1.1, 0.3), Vec3d(-0.1, 0.8, 0)};
    const double expected = jacobian(q);
    EXPECT_GT(expected, 0);
    EXPECT_LT(expected, 1);
    EXPECT_NEAR(jacobian({q[1], q[2], q[3], q[0]}), expected, 1e-15);
    EXPECT_NEAR(jacobian({q[3], q[2], q[1], q[0]}), expected, 1e-15); // its normal turns with it
    const Eigen::AngleAxisd turn(0.7, Vec3d(1, 2, -1).normalized());
    for (const double scale : {1e-40, 1.0, 1e38}) {
        std::array<Vec3d, 4> moved;
        for (int k = 0; k < 4; ++k) moved[k] = scale * (turn * q[k] + Vec3d(3, -2, 1));
        EXPECT_NEAR(jacobian(moved), expected, 1e-13) << scale;
    }
}

TEST(MeasureQuads, OfAFlatSquare) {
    const QuadQuality q = measure_quads(make_wavy_plane({.resolution = 10, .amplitude = 0}), kOneThread);
    EXPECT_EQ(q.quads, 100u);
    EXPECT_EQ(q.irregular_vertices, 0u); // the border does not count
    EXPECT_NEAR(q.min_scaled_jacobian, 1, 1e-6);
    EXPECT_NEAR(q.low_scaled_jacobian, 1, 1e-6);
    EXPECT_NEAR(q.mean_scaled_jacobian, 1, 1e-6);
    EXPECT_EQ(q.inverted, 0u);
    EXPECT_LT(q.worst_quad, 100u);
}

TEST(MeasureQuads, CountsTheCornersOfACubeAsIrregular) {
    EXPECT_EQ(measure_quads(make_box(Vec3d::Zero(), Vec3d::Ones()), kOneThread).irregular_vertices, 8u);
    EXPECT_EQ(measure_quads(make_wavy_cube({.resolution = 7}), kOneThread).irregular_vertices, 8u);
    EXPECT_EQ(measure_quads(make_torus({.resolution = 9}), kOneThread).irregular_vertices, 0u);
}

TEST(MeasureQuads, OpenBordersDoNotCount) {
    Mesh open; // the cube without its top: only the four corners at the bottom are inside
    const Mesh cube = make_box(Vec3d::Zero(), Vec3d::Ones());
    open.positions = cube.positions;
    for (std::size_t f = 0; f + 1 < cube.face_count(); ++f) open.add_face(cube.face(f));
    EXPECT_EQ(measure_quads(open, kOneThread).irregular_vertices, 4u);
    EXPECT_EQ(measure_quads(open, kOneThread).quads, 5u);
}

TEST(MeasureQuads, FindsTheWorstQuadAndThePercentile) {
    Mesh mesh = make_wavy_plane({.resolution = 20, .amplitude = 0});
    const std::span<const Index> face = mesh.face(137);
    const Vec3f opposite = mesh.positions[face[2]];
    mesh.positions[face[0]] += 0.7f * (opposite - mesh.positions[face[0]]); // a dart, and only this quad
    const QuadQuality q = measure_quads(mesh, kOneThread);
    EXPECT_EQ(q.worst_quad, 137u);
    EXPECT_EQ(q.inverted, 1u);
    EXPECT_LT(q.min_scaled_jacobian, 0);
    // 4 of 400 quads are hurt, and the 1st percentile is the fourth: the best of them
    EXPECT_GT(q.low_scaled_jacobian, q.min_scaled_jacobian);
    EXPECT_LT(q.low_scaled_jacobian, 0.99);
    EXPECT_GT(q.mean_scaled_jacobian, 0.98);
    EXPECT_LT(q.mean_scaled_jacobian, 1);
}

TEST(MeasureQuads, PassesOverOtherFaces) {
    Mesh mesh = single_quad({Vec3f(0, 0, 0), Vec3f(1, 0, 0), Vec3f(1, 1, 0), Vec3f(0, 1, 0)});
    mesh.add_face(std::array<Index, 3>{0, 2, 1});
    EXPECT_EQ(measure_quads(mesh, kOneThread).quads, 1u);
    EXPECT_EQ(measure_quads(mesh, kOneThread).min_scaled_jacobian, 1);
    EXPECT_EQ(measure_quads(mesh, kOneThread).worst_quad, 0u);
    for (const Mesh& none : {Mesh(), [] {
                                 Mesh triangle;
                                 triangle.positions.assign(3, Vec3f::Zero());
                                 triangle.add_face(std::array<Index, 3>{0, 1, 2});
                                 return triangle;
                             }()}) {
        const QuadQuality q = measure_quads(none, kOneThread);
        EXPECT_EQ(q.quads, 0u);
        EXPECT_EQ(q.irregular_vertices, 0u);
        EXPECT_EQ(q.inverted, 0u);
        EXPECT_EQ(q.worst_quad, kNoIndex);
    }
}

TEST(MeasureQuads, SurvivesRepeatedVerticesAndThreeQuadsAtAnEdge) {
    Mesh mesh = single_quad({Vec3f(0, 0, 0), Vec3f(1, 0, 0), Vec3f(1, 1, 0), Vec3f(0, 1, 0)});
    mesh.add_face(std::array<Index, 4>{0, 0, 1, 1});
    mesh.add_face(std::array<Index, 4>{0, 1, 3, 2});
    const QuadQuality q = measure_quads(mesh, kOneThread);
    EXPECT_EQ(q.quads, 3u);
    EXPECT_EQ(q.inverted, 2u);
    EXPECT_EQ(q.min_scaled_jacobian, -1);
    EXPECT_EQ(q.worst_quad, 1u);
}

TEST(MeasureQuads, IsIndependentOfThreads) {
    FILIGREE_NEEDS_TWO_THREADS();
    const Mesh mesh = make_wavy_sphere({.resolution = 60});
    const QuadQuality one = measure_quads(mesh, kOneThread), two = measure_quads(mesh, RunContext(2));
    EXPECT_EQ(one.irregular_vertices, two.irregular_vertices);
    EXPECT_EQ(one.mean_scaled_jacobian, two.mean_scaled_jacobian);
    EXPECT_EQ(one.low_scaled_jacobian, two.low_scaled_jacobian);
    EXPECT_EQ(one.worst_quad, two.worst_quad);
}

} // namespace
} // namespace filigree
