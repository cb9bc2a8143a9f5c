// The first levels of large meshes: many clusters simplified at the same time, whose borders move every round.
#pragma once

#include "filigree/context.h"
#include "filigree/hierarchy/bind.h"
#include "filigree/hierarchy/simplify.h"

#include <array>
#include <memory>
#include <optional>

namespace filigree {

/// A cluster's triangles over vertices of its own, and which of those stay in this round.
struct ClusterMesh {
    std::vector<Index> vertices; ///< the mesh's
    std::vector<Vec3f> positions;
    std::vector<Triangle> triangles;  ///< over them
    std::vector<std::uint8_t> locked; ///< 1: stays, as other clusters have it too, or its part is small
    std::size_t free_count() const;
};

/// What a round leaves of a cluster. Vertices are the mesh's.
struct ReducedCluster {
    std::vector<Triangle> triangles;
    double error = 0;
    std::vector<std::array<Index, 2>> followed; ///< each vertex that was removed, and the nearest of those left
    std::vector<Index> dropped;                 ///< in no triangle that is left, without such a one
};

/// Takes a cluster down to `share` of its free vertices. It depends on nothing else, so any process may do it.
ReducedCluster reduce_cluster(const ClusterMesh& cluster, double share, double max_error);

/// A mesh cut into clusters of triangles that are near each other; each round cuts elsewhere.
class ClusterRound {
public:
    /// positions: of all vertices, of which the triangles use some; both have to stay. round: 0 and on.
    ClusterRound(std::span<const Vec3f> positions, std::span<const Triangle> triangles, unsigned round,
                 const RunContext& context);
    ~ClusterRound();
    ClusterRound(const ClusterRound&) = delete;
    ClusterRound& operator=(const ClusterRound&) = delete;

    std::size_t size() const;
    ClusterMesh cluster(std::size_t number) const;
    /// What to leave of the free vertices of all clusters, so that there are `target` vertices. None: clusters do not
    /// get there.
    std::optional<double> share_left(std::size_t free_vertices, std::size_t target) const;
    /// At each of the vertices; see count_triangles.
    std::span<const std::uint8_t> triangle_counts() const;

private:
    struct Content;
    std::unique_ptr<Content> content_;
};

/// How many triangles are at each of so many vertices, at most 255.
std::vector<std::uint8_t> count_triangles(std::span<const Triangle> triangles, std::size_t vertices);
/// How many vertices are in triangles.
std::size_t used_vertices(std::span<const std::uint8_t> triangle_counts);

/// Vertices that stayed in their clusters and are in none of what is left: they follow a neighbour. before: the round's
/// triangles. nearest_left: of all vertices, as the round's clusters have set it.
void follow_neighbours(std::span<const Vec3f> positions, std::span<const Triangle> before,
                       std::span<const std::uint8_t> counts_left, std::vector<Index>& nearest_left);

/// Takes a mesh down level by level. Where a cluster touches others its vertices stay, for this round; the lattice that
/// the clusters are cut by is another one each time. Parts of fewer than kSmallPart vertices stay as they are, as
/// clusters would take them away.
class ClusterSimplifier {
public:
    static constexpr std::size_t kSmallPart = 1'000;

    /// positions: of all vertices, of which later triangles use fewer and fewer.
    explicit ClusterSimplifier(std::span<const Vec3f> positions) : positions_(positions) {}

    /// One level of about `target` vertices, of triangles over welded vertices. max_error: model units, as of
    /// Simplified::error. None: clusters do not get there (small parts, fans of thousands of triangles, all in one
    /// place), and one piece has to. Cost O(F). Same bytes for any number of threads. Cancelled: none.
    std::optional<Simplified> simplify(std::span<const Triangle> triangles, std::size_t target, double max_error,
                                       const RunContext& context);

    /// What was removed; empty before the first round.
    RemovedVertices take_removed() { return std::move(removed_); }

private:
    std::span<const Vec3f> positions_;
    RemovedVertices removed_;
    std::uint8_t round_ = 0;
};

} // namespace filigree
