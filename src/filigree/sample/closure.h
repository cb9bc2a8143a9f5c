// How a mesh closes: whether it has an inside that crossings can tell.
#pragma once

#include "filigree/core/run_context.h"
#include "filigree/mesh/mesh.h"

#include <array>

namespace filigree {

/// How a mesh closes, with vertices at one place made one.
struct Closure {
    std::size_t open_edges = 0; ///< edges with an odd number of triangles
    std::size_t unbalanced = 0; ///< edges whose triangles do not run along them as often one way as the other
    std::size_t turned = 0;     ///< of these the edges of two triangles, which run the same way
    std::array<Vec3f, 2> first_open = {Vec3f::Zero(), Vec3f::Zero()}; ///< ends of the first open edge
    bool is_closed() const { return open_edges == 0; }
    bool is_oriented() const { return unbalanced == 0; }
};

/// Triangles of a mesh over welded vertices, degenerate ones left out, and turned so that neighbours agree
/// (mesh/orientation.h). What is left unbalanced is open, has more than two faces at an edge, or has only one side.
struct WeldedTriangles {
    std::vector<Triangle> triangles; ///< over the mesh's own positions
    Closure closure;
};
/// Cost: that of make_surface, and O(d log d) for a vertex with d edges. Errors: as of make_surface.
Result<WeldedTriangles> weld_triangles(const Mesh& mesh, const RunContext& context);

} // namespace filigree
