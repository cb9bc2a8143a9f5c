// Which parts of a surface lie inside which others.
#pragma once

#include "filigree/mesh.h"

namespace filigree {

/// For each of the closed parts of a surface, in how many others it lies. part: of each triangle, kNoIndex for those
/// that do not count. looks_inwards: 1 for parts whose faces do, if there are any. A part lies in another where the
/// matter just behind its faces does, at all of up to 16 places that are looked at: so parts that cross or touch from
/// outside lie beside each other. Cost O(F) where rays along x meet few triangles, and O(parts^2) up to 512 parts.
std::vector<Index> nesting_depths(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                                  std::span<const Index> part, std::size_t part_count,
                                  std::span<const std::uint8_t> looks_inwards = {});

} // namespace filigree
