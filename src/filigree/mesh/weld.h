// Vertices at the same place, made one.
#pragma once

#include "filigree/types.h"

namespace filigree {

/// For each vertex the lowest vertex id at exactly its position (-0 equals 0). Cost O(V), by hashing.
std::vector<Index> weld_map(std::span<const Vec3f> positions);

} // namespace filigree
