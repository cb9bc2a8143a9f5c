// A mesh as algorithms see it: one vertex a place, triangles alone, and none that repeats a vertex.
#pragma once

#include "filigree/context.h"
#include "filigree/mesh.h"

namespace filigree {

/// The welded triangles of a mesh. Vertex ids are the mesh's own, so its positions and attributes serve unchanged; of
/// the vertices at one place only the lowest, their representative, is in triangles. For the triangles at each vertex
/// see triangles_at_vertices (mesh/edges.h).
struct Surface {
    std::vector<Index> representative; ///< of each vertex: the lowest vertex at its place; see weld_map
    std::size_t place_count = 0;       ///< distinct positions, whether a face uses them or not
    std::vector<Triangle> triangles;   ///< of three different representatives each; may have no area all the same
    std::vector<Index> source_face;    ///< the face of each triangle, ascending

    std::size_t vertex_count() const { return representative.size(); }
};

/// Welds and triangulates; faces keep their order. Cost: O(size) for checking and welding, and that of triangulate.
/// Errors: usage (check_mesh refuses the mesh), unsuitable (more triangles than kMostListedTriangles, see
/// mesh/edges.h), cancelled.
Result<Surface> make_surface(const Mesh& mesh, const RunContext& context);
/// The same with vertices welded as `representative` says: of each vertex the lowest that is one with it.
Result<Surface> make_surface(const Mesh& mesh, std::vector<Index> representative, const RunContext& context);

} // namespace filigree
