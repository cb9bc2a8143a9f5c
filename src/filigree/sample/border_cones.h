// What closes a mesh: cones over its open edges.
#pragma once

#include "filigree/mesh.h"

namespace filigree {

/// Triangles are missing along an edge, `missing` of them; they would run from `to` back to `from`.
struct MissingSide {
    Index from, to;
    int missing;
};

struct BorderCones {
    std::vector<Vec3f> positions;    ///< the mesh's, and the tips
    std::vector<Triangle> triangles; ///< over these; those of a side follow each other, in the order of the sides
    std::size_t open_edges = 0;      ///< sides
};

/// For each connected part of the sides a cone whose tip is the mean of their ends. Cost O(V + sides).
BorderCones make_border_cones(std::span<const Vec3f> positions, std::span<const MissingSide> sides);

} // namespace filigree
