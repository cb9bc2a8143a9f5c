// How good a quad mesh is: shape and regularity, measured, never assumed.
#pragma once

#include "filigree/core/run_context.h"
#include "filigree/mesh/mesh.h"

namespace filigree {

/// Smallest over the four corners of (e x f) . n / (|e| |f|), with e, f the edges that leave the corner and n the
/// quad's unit normal (of its diagonals' cross product): 1 for a rectangle, 0 or less when a corner is straight or
/// turned inside out. -1 where an edge has no length or the quad no normal.
double scaled_jacobian(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d);

struct QuadQuality {
    std::size_t quads = 0;
    /// Vertices inside with other than four quads; vertices on open borders do not count.
    std::size_t irregular_vertices = 0;
    double min_scaled_jacobian = 1, low_scaled_jacobian = 1, mean_scaled_jacobian = 1; ///< low: 1st percentile
    std::size_t inverted = 0;    ///< quads whose scaled Jacobian is not above zero
    Index worst_quad = kNoIndex; ///< the one with the smallest
};

/// Faces that are no quads are passed over. The mesh is not checked. Cost O(F).
QuadQuality measure_quads(const Mesh& mesh, const RunContext& context);

} // namespace filigree
