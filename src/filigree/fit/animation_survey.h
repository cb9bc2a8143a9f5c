// What the frames of an animation are like, in one pass: what is wrong with them, which vertices stay together, which
// frames are farthest from each other.
#pragma once

#include "filigree/context.h"
#include "filigree/file.h"
#include "filigree/result.h"

#include <cstddef>
#include <span>
#include <vector>

namespace filigree {

struct AnimationSurvey {
    /// Of each vertex the lowest that is at its place at rest and stays beside it in all frames.
    std::vector<Index> representative;
    /// Vertices at a place that an earlier one has at rest, which some frame parts from all earlier ones there.
    std::size_t parted = 0;
    std::vector<Vec3d> middles;        ///< of each frame: the mean of its vertices
    std::vector<std::size_t> farthest; ///< frames, each as far as possible from rest and from those before it
};

/// Looks at every frame. mesh: sound, with faces; rest: its positions at rest. most_farthest: at most so many frames,
/// fewer where they no longer differ. Memory: one frame, and 16 MB. Errors: unsuitable (no frames; a number that is not
/// finite; vertices in another order than the mesh's: half of a frame's edges are 20 times as long as at rest, for its
/// size), cancelled, and those of the animation.
Result<AnimationSurvey> survey_animation(const MeshAnimation& animation, std::span<const Vec3f> rest,
                                         std::size_t most_farthest, const RunContext& context);

} // namespace filigree
