#include "filigree/deform/carried_points.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace filigree {
namespace {

const std::vector<Vec3f> kCorners = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}};
const std::vector<Vec3f> kPoints = {{0.2f, 0.3f, 0.4f}, {0.9f, 0.1f, 0.1f}};

TEST(CarriedPoints, GoAlongWithARigidMotion) {
    const Mat3f turn = Eigen::AngleAxisf(0.7f, Vec3f(1, 2, 3).normalized()).toRotationMatrix();
    const Vec3f way(3, -2, 1);
    Pose pose;
    for (const Vec3f& p : kCorners) pose.positions.push_back(turn * p + way);
    pose.gradients.assign(kCorners.size(), turn);
    const std::vector<Vec3f> carried = carried_points(kPoints, kCorners, pose, RunContext());
    for (std::size_t i = 0; i < kPoints.size(); ++i) EXPECT_LT((carried[i] - (turn * kPoints[i] + way)).norm(), 1e-5f);
}

TEST(CarriedPoints, FollowTheNearestVertexMost) {
    Pose pose{kCorners, {}};
    pose.positions[1] += Vec3f(0, 0, 1); // the corner beside the second point
    const std::vector<Vec3f> carried = carried_points(kPoints, kCorners, pose, RunContext());
    EXPECT_GT(carried[1].z() - kPoints[1].z(), 0.9f);
    EXPECT_LT(carried[0].z() - kPoints[0].z(), 0.3f);
    EXPECT_TRUE(carried_points({}, kCorners, pose, RunContext()).empty());
}

TEST(CarriedPoints, UnitsOfAnySizeServe) {
    const Mat3f turn = Eigen::AngleAxisf(0.7f, Vec3f(1, 2, 3).normalized()).toRotationMatrix();
    Pose pose;
    for (const Vec3f& p : kCorners) pose.positions.push_back(turn * p + Vec3f(3, -2, 1) + 0.1f * p.cwiseProduct(p));
    pose.gradients.assign(kCorners.size(), turn);
    const std::vector<Vec3f> usual = carried_points(kPoints, kCorners, pose, RunContext());
    for (const int power : {-100, -30, -23, 32, 40, 100}) {
        const auto scaled = [&](std::vector<Vec3f> points) {
            for (Vec3f& p : points) p *= std::exp2(float(power));
            return points;
        };
        const Pose there{scaled(pose.positions), pose.gradients};
        EXPECT_EQ(carried_points(scaled(kPoints), scaled(kCorners), there, RunContext()), scaled(usual)) << power;
    }
    const std::vector<Vec3f> far = {{1e15f, 0, 0}};
    EXPECT_TRUE(carried_points(far, kCorners, pose, RunContext())[0].allFinite());
}

} // namespace
} // namespace filigree
