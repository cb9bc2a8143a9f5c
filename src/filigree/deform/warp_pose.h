// A driver moved by a deformation of space.
#pragma once

#include "filigree/deform/space_warp.h"
#include "filigree/hierarchy/model.h"
#include "filigree/hierarchy/pose.h"

namespace filigree {

/// The model's driver, each vertex warped and with the warp's own gradient there. Cost O(driver).
Pose warp_pose(const SpaceWarp& warp, const Model& model, const RunContext& context);

} // namespace filigree
