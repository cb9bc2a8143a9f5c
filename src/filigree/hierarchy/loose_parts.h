// Parts of a mesh that its driver has no vertex of: rivets, buttons, eyelashes, leaves, loose vertices.
#pragma once

#include "filigree/context.h"
#include "filigree/mesh/surface.h"

namespace filigree {

/// Where each vertex begins to look for its cell.
struct NearestDriver {
    std::vector<Index> vertex;          ///< a driver vertex near each; kNoIndex: none is known
    std::vector<std::uint8_t> is_loose; ///< 1: its part has no driver vertex. Empty: there is no such part
    bool loose(std::size_t v) const { return !is_loose.empty() && is_loose[v] != 0; }
};

/// Hangs the parts (what edges connect) that have no driver vertex on the surface beside them. A part hangs at the
/// place where it comes closest to a part that has driver vertices: its vertex there begins at the driver vertex of
/// that place. Its other vertices begin where their neighbours did, and go from driver vertex to driver vertex as long
/// as these come closer, so that a small part stays together on one neighbourhood of the driver, whatever it faces.
/// Further off than an edge of the driver, a vertex begins at the closest cell.
///
/// source: of each vertex the driver vertex nearest along the surface, or kNoIndex. beside: triangles of the mesh, or
/// of a level of it, that parts may hang on; those with a corner that has no source are passed over. cells: the
/// driver's, over the same vertices. Without such triangles loose vertices keep kNoIndex.
/// Cost O(V + F), and a closest point for each loose vertex.
NearestDriver hang_loose_parts(std::span<const Vec3f> positions, const Surface& surface,
                               std::span<const Triangle> beside, std::span<const Triangle> cells,
                               std::vector<Index> source, const RunContext& context);

} // namespace filigree
