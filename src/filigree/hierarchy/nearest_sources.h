// Which of some vertices is nearest to each, along the surface.
#pragma once

#include "filigree/mesh/edges.h"

namespace filigree {

/// For each vertex the nearest vertex with `is_source`, by the length of the shortest path over edges; kNoIndex where
/// there is none. Ties go to the path found first, which depends on the mesh alone. around: the triangles at each
/// vertex. Cost about O(V). Instead of a heap, buckets as wide as a mean edge, emptied in order [Meyer 2003].
std::vector<Index> nearest_sources(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                                   const IndexLists& around, const std::vector<bool>& is_source);

} // namespace filigree
