// A closed map made coarser and coarser by collapses that can be taken back one by one: what a stream of levels is
// written from.
#pragma once

#include "filigree/coding/closed_map.h"
#include "filigree/coding/geometry_code.h"
#include "filigree/coding/level_attributes.h"
#include "filigree/context.h"

namespace filigree {

/// What happened to the wedges at a collapse, on one side of its edge: the vertex's went onto the neighbour's.
struct CollapsedWedges {
    Index own = kNoIndex, onto = kNoIndex; ///< kNoIndex where a hole lies there
    /// Whether the triangle between agrees with the one that goes over, else with the one that stays.
    bool moves = false;
};

/// A vertex that went onto its neighbour, and what taking it back needs.
struct VertexCollapse {
    Index vertex, onto;
    Index left, right; ///< the neighbours of both, counter-clockwise and clockwise of the vertex, seen from `onto`
    Index triangles;   ///< that went over from the one to the other
    Index there, back; ///< the half-edges from `vertex` to `onto` and back, in the two triangles that went
    CollapsedWedges at_left = {}, at_right = {}; ///< where there are attributes
};

struct Coarsening {
    ClosedMap base;               ///< what is left, numbered anew
    std::vector<Index> vertex;    ///< of each of the base's vertices: which one it was
    std::vector<Index> half_edge; ///< of each of its triangles: its first half-edge before
    std::vector<Index> wedge_at;  ///< of each of its half-edges, where there are attributes
    /// One after the other. No two vertices of a batch are neighbours, and none takes two: so they can be taken back in
    /// any order.
    std::vector<std::vector<VertexCollapse>> batches;
};

/// Collapses edges by quadric error [Garland and Heckbert 1997], about a fifth of the vertices a batch, those that cost
/// least, until about so many are left or none can go. Vertices that close holes stay. places: of the map's vertices.
/// attributes: of the same map; a seam between wedges stays one, so that every level has a value for each corner.
/// Cost O(V log V), deterministic for any number of threads.
Coarsening coarsen(ClosedMap map, std::span<const FinePlace> places, const SurfaceAttributes& attributes,
                   std::size_t fewest, const RunContext& context);

} // namespace filigree
