// The adjoint of restoring is the transposed matrix, for every level and any number of threads.
#include "filigree/blend/restore_adjoint.h"

#include "filigree/mesh.h"
#include "filigree/restore.h"

#include <gtest/gtest.h>

#include <cstring>
#include <random>

namespace filigree {
namespace {

TEST(RestoreAdjoint, IsTheTransposeOfRestoring) {
    const Mesh mesh = make_wavy_sphere({.resolution = 16});
    const Model model = strip(mesh, {.levels = 2}).value().model;
    for (unsigned level = 0; level <= model.finest_level(); ++level) {
        const Restorer restorer = Restorer::create(model, {.level = level}).value();
        const RestoreAdjoint adjoint = RestoreAdjoint::create(model, level, RunContext()).value();
        ASSERT_EQ(adjoint.vertex_count(), restorer.vertex_count());
        std::mt19937 random(level + 1);
        std::normal_distribution<float> any;
        const auto vector = [&] { return Vec3f(any(random), any(random), any(random)); };
        Pose pose = rest_pose(model);
        for (Vec3f& p : pose.positions) p = vector();
        pose.gradients.resize(pose.positions.size());
        for (Mat3f& gradient : pose.gradients) gradient << vector(), vector(), vector();
        std::vector<Vec3f> pull(restorer.vertex_count());
        for (Vec3f& v : pull) v = vector();

        const std::vector<Vec3f> restored = restorer.positions(pose).value();
        double forward = 0, sizes = 0, back = 0;
        for (std::size_t i = 0; i < pull.size(); ++i) {
            forward += pull[i].cast<double>().dot(restored[i].cast<double>());
            sizes += pull[i].cast<double>().norm() * restored[i].cast<double>().norm();
        }
        const PoseDerivative found = adjoint.apply(pull, RunContext(2)).value();
        for (std::size_t i = 0; i < pose.positions.size(); ++i)
            back += found.positions[i].cast<double>().dot(pose.positions[i].cast<double>()) +
                    found.gradients[i].cast<double>().cwiseProduct(pose.gradients[i].cast<double>()).sum();
        EXPECT_NEAR(forward, back, 1e-6 * sizes) << level;

        const PoseDerivative alone = adjoint.apply(pull, RunContext(1)).value();
        EXPECT_EQ(std::memcmp(alone.gradients.data(), found.gradients.data(), found.gradients.size() * sizeof(Mat3f)),
                  0);
        EXPECT_EQ(adjoint.apply(std::span(pull).first(3), RunContext()).error().code, ErrorCode::mismatch);
    }
    EXPECT_EQ(RestoreAdjoint::create(model, 99u, RunContext()).error().code, ErrorCode::usage);
}

} // namespace
} // namespace filigree
