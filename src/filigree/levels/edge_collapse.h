// Edge collapses that can always go on: for the last, coarsest levels, where the driver's quality is decided.
#pragma once

#include "filigree/context.h"
#include "filigree/mesh.h"

#include <optional>
#include <span>
#include <vector>

namespace filigree {

/// When to stop, in model units, and what collapses are priced by.
struct EdgeCollapseOptions {
    std::size_t target_vertices = 3;      ///< this many, or fewer where a scrap goes
    std::optional<double> max_error = {}; ///< stop before a collapse that is worse, see EdgeCollapseResult::error
    /// No collapse makes an edge longer than this, or than it was. Where all are refused more vertices are left.
    std::optional<double> max_edge = {};
    /// Of (edge length)^2 x area in the price: spreads vertices evenly. For models that anything may move 0.001 and 0.1
    /// restore 1.3 to 2 times worse than the default.
    double length_weight = 0.02;
    /// Other shapes of the mesh, each with one position a vertex: distances and lengths are means over all shapes.
    std::span<const std::vector<Vec3f>> other_shapes = {};
    /// Where there are several parts (that edges connect) with at least 5 % of the diagonal, each keeps this many
    /// vertices, or fewer so that all keep at most a sixteenth together.
    std::size_t least_of_part = 0;
};

struct EdgeCollapseResult {
    std::vector<Triangle> triangles;
    std::size_t vertex_count = 0; ///< distinct vertices in `triangles`
    /// The worst collapse, model units: root mean square distance of what it merged from the old surface's planes.
    double error = 0;
    std::size_t forced = 0; ///< collapses that changed topology or turned a triangle over
};

/// A mesh on its way from all of its triangles to few of them: every moment of it can be asked for.
class CollapseOrder {
public:
    /// The mesh as it is once it has `target_vertices`, or fewer where a scrap goes; the last moment where it never has
    /// so few. Cost O(F).
    EdgeCollapseResult at(std::size_t target_vertices) const;

private:
    friend class CollapseRecorder;
    Index resolve(Index vertex, Index step) const;

    std::vector<Triangle> triangles_; ///< at the beginning
    std::vector<Index> gone_at_;      ///< of each triangle: the step that removed it, kNoIndex: none
    std::vector<Index> merged_into_;  ///< of each vertex, kNoIndex: it is left
    std::vector<Index> merged_at_;
    std::vector<std::size_t> counts_; ///< of vertices after each step
    std::vector<double> errors_;      ///< the worst collapse up to each step
    std::vector<std::size_t> forced_; ///< collapses that were forced up to each step
};

/// Half-edge collapses in the order of their quadric error [Garland 1997], their length, and the height of what they
/// cut off. No vertex moves, so what is left is a
/// subset. A collapse that would turn a triangle over or change the topology is not forbidden but priced as the loss of
/// all it touches: scraps and needle-thin parts go early, a good surface never tears for them. Non-manifold input is
/// fine, and the last triangle stays. triangles: over welded vertices. Cost O(F log F), about 300,000 collapses a
/// second, fewer with other shapes; deterministic.
EdgeCollapseResult collapse_edges(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                                  const EdgeCollapseOptions& options, const RunContext& context);
/// The same collapses, all remembered. Cancelled: those made so far.
CollapseOrder order_collapses(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                              const EdgeCollapseOptions& options, const RunContext& context);

} // namespace filigree
