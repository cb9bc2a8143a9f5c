// How a mesh closes: whether it has an inside that crossings can tell.
#pragma once

#include "filigree/context.h"
#include "filigree/mesh/surface.h"
#include "filigree/sample/outward.h"

#include <array>
#include <optional>

namespace filigree {

/// Triangles of a mesh over welded vertices, those that repeat a vertex left out, and turned so that they look away
/// from the inside (outward.h). What is left unbalanced is open, crosses itself at an edge of more than two faces, or
/// has only one side.
struct WeldedTriangles {
    std::vector<Triangle> triangles; ///< over the mesh's own positions
    Closure closure;
    OutwardReport outward; ///< what was turned for it
};
/// The one way from a mesh to what has an inside: everything that asks for points inside takes it.
/// Cost: that of make_surface, O(d log d) for a vertex with d edges, and that of outward_turns where the mesh has
/// several parts, or is not one closed surface that looks outwards. Errors: as of make_surface.
Result<WeldedTriangles> weld_triangles(const Mesh& mesh, const RunContext& context);
/// What weld_triangles does to the triangles of a surface: empty where all of them stay as they are. closure: before.
std::vector<FaceTurn> turns_of(const Surface& surface, std::span<const Vec3f> positions, OutwardReport& report,
                               Closure* closure = nullptr);

} // namespace filigree
