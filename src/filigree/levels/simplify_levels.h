// The levels of a blend model: a mesh welded, and simplified level by level.
#pragma once

#include "filigree/levels/cluster_simplify.h"
#include "filigree/levels/loose_parts.h"
#include "filigree/mesh/surface.h"
#include "filigree/strip.h"

namespace filigree {

/// The mesh as the blend code sees it: welded, around the origin and about one unit large, so that no product leaves
/// float's range.
struct WorkingMesh {
    std::vector<Vec3f> positions;
    Surface surface;
    std::vector<Vec3f> normals;
};

/// Errors: as of make_surface.
Result<WorkingMesh> make_working_mesh(const Mesh& mesh, const RunContext& context);
/// The same with vertices welded as `representative` says (mesh/surface.h).
Result<WorkingMesh> make_working_mesh(const Mesh& mesh, std::vector<Index> representative, const RunContext& context);

/// Triangles over the vertices of a mesh as a level of it.
Level make_level(std::span<const Triangle> triangles, std::size_t vertex_count);

/// The levels, coarse to fine, each simplified from the next finer one. Of a large mesh the first ones are made in
/// clusters, and what those left is one piece.
struct SimplifiedLevels {
    std::vector<Level> levels;
    double error = 0;       ///< of the driver, fraction of the diagonal: the sum of the levels' worst collapses
    std::size_t forced = 0; ///< see Simplified

    /// What the clusters left; none: they were not needed.
    std::vector<Index> piece_vertices;     ///< the mesh's, ascending
    std::vector<Triangle> piece_triangles; ///< over them
    RemovedVertices removed;               ///< by the clusters
};

/// Cancelled: the levels made so far.
SimplifiedLevels simplify_levels(const WorkingMesh& work, const StripOptions& options, const RunContext& context);

/// The driver's vertex nearest to each of the mesh's along the surface; loose parts hang on the surface beside them.
/// What clusters took away follows what they left. Cost as of hang_loose_parts.
NearestDriver nearest_driver_vertices(const WorkingMesh& work, const SimplifiedLevels& simplified,
                                      const RunContext& context);

/// A driver's cells: three of its vertices each, or one where it has no faces.
std::vector<Triangle> driver_cells(const Level& driver);

} // namespace filigree
