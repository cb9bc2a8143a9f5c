// A film that is quick to draw and rough to look at, to see whether the motion is right.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

namespace filigree::cli {

inline constexpr unsigned kDraftPasses = 4, kDraftSide = 480;
inline constexpr std::size_t kDraftTriangles = 60'000;
inline constexpr const char* kDraftHelp =
    "Films: 480 pixels wide at most, 4 passes, no body of more than 60,000 triangles; quick, to judge the motion";

/// The same shape, with its longer side no longer than a draft's; both sides even.
inline std::array<unsigned, 2> draft_size(std::array<unsigned, 2> size) {
    const double part = std::min(1.0, double(kDraftSide) / std::max(size[0], size[1]));
    for (unsigned& side : size) side = std::max(16u, unsigned(side * part) / 2 * 2);
    return size;
}

} // namespace filigree::cli
