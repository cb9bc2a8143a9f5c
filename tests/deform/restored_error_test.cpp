#include "filigree/deform/restored_error.h"

#include "filigree/deform/space_warp.h"
#include "filigree/hierarchy/strip.h"
#include "filigree/mesh/shapes.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

const RunContext kContext;

TEST(RestoredError, IsNoneAtRestAndSmallUnderAWarp) {
    const Model model = strip(make_wavy_cube({.resolution = 24}), {.base = 300}, kContext).value().model;
    EXPECT_LT(restored_error(model, {}, {}, model.mesh.positions, kContext)->max, 1e-6);
    const auto bend = make_bend(world_bounds(model.mesh), Axis::y, 60);
    const std::vector<Vec3f> full = warp_positions(*bend, model.mesh.positions, model.mesh.origin, kContext);
    const Pose pose = warp_pose(*bend, model, kContext);
    EXPECT_LT(restored_error(model, {}, pose, full, kContext)->rms, 0.01);
    EXPECT_GT(restored_error(model, {}, {}, full, kContext)->rms, 0.1); // the pose left out
    const auto driver = restored_error(model, {.level = 0}, pose, full, kContext);
    EXPECT_EQ(driver->per_vertex.size(), model.driver().vertices.size());
    EXPECT_LT(driver->max, 1e-5); // the driver is where the warp puts it
}

TEST(RestoredError, RefusesPlacesOfAnotherMesh) {
    const Model model = strip(make_wavy_cube({.resolution = 8}), {.base = 100}, kContext).value().model;
    EXPECT_EQ(restored_error(model, {}, {}, std::vector<Vec3f>(7), kContext).error().code, ErrorCode::mismatch);
}

} // namespace
} // namespace filigree
