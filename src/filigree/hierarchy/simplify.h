// Levels for any mesh: edge collapses in the order of their error, keeping a subset of the vertices.
#pragma once

#include "filigree/context.h"
#include "filigree/mesh.h"

#include <optional>

namespace filigree {

/// When to stop; the first that is reached. With neither, nothing is removed.
struct SimplifyOptions {
    std::optional<std::size_t> target_vertices = {}; ///< at most about this many (within 2 %), whatever the mesh
    /// Stop before a collapse whose quadric error is worse: a root mean square distance, fraction of the diagonal.
    /// Single points may be a few times further away.
    std::optional<double> max_error = {};
    /// No edge becomes longer than this, fraction of the diagonal, unless it was in the input: flat parts keep vertices
    /// too. Where this holds collapses back, more than target_vertices are left. On its own it removes nothing.
    std::optional<double> max_edge = {};
};

/// What is left: triangles over the input's own vertex ids.
struct Simplified {
    std::vector<Triangle> triangles;
    std::size_t vertex_count = 0; ///< distinct vertices in `triangles`
    /// The worst collapse, as in max_error. meshoptimizer sees a roughened mesh (roughen.h), so its part of the error
    /// is a little too large.
    double error = 0;
    std::size_t forced = 0; ///< collapses that changed topology: dropped scraps, closed handles
};

/// Quadric edge collapses [Garland 1997]: meshoptimizer down to 20,000 vertices, our own (collapse_edges) from there,
/// and wherever meshoptimizer cannot go on or a vertex has thousands of triangles. triangles must be over welded
/// vertices (one id a position), else seams hold them back. With both options, error ends it before the count does.
/// With max_edge meshoptimizer goes only as far as it leaves no longer edge, and our own do the rest.
/// Cost O(F log F); same result for any thread count. When cancelled, what is reached so far.
Simplified simplify(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                    const SimplifyOptions& options, const RunContext& context);

} // namespace filigree
