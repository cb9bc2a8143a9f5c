// A closed map made coarser and coarser by collapses that can be taken back one by one: what a stream of levels is
// written from.
#pragma once

#include "filigree/coding/closed_map.h"
#include "filigree/coding/geometry_code.h"
#include "filigree/core/run_context.h"

namespace filigree {

/// A vertex that went onto its neighbour, and what taking it back needs.
struct VertexCollapse {
    Index vertex, onto;
    Index left, right; ///< the neighbours of both, counter-clockwise and clockwise of the vertex, seen from `onto`
    Index triangles;   ///< that went over from the one to the other
    Index there, back; ///< the half-edges from `vertex` to `onto` and back, in the two triangles that went
};

struct Coarsening {
    ClosedMap base;               ///< what is left, numbered anew
    std::vector<Index> vertex;    ///< of each of the base's vertices: which one it was
    std::vector<Index> half_edge; ///< of each of its triangles: its first half-edge before
    /// One after the other. No two vertices of a batch are neighbours, and none takes two: so they can be taken back in
    /// any order.
    std::vector<std::vector<VertexCollapse>> batches;
};

/// Collapses edges by quadric error [Garland and Heckbert 1997], about a fifth of the vertices a batch, those that cost
/// least, until about so many are left or none can go. Vertices that close holes stay. places: of the map's vertices.
/// Cost O(V log V), deterministic for any number of threads.
Coarsening coarsen(ClosedMap map, std::span<const FinePlace> places, std::size_t fewest, const RunContext& context);

} // namespace filigree
