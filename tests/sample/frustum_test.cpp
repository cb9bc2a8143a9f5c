#include "filigree/sample/frustum.h"

#include "filigree/mesh.h"
#include "filigree/sample.h"
#include "sample/bodies.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

TEST(Frustum, PointsInsideAreThoseThatRaysFind) {
    const Mesh cube = make_wavy_cube({.resolution = 16});
    Frustum frustum{.eye = {0.3, 0.2, 4}, .target = {0, 0, 0}, .near = 2.5, .far = 5.5, .counts = {20, 20, 20}};
    const auto points = frustum_points(frustum).value();
    ASSERT_EQ(points.size(), 8000u);
    InsideOptions options = by(InsideMethod::rays);
    options.eye = frustum.eye;
    const auto from_eye = InsideTest::create(cube, options, kAllThreads)->contains(points, kAllThreads).value();
    const auto from_elsewhere =
        InsideTest::create(cube, by(InsideMethod::rays), kAllThreads)->contains(points, kAllThreads).value();
    EXPECT_EQ(from_eye, from_elsewhere);
    EXPECT_GT(std::count(from_eye.begin(), from_eye.end(), 1), 200);
    for (const double near : {6.0, 0.0, -1.0}) {
        frustum.near = near;
        EXPECT_EQ(frustum_points(frustum).error().code, ErrorCode::usage) << near;
    }
}

TEST(Frustum, MorePointsThanMemoryWouldHoldAreRefused) {
    Frustum frustum{.eye = {0, 0, 4}, .target = {0, 0, 0}, .near = 2, .far = 6, .counts = {1 << 14, 1 << 14, 1}};
    frustum.counts[2] = 2; // 2^29; a mutant of the bound escaped once
    EXPECT_EQ(frustum_points(frustum).error().code, ErrorCode::usage);
    frustum.counts = {(1 << 14) + 1, 1 << 14, 1}; // just above
    EXPECT_EQ(frustum_points(frustum).error().code, ErrorCode::usage);
}

/// How far the box reaches along the view, from the eye.
std::pair<double, double> depths(const Frustum& frustum, const Box& box) {
    const Vec3d forward = (frustum.target - frustum.eye).normalized();
    double least = 1e300, most = -1e300;
    for (int k = 0; k < 8; ++k) {
        const Vec3d corner(k & 1 ? box.max.x() : box.min.x(), k & 2 ? box.max.y() : box.min.y(),
                           k & 4 ? box.max.z() : box.min.z());
        const double depth = forward.dot(corner - frustum.eye);
        least = std::min(least, depth);
        most = std::max(most, depth);
    }
    return {least, most};
}

TEST(Frustum, EachSideHasItsOwnCount) {
    const Frustum frustum{.eye = {0, 0, 4},
                          .target = {0, 0, 0},
                          .field_of_view_deg = 90,
                          .aspect = 2,
                          .near = 1,
                          .far = 4,
                          .counts = {4, 2, 3}};
    const std::vector<Vec3d> points = *frustum_points(frustum);
    ASSERT_EQ(points.size(), 24u);
    std::size_t p = 0;
    for (const double depth : {1.5, 2.5, 3.5}) // from the eye; half as high as wide, with middles of cells
        for (const double y : {-0.5, 0.5})
            for (const double x : {-1.5, -0.5, 0.5, 1.5})
                EXPECT_LT((points[p++] - Vec3d(depth * x, depth * y, 4 - depth)).norm(), 1e-12);
}

TEST(Frustum, AroundABoxReachesFromBeforeToBehindIt) {
    const Box box{Vec3d(1, 2, 3), Vec3d(3, 3, 4)};
    for (const std::optional<Vec3d>& eye : {std::optional<Vec3d>(), std::optional(Vec3d(-9, 4, 2))}) {
        const Frustum frustum = frustum_around(box, eye);
        const auto [least, most] = depths(frustum, box);
        EXPECT_EQ(frustum.target, box.centre());
        EXPECT_EQ(frustum.eye, eye.value_or(frustum.eye));
        EXPECT_LE(frustum.near, least);
        EXPECT_GE(frustum.far, most);
        EXPECT_LT(frustum.far - frustum.near, 1.001 * box.diagonal());
    }
    EXPECT_GT(frustum_around(box, Vec3d(1.5, 2.5, 3.5)).near, 0); // from within
}

} // namespace
} // namespace filigree
