// How the quads asked for are laid out as patches and levels.
#pragma once

#include "filigree/types.h"

#include <optional>

namespace filigree {

constexpr unsigned kMostQuadLevels = 8;
constexpr std::size_t kMostPatches = 4'000'000; // indices are 32 bits, and a base is refined before it is decimated

/// So many patches, each of 4^levels quads.
struct PatchLayout {
    std::size_t patches = 0;
    unsigned levels = 0;
};

/// About `quads` quads at the levels asked for; at as many as leave 500 patches or more where they are not.
PatchLayout plan_patches(std::size_t quads, std::optional<unsigned> levels);

/// The patches that so many separate parts take at least.
std::size_t least_patches(std::size_t parts);

/// With fewer levels and more patches, until there are `least` patches or one level.
PatchLayout with_more_patches(PatchLayout layout, std::size_t least);

/// One level fewer and four times the patches; nothing where that is no level, or too many patches.
std::optional<PatchLayout> finer_layout(const PatchLayout& layout);

} // namespace filigree
