#include "filigree/deform/restored_error.h"

#include "filigree/mesh.h"
#include "filigree/pose.h"
#include "filigree/strip.h"
#include "threads.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

TEST(RestoredError, IsNoneAtRestAndSmallUnderAWarp) {
    const Model model = strip(make_wavy_cube({.resolution = 24}), {.base = 300}, kAllThreads).value().model;
    EXPECT_LT(restored_error(model, {}, {}, model.mesh.positions, kAllThreads)->max, 1e-6);
    const auto bend = make_bend(world_bounds(model.mesh), Axis::y, 60);
    const std::vector<Vec3f> full = warp_positions(*bend, model.mesh.positions, model.mesh.origin, kAllThreads);
    const Pose pose = warp_pose(*bend, model, kAllThreads);
    EXPECT_LT(restored_error(model, {}, pose, full, kAllThreads)->rms, 0.01);
    EXPECT_GT(restored_error(model, {}, {}, full, kAllThreads)->rms, 0.1); // the pose left out
    const auto driver = restored_error(model, {.level = 0}, pose, full, kAllThreads);
    EXPECT_EQ(driver->per_vertex.size(), model.driver().vertices.size());
    EXPECT_LT(driver->max, 1e-5); // the driver is where the warp puts it
}

TEST(RestoredError, RefusesPlacesOfAnotherMesh) {
    const Model model = strip(make_wavy_cube({.resolution = 8}), {.base = 100}, kAllThreads).value().model;
    EXPECT_EQ(restored_error(model, {}, {}, std::vector<Vec3f>(7), kAllThreads).error().code, ErrorCode::mismatch);
}

} // namespace
} // namespace filigree
