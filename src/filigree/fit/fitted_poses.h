// The poses of one driver for many frames, and how far the restored mesh is from each.
#pragma once

#include "filigree/context.h"
#include "filigree/fit.h"
#include "filigree/fit/pose_fit.h"
#include "filigree/result.h"
#include "filigree/strip.h"

#include <cstddef>
#include <functional>
#include <vector>

namespace filigree {

struct FittedPoses {
    std::vector<Pose> poses;
    AnimationError error;
};

/// Fits every frame, restores it, and measures it. frame(k, positions) writes the positions of frame k, one a vertex of
/// the model.
/// Memory: two frames, and the poses. Errors: unsuitable, cancelled, and those of `frame`.
Result<FittedPoses> fit_poses(const Model& model, std::size_t frames,
                              const std::function<Status(std::size_t frame, std::span<Vec3f> positions)>& frame,
                              const PoseFitOptions& options, const RunContext& context);

} // namespace filigree
