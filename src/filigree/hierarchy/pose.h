// Where a driver is now.
#pragma once

#include "filigree/core/frame_source.h"
#include "filigree/core/types.h"

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

/// The sequence as a source of frames; it must outlive the source.
inline FrameSource<Pose> frames_of(const PoseSequence& sequence) {
    return {sequence.frames.size(), sequence.frames_per_second,
            [&sequence](std::size_t frame) -> Result<Pose> { return sequence.frames[frame]; }};
}

} // namespace filigree
