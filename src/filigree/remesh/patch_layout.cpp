#include "filigree/remesh/patch_layout.h"

#include "filigree/core/math.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

constexpr double kEnoughPatches = 500;     // levels that were not asked for leave so many, or more
constexpr std::size_t kLeastTriangles = 8; // of the base, for each part

} // namespace

PatchLayout plan_patches(std::size_t quads, std::optional<unsigned> levels) {
    PatchLayout layout;
    layout.levels = levels.value_or(1);
    if (!levels)
        while (layout.levels < kMostQuadLevels && double(quads) / math::pow(4.0, layout.levels + 1) >= kEnoughPatches)
            ++layout.levels;
    const double patches = double(quads) / math::pow(4.0, layout.levels);
    layout.patches = std::max<std::size_t>(1, static_cast<std::size_t>(std::llround(patches)));
    return layout;
}

std::size_t least_patches(std::size_t parts) { return kLeastTriangles / 2 * parts; }

PatchLayout with_more_patches(PatchLayout layout, std::size_t least) {
    while (layout.patches < least && layout.levels > 1) layout = {4 * layout.patches, layout.levels - 1};
    return layout;
}

std::optional<PatchLayout> finer_layout(const PatchLayout& layout) {
    if (layout.levels < 2 || layout.patches > kMostPatches / 4) return std::nullopt;
    return PatchLayout{4 * layout.patches, layout.levels - 1};
}

} // namespace filigree
