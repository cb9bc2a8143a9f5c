// Which corners and triangles are at each vertex.
#pragma once

#include "filigree/mesh/mesh.h"

namespace filigree {

/// A list of indices for each id, end to end in one array.
struct IndexLists {
    std::vector<Index> offsets = {0}; ///< one more than there are lists, ascending
    std::vector<Index> items;

    std::size_t size() const { return offsets.size() - 1; }
    std::span<const Index> operator[](std::size_t id) const {
        return std::span(items).subspan(offsets[id], offsets[id + 1] - offsets[id]);
    }
};

/// For each vertex the corners c with corners[c] at it, ascending. Every corner is below vertex_count, and there are
/// fewer than 2^32 corners. Cost O(V + corners).
IndexLists corners_at_vertices(std::span<const Index> corners, std::size_t vertex_count);

/// For each vertex the triangles that use it, ascending; one that uses it twice stands there twice. At most
/// kMostListedTriangles. Cost O(V + F).
IndexLists triangles_at_vertices(std::span<const Triangle> triangles, std::size_t vertex_count);

inline constexpr std::size_t kMostListedTriangles = kNoIndex / 3; ///< their corners are counted in 32 bits

} // namespace filigree
