// What a mesh is made of and what is wrong with it: open edges, non-manifold places, degenerate and duplicate faces.
#pragma once

#include "filigree/core/run_context.h"
#include "filigree/mesh/mesh.h"

#include <cstddef>

namespace filigree {

/// How often something was found, and the first places, lowest index first.
struct Finding {
    static constexpr std::size_t kPlaces = 5; ///< at most this many places are kept
    std::size_t count = 0;
    std::vector<std::vector<Index>> places; ///< each: the edge's two vertices, or the one vertex, or the face
};

/// Counts over a mesh, and its defects. Edges are pairs of vertex ids; nothing is welded. A corner that repeats the
/// one before it is passed over, and a face left with fewer than three corners counts in `faces` and
/// `degenerate_faces`, but has no edges and no part in the rest.
struct TopologyReport {
    std::size_t vertices = 0, faces = 0, triangles = 0, quads = 0, polygons = 0; ///< polygons: five corners or more
    std::size_t edges = 0, corners = 0;
    std::size_t components = 0;   ///< of faces connected through edges
    std::int64_t euler = 0;       ///< used vertices - edges + faces
    Finding open_edges;           ///< with one face
    Finding nonmanifold_edges;    ///< with three faces or more
    Finding inconsistent_edges;   ///< two faces that run along the edge in the same direction
    Finding nonmanifold_vertices; ///< whose faces form more than one fan (connected through edges at the vertex)
    Finding degenerate_faces;     ///< repeated vertices, or area below 1e-14 of the diagonal squared
    Finding duplicate_faces;      ///< with the same set of vertices as an earlier face, in any order
    Finding unused_vertices;      ///< in no face
    Finding duplicate_vertices;   ///< at exactly the position of an earlier vertex
    Box box;                      ///< in world coordinates
    double area = 0;              ///< model units squared
    double volume = 0;            ///< signed; when not closed and oriented, that of the cones from the world's origin

    bool is_closed() const { return faces > 0 && open_edges.count == 0; }
    bool is_manifold() const { return nonmanifold_edges.count == 0 && nonmanifold_vertices.count == 0; }
    bool is_oriented() const { return inconsistent_edges.count == 0; }
};

/// Cost O(corners), and O(n log n) at a vertex of n faces. The mesh is not checked; on one that passes check_mesh
/// nothing can fail. Deterministic for any thread count.
TopologyReport analyse_topology(const Mesh& mesh, const RunContext& context);

} // namespace filigree
