// A mesh's triangles as a closed surface of half-edges, which can be walked without exceptions: its holes closed by a
// vertex each, and vertices where several sheets meet taken apart.
#pragma once

#include "filigree/mesh/edges.h"

#include <span>
#include <vector>

namespace filigree {

/// Half-edge 3 t + k of triangle t goes from its corner k to the next; every one has its opposite.
struct ClosedMap {
    std::vector<Triangle> triangles; ///< over the map's vertices
    std::vector<Index> opposite;     ///< of each half-edge
    std::vector<bool> closes_hole;   ///< of each vertex: whether it belongs to no mesh

    std::size_t vertex_count() const { return closes_hole.size(); }
    Index origin(Index half_edge) const { return half_edge_start(triangles, half_edge); }
    /// The next one from the same vertex, clockwise.
    Index turn_clockwise(Index half_edge) const { return next_half_edge(opposite[half_edge]); }
    bool is_own(const Triangle& t) const { return !closes_hole[t[0]] && !closes_hole[t[1]] && !closes_hole[t[2]]; }
};

/// With the opposite of each half-edge, which is kNoIndex where none is left for it. Where several triangles share an
/// edge they are paired in their order. Cost O(F log d) where at most d half-edges begin or end at a vertex.
ClosedMap map_of(std::vector<Triangle> triangles, std::vector<bool> closes_hole);

struct ClosedSurface {
    ClosedMap map;             ///< the mesh's triangles first, in their order
    std::vector<Index> source; ///< of each of the map's vertices the mesh's, kNoIndex where it closes a hole
};

/// Of triangles of three different vertices each. Where more than two share an edge, or two in the same direction, they
/// are taken apart there. Cost O(F log F).
ClosedSurface make_closed_surface(std::span<const Triangle> triangles);

} // namespace filigree
