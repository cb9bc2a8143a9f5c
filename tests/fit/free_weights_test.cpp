// Weights that move: closer to the animation, within their cells, the same on any number of threads.
#include "made_animations.h"

#include "filigree/fit.h"
#include "filigree/pack.h"
#include "filigree/restore.h"

#include <filesystem>
#include <gtest/gtest.h>
#include <unistd.h>

namespace filigree {
namespace {

using namespace filigree_test;

Fitted fitted(const MadeAnimation& made, unsigned rounds, unsigned threads = 1) {
    return fit_animation(made.animation, {.base = 60, .weight_rounds = rounds}, RunContext(threads)).value();
}

TEST(FreeWeights, FollowACharacterMoreClosely) {
    const MadeAnimation made = skinned(wavy_sphere(16), 6, 8);
    const Fitted bound = fitted(made, 0), moved = fitted(made, 3);
    EXPECT_FALSE(bound.report.has_free_weights);
    EXPECT_TRUE(moved.report.has_free_weights);
    EXPECT_EQ(moved.report.driver_vertices, bound.report.driver_vertices);
    EXPECT_LT(moved.report.rms, 0.7 * bound.report.rms);
    for (std::size_t r = 0; r < moved.model.detail.u.size(); ++r) {
        const float u = moved.model.detail.u[r], v = moved.model.detail.v[r];
        EXPECT_TRUE(u >= 0 && v >= 0 && u + v <= 1 + 1e-6f) << u << ' ' << v;
    }
    // The mesh at rest is the mesh, whatever the weights.
    const Restorer restorer = Restorer::create(moved.model).value();
    std::vector<Vec3f> rest(moved.model.vertex_count());
    Pose pose = rest_pose(moved.model);
    pose.gradients.assign(pose.positions.size(), Mat3f::Identity());
    ASSERT_TRUE(restorer.positions(pose, rest));
    for (std::size_t v = 0; v < rest.size(); ++v)
        EXPECT_LE((rest[v] - moved.model.mesh.positions[v]).norm(), 1e-6 * moved.report.diagonal);
}

TEST(FreeWeights, AreTheSameOnAnyNumberOfThreads) {
    const MadeAnimation made = skinned(wavy_sphere(12), 4, 5);
    const Fitted one = fitted(made, 2, 1), four = fitted(made, 2, 4);
    EXPECT_EQ(write_model(one.model, one.poses), write_model(four.model, four.poses));
}

TEST(FreeWeights, StayInAPackedFile) {
    const MadeAnimation made = skinned(wavy_sphere(16), 6, 8);
    const Fitted moved = fitted(made, 3);
    const std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("free_weights_" + std::to_string(::getpid()) + ".fil");
    const PackReport packed =
        pack_model(moved.model, moved.poses, {.bits = 16, .clip_error = moved.report.rms / 3}, path).value();
    EXPECT_TRUE(packed.has_records);
    const double rms =
        animation_error(read_model(path).value(), read_poses(path).value(), made.animation, packed.vertex_order)
            .value()
            .rms;
    EXPECT_LT(rms, 1.15 * moved.report.rms * moved.report.diagonal);
    std::filesystem::remove(path);
}

} // namespace
} // namespace filigree
