// Where a driver is now.
#pragma once

#include "filigree/core/result.h"
#include "filigree/core/types.h"

#include <functional>

namespace filigree {

/// Positions of a model's driver (level 0), in its vertex order and relative to the mesh's origin, and optionally the
/// deformer's gradients: how the space around each vertex is deformed.
struct Pose {
    std::vector<Vec3f> positions;
    std::vector<Mat3f> gradients; ///< empty or one a driver vertex
};

/// Poses of one driver, moment after moment: positions, and gradients in all of them or in none.
struct PoseSequence {
    double frames_per_second = 60;
    std::vector<Pose> frames;

    bool empty() const { return frames.empty(); }
};

/// The same fetched one frame at a time, for sequences that need not fit into memory.
struct PoseStream {
    std::size_t frames = 0;
    double frames_per_second = 60;
    /// The pose of a frame, 0 .. frames - 1; in any order, and again. Positions are relative to the mesh's origin.
    std::function<Result<Pose>(std::size_t frame)> pose;
    double metres_per_unit = 0; ///< 0: not known
};

/// The sequence as a stream; it must outlive the stream.
inline PoseStream stream_of(const PoseSequence& sequence) {
    return {sequence.frames.size(), sequence.frames_per_second,
            [&sequence](std::size_t frame) -> Result<Pose> { return sequence.frames[frame]; }};
}

} // namespace filigree
