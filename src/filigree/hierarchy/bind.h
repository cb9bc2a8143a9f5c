// Which driver triangle each vertex belongs to.
#pragma once

#include "filigree/context.h"
#include "filigree/hierarchy/loose_parts.h"
#include "filigree/mesh/surface.h"

namespace filigree {

/// Where a vertex hangs: on triangle `cell` at (1 - u - v, u, v), all three >= 0.
struct Bond {
    Index cell = kNoIndex;
    float u = 0, v = 0;
};

/// Vertices that were taken off a mesh round by round, each of which hangs near one that its round left.
struct RemovedVertices {
    std::vector<Index> nearest_left;   ///< of each vertex; kNoIndex: it was not removed, or alone
    std::vector<std::uint8_t> removed; ///< in which round, from 1 on; 0: in none
    std::uint8_t rounds = 0;
    bool empty() const { return nearest_left.empty(); }
};

/// A bond a vertex, and what could not be bound the good way.
struct Binding {
    std::vector<Bond> bonds;
    /// Not connected along the surface to any driver vertex (a loose part, a loose vertex): bound across the gap to the
    /// driver below the surface beside it, see hang_loose_parts. Ascending vertex ids.
    std::vector<Index> across_gap;
    /// No triangle nearby along the surface faces the same way; bound to one that does not and is much closer.
    /// Ascending.
    std::vector<Index> facing_away;
};

/// Binds every vertex to the closest point of a driver triangle that it belongs to along the surface and that faces the
/// same way: labels spread from the driver's vertices over the mesh's edges, then each vertex walks from its label's
/// triangles downhill to the closest one. Plain closest points would take the other side of thin parts.
/// positions: V points; surface: over them; normals: V, unit or zero; cells: driver triangles over representatives (at
/// least one); beside: the surface's triangles that loose parts may hang on. A vertex gets its representative's bond.
/// Cost O(V log V); same bytes for any thread count. Errors: unsuitable (more than kMostListedTriangles), cancelled.
Result<Binding> bind_to_driver(std::span<const Vec3f> positions, const Surface& surface, std::span<const Vec3f> normals,
                               std::span<const Triangle> cells, std::span<const Triangle> beside,
                               const RunContext& context);

/// The same with what is nearest to each vertex already known: vertices of cells. A vertex that was removed walks from
/// the cell of the one it hangs near. removed: of V vertices, or empty.
Result<Binding> bind_to_driver(std::span<const Vec3f> positions, const Surface& surface, std::span<const Vec3f> normals,
                               std::span<const Triangle> cells, const NearestDriver& nearest,
                               const RemovedVertices& removed, const RunContext& context);

} // namespace filigree
