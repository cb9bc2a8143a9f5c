// A camera that follows: what it sees, and how evenly it moves.
#include "filigree/present/follow_camera.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

constexpr double kAspect = 4.0 / 3;
constexpr std::size_t kFrames = 120;

/// The corners of a cube of that size about a point.
std::vector<Vec3f> cube_at(const Vec3d& middle, double size) {
    std::vector<Vec3f> corners;
    for (int k = 0; k < 8; ++k)
        corners.push_back((middle + 0.5 * size * Vec3d(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1)).cast<float>());
    return corners;
}

/// A cube that bounces along x in leaps of half a second.
std::vector<std::vector<Vec3f>> bouncing(double leap) {
    std::vector<std::vector<Vec3f>> points;
    for (std::size_t frame = 0; frame < kFrames; ++frame) {
        const double t = double(frame % 30) / 30;
        points.push_back(cube_at({leap * double(frame) / 30, 4 * leap * t * (1 - t), 0}, 1));
    }
    return points;
}

FollowOptions options() {
    return {.direction = view_direction(View::iso, UpAxis::y), .up = Vec3d::UnitY(), .aspect = kAspect};
}

/// One camera that sees all frames.
Camera still_camera(const std::vector<std::vector<Vec3f>>& points) {
    std::vector<Vec3f> all;
    for (const auto& frame : points) all.insert(all.end(), frame.begin(), frame.end());
    const CameraPoints everything{all};
    return fit_camera(std::span(&everything, 1), options().direction, Vec3d::UnitY(), kAspect);
}

TEST(FollowCamera, SeesEveryFrameFromOneDirectionAndCloser) {
    const auto points = bouncing(5);
    const std::vector<Camera> cameras = follow_cameras(points, options());
    ASSERT_EQ(cameras.size(), kFrames);
    double nearest = 1e9;
    for (std::size_t frame = 0; frame < kFrames; ++frame) {
        const Camera& camera = cameras[frame];
        EXPECT_LT((camera.basis() - cameras[0].basis()).norm(), 1e-9);
        for (const Vec3f& p : points[frame]) {
            const Vec3d at = camera.project(p.cast<double>(), 400, 300);
            EXPECT_TRUE(at.x() > 0 && at.x() < 400 && at.y() > 0 && at.y() < 300 && at.z() > 0) << frame;
        }
        nearest = std::min(nearest, (camera.eye - camera.target).norm());
    }
    const Camera still = still_camera(points);
    EXPECT_LT(nearest, 0.6 * (still.eye - still.target).norm());
}

/// The cube turns round within a frame; the camera takes many.
TEST(FollowCamera, MovesMoreEvenlyThanWhatItFollows) {
    const std::vector<Camera> cameras = follow_cameras(bouncing(5), options());
    const double size = (cameras[60].eye - cameras[60].target).norm();
    for (std::size_t frame = 1; frame + 1 < cameras.size(); ++frame)
        EXPECT_LT((cameras[frame + 1].eye - 2 * cameras[frame].eye + cameras[frame - 1].eye).norm(), 2e-3 * size);
}

TEST(FollowCamera, FollowsInAFilmOfASecondToo) {
    std::vector<std::vector<Vec3f>> points;
    for (std::size_t frame = 0; frame < 60; ++frame) points.push_back(cube_at({0.3 * double(frame), 0, 0}, 1));
    const std::vector<Camera> cameras = follow_cameras(points, options());
    ASSERT_EQ(cameras.size(), 60U);
    EXPECT_GT((cameras.back().eye - cameras.front().eye).norm(), 3);
    const Camera still = still_camera(points);
    EXPECT_LT((cameras[30].eye - cameras[30].target).norm(), 0.65 * (still.eye - still.target).norm());
}

TEST(FollowCamera, StandsStillWhereThatShowsAsMuch) {
    EXPECT_EQ(follow_cameras(bouncing(0.1), options()).size(), 1u);
    const std::vector<std::vector<Vec3f>> one = {cube_at({0, 0, 0}, 1)};
    EXPECT_EQ(follow_cameras(one, options()).size(), 1u);
}

} // namespace
} // namespace filigree
