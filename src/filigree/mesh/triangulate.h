// Polygons to triangles.
#pragma once

#include "filigree/core/run_context.h"
#include "filigree/mesh/mesh.h"

namespace filigree {

struct Triangulation {
    std::vector<Triangle> triangles;
    std::vector<Index> source_face; ///< the face of each triangle, ascending
};

/// The error (unsuitable) of a mesh that comes to more triangles than kMostListedTriangles (mesh/edges.h); none for
/// others.
std::optional<Error> too_many_triangles(std::size_t count);

/// A face of n corners becomes n - 2 triangles over its own vertices, with its orientation. Quads are cut along the
/// diagonal that keeps both halves facing the quad's normal (the shorter where both do); larger faces by ear clipping
/// in the plane of their normal, and by a fan where no ear is left (self-crossing outlines).
/// Cost O(corners) for triangles and quads, O(n r) for a face of n corners with r reflex ones; after 1024 n tests the
/// rest of a face becomes a fan, to stay bounded. That bound is a second for a face of 200,000 corners.
/// The mesh is not checked: it has to pass check_mesh. Errors: unsuitable (more triangles than kMostListedTriangles,
/// see mesh/edges.h), cancelled.
Result<Triangulation> triangulate(const Mesh& mesh, const RunContext& context);
/// The same where nobody can cancel it, for small meshes; an error is thrown, as Result::value() does.
Triangulation triangulate(const Mesh& mesh);

} // namespace filigree
