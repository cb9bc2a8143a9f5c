// The levels of a blend model: a mesh welded, and simplified level by level.
#pragma once

#include "filigree/hierarchy/bind.h"
#include "filigree/hierarchy/cluster_simplify.h"
#include "filigree/hierarchy/model.h"
#include "filigree/hierarchy/strip.h"
#include "filigree/mesh/surface.h"

#include <functional>

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

/// Who makes the levels of a large mesh that are made in clusters: ClusterSimplifier, or what made them before.
struct ClusterLevels {
    /// As of ClusterSimplifier.
    std::function<std::optional<Simplified>(std::span<const Triangle>, std::size_t target, double max_error)> simplify;
    std::function<RemovedVertices()> take_removed;
};
SimplifiedLevels simplify_levels(const WorkingMesh& work, const StripOptions& options, const ClusterLevels& clusters,
                                 const RunContext& context);

/// What a round of clusters has left.
struct RoundLeft {
    std::size_t vertices = 0;
    double error = 0;
    bool has_fewer_triangles = false; ///< than before
};
/// What the next round of clusters is to leave, after those that were made. None: the rest is one piece.
struct NextRound {
    std::size_t target = 0;
    double max_error = 0;
};
std::optional<NextRound> next_round(std::size_t places, const StripOptions& options, std::span<const RoundLeft> made);

/// The driver's vertex nearest to each of the mesh's along the surface; loose parts hang on the surface beside them.
/// What clusters took away follows what they left. Cost as of hang_loose_parts.
NearestDriver nearest_driver_vertices(const WorkingMesh& work, const SimplifiedLevels& simplified,
                                      const RunContext& context);

/// A driver's cells: three of its vertices each, or one where it has no faces.
std::vector<Triangle> driver_cells(const Level& driver);

} // namespace filigree
