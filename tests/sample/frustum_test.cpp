#include "filigree/sample/frustum.h"

#include "filigree/mesh/shapes.h"
#include "filigree/sample/inside_test.h"
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
    const auto from_eye = InsideTest::create(cube, options, kContext)->contains(points, kContext).value();
    const auto from_elsewhere =
        InsideTest::create(cube, by(InsideMethod::rays), kContext)->contains(points, kContext).value();
    EXPECT_EQ(from_eye, from_elsewhere);
    EXPECT_GT(std::count(from_eye.begin(), from_eye.end(), 1), 200);
    frustum.near = 6;
    EXPECT_EQ(frustum_points(frustum).error().code, ErrorCode::usage);
}

} // namespace
} // namespace filigree
