// What remeshing works on: an oriented triangle manifold that remembers the mesh it came from.
#pragma once

#include "filigree/remesh.h"

#include "filigree/context.h"
#include "filigree/mesh.h"

#include <vector>

namespace filigree {

/// Triangles over welded vertices. Every edge has one or two triangles, which run along it in opposite directions;
/// the triangles of a vertex form one fan. Triangles may have no area, but never repeat a vertex.
struct ManifoldSurface {
    std::vector<Vec3d> positions;    ///< model units, relative to the mesh's origin; every one is used
    std::vector<Triangle> triangles; ///< counter-clockwise seen from outside
    /// The corners of the mesh (indices into Mesh::corners) that each triangle's vertices come from, in the triangle's
    /// order; kNoIndex three times for triangles that were filled in. Empty when the surface is not the mesh's own (a
    /// wrap).
    std::vector<Triangle> source_corners;
};

/// Any mesh as a manifold: triangulates, welds vertices at the same position, drops triangles that repeat a vertex or
/// the vertices of an earlier one, glues edges with exactly two triangles, orients each component
/// (mesh/orientation.h), cuts what cannot be glued, and gives each fan its own vertex. Nothing else moves or goes.
/// Where bodies touch along an edge they come apart closed: the two sides of each solid wedge are glued. Where they
/// share a wall (triangles that are there twice, with the surface going on all around them) the wall goes and they
/// become one; a sheet that is there twice and meets a closed surface along some edges becomes a component of its own.
/// Vertices and triangles keep the mesh's order.
/// Adds to `report`. Errors: usage (check_mesh refuses the mesh), unsuitable (no face with an area is left; more
/// triangles than kMostListedTriangles, see mesh/edges.h), cancelled. Cost O(F log F).
Result<ManifoldSurface> make_manifold(const Mesh& mesh, CleanReport& report, const RunContext& context);

/// Cost O(F).
SurfaceTopology surface_topology(const ManifoldSurface& surface);

/// Drops components whose box has a diagonal below `smallest` (model units), and those with next to no area (needles on
/// cut edges), except the largest by area. Adds to `report`. Cost O(F).
void remove_small_components(ManifoldSurface& surface, double smallest, CleanReport& report);

/// Cuts tiny handles open and closes both cuts with triangles, where a loop of edges around the handle (or through it)
/// is no longer than `longest_loop` (model units), the shortest first, until no such loop is left. The genus goes down
/// by one each time; components, borders and all triangles stay, and filled ones come after them. Loops around open
/// borders are no handles. Method: loops from tree-cotree decompositions [Erickson 2005], cut and filled as in [Guskov
/// 2001]. Adds to `report`. Errors: cancelled (what was closed by then stays closed). Cost O(F log F) a round; a
/// handful of rounds.
Status close_handles(ManifoldSurface& surface, double longest_loop, CleanReport& report, const RunContext& context);

} // namespace filigree
