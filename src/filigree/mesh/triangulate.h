// Polygons to triangles.
#pragma once

#include "filigree/mesh/mesh.h"

namespace filigree {

struct Triangulation {
    std::vector<Triangle> triangles;
    std::vector<Index> source_face; ///< the face of each triangle, ascending
};

/// A face of n corners becomes n - 2 triangles over its own vertices, with its orientation. Quads are cut along the
/// diagonal that keeps both halves facing the quad's normal (the shorter where both do); larger faces by ear clipping
/// in the plane of their normal, and by a fan where no ear is left (self-touching outlines).
/// Cost O(corners); O(n^2) at worst for one face of n corners, and a fan above 4096 reflex corners to stay bounded.
Triangulation triangulate(const Mesh& mesh);

} // namespace filigree
