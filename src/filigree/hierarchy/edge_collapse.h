// Edge collapses that can always go on: for the last, coarsest levels, where the driver's quality is decided.
#pragma once

#include "filigree/context.h"
#include "filigree/mesh.h"

#include <optional>

namespace filigree {

/// When to stop, in model units.
struct EdgeCollapseOptions {
    std::size_t target_vertices = 3;      ///< this many, or fewer where a scrap goes
    std::optional<double> max_error = {}; ///< stop before a collapse that is worse, see EdgeCollapseResult::error
    /// No collapse makes an edge longer than this, or than it was. Where all are refused more vertices are left.
    std::optional<double> max_edge = {};
};

struct EdgeCollapseResult {
    std::vector<Triangle> triangles;
    std::size_t vertex_count = 0; ///< distinct vertices in `triangles`
    /// The worst collapse, model units: root mean square distance of what it merged from the old surface's planes.
    double error = 0;
    std::size_t forced = 0; ///< collapses that changed topology or turned a triangle over
};

/// Half-edge collapses in the order of their quadric error [Garland 1997], their length, and the height of what they
/// cut off. No vertex moves, so what is left is a
/// subset. A collapse that would turn a triangle over or change the topology is not forbidden but priced as the loss of
/// all it touches: scraps and needle-thin parts go early, a good surface never tears for them. Non-manifold input is
/// fine, and the last triangle stays. triangles: over welded vertices. Cost O(F log F), about 300,000 collapses a
/// second; deterministic.
EdgeCollapseResult collapse_edges(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                                  const EdgeCollapseOptions& options, const RunContext& context);

} // namespace filigree
