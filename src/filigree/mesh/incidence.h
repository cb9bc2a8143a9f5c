// Which corners and triangles are at each vertex.
#pragma once

#include "filigree/mesh/mesh.h"

namespace filigree {

/// A list of indices for each id, end to end in one array.
struct IndexLists {
    std::vector<Index> offsets = {0}; ///< one more than there are lists, ascending
    std::vector<Index> items;

    std::size_t size() const { return offsets.empty() ? 0 : offsets.size() - 1; }
    std::span<const Index> operator[](std::size_t id) const {
        return std::span(items).subspan(offsets[id], offsets[id + 1] - offsets[id]);
    }
};

/// For each vertex the corners c with corners[c] at it, ascending. Every corner is below vertex_count, and there are
/// fewer than kNoIndex corners, as in every mesh that passes check_mesh. Cost O(V + corners).
IndexLists corners_at_vertices(std::span<const Index> corners, std::size_t vertex_count);

/// For each vertex the triangles that use it, ascending; one that uses it twice stands there twice. At most
/// kMostListedTriangles. Cost O(V + F).
IndexLists triangles_at_vertices(std::span<const Triangle> triangles, std::size_t vertex_count);

inline constexpr std::size_t kMostListedTriangles = kNoIndex / 3; ///< their corners are counted in 32 bits
/// The error (unsuitable) of a mesh that comes to more triangles than that; none for others. triangulate and
/// make_surface return it, so no array of half-edges or corners is made that 32 bits cannot count.
std::optional<Error> too_many_triangles(std::size_t count);

} // namespace filigree
