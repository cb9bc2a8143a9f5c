// Clips: numbers of a driver's vertices over time, as a few curves in time and how much of each a vertex follows
// [principal components; Alexa and Mueller 2000].
#pragma once

#include "filigree/types.h"

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace filigree {

/// In which order vertices are coded; beside each (but the first of a part) one that came before.
struct ClipOrder {
    std::vector<Index> vertex, near; ///< near: kNoIndex where there is none
};

/// Depends on who is whose neighbour alone. Cost O(corners).
ClipOrder clip_order(std::span<const Index> face_offsets, std::span<const Index> corners, std::size_t vertices);

/// Of each frame the numbers of all vertices, one vertex after the other.
using ClipFrames = std::vector<std::vector<float>>;

/// A block of frames, at most kClipFrames. weights: what one unit of each of a vertex's numbers moves, model units;
/// error: how far the block may be off (rms, model units) in each number so weighed. Cost O(frames^2 x numbers).
std::string encode_clip(const ClipFrames& frames, std::span<const double> weights, double error,
                        const ClipOrder& order);
inline constexpr std::size_t kClipFrames = 128;
/// None: damaged, or of more than most_frames. The frames have as many numbers a vertex as there are weights.
std::optional<ClipFrames> decode_clip(std::string_view stream, std::size_t numbers, const ClipOrder& order,
                                      std::size_t most_frames = kClipFrames);

} // namespace filigree
