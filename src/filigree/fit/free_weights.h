// Weights of vertices that follow an animation better than those of binding.
#pragma once

#include "filigree/fit/fitted_poses.h"

#include <functional>
#include <span>

namespace filigree {

/// Reads frame k into `positions`, one a vertex of the model.
using FrameReader = std::function<Status(std::size_t frame, std::span<Vec3f> positions)>;

/// Moves the two weights of every vertex within its cell, so that the restored mesh is closer to the animation in these
/// poses: one Gauss-Newton step over all frames, kept where the vertex then is closer. The mesh at rest does not depend
/// on weights. Returns how many vertices moved. Cost: two passes over the frames, O(V) each. Memory: 64 bytes a vertex.
/// Same bytes for any number of threads. Errors: cancelled, and those of `frame`.
Result<std::size_t> move_weights(Model& model, std::span<const Pose> poses, const FrameReader& frame,
                                 const RunContext& context);

/// Fits poses, then moves weights and fits again, `rounds` times or until little is won. Weights of a round that makes
/// the error larger are taken back.
Result<FittedPoses> fit_poses_and_weights(Model& model, std::size_t frames, const FrameReader& frame, unsigned rounds,
                                          const PoseFitOptions& options, const RunContext& context);

} // namespace filigree
