// A closed manifold around any triangles: the last resort where a mesh is too broken to be remeshed as it is.
#pragma once

#include "filigree/remesh/manifold_surface.h"

namespace filigree {

struct WrapOptions {
    unsigned resolution = 192; ///< voxels along the longest side of the box, 16 to 512
    /// Openings up to about this many voxels across are closed before the outside is found; 0 closes none.
    unsigned closing = 1;
};

/// The surface that can be reached from outside: voxels that triangles touch, the outside flooded around them, the
/// border between the two as a closed oriented manifold, smoothed and pulled onto the closest input triangle. Inner
/// cavities are lost, sheets become thin shells, openings wider than the closing are entered. source_corners is empty.
/// Errors: unsuitable (no extent), cancelled. Cost O(resolution^3 / 8 bytes of memory + F + touched voxels).
Result<ManifoldSurface> voxel_wrap(std::span<const Vec3d> positions, std::span<const Triangle> triangles,
                                   const WrapOptions& options, const RunContext& context);

} // namespace filigree
