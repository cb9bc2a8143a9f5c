#include "filigree/mesh/surface.h"

#include "filigree/mesh.h"
#include "filigree/mesh/weld.h"

namespace filigree {

Result<Surface> make_surface(const Mesh& mesh, const RunContext& context) {
    return make_surface(mesh, weld_map(mesh.positions), context);
}

Result<Surface> make_surface(const Mesh& mesh, std::vector<Index> representative, const RunContext& context) {
    if (std::optional<Error> error = mesh_error(mesh)) return *error;
    Surface surface;
    surface.representative = std::move(representative);
    for (Index v = 0; v < surface.vertex_count(); ++v) surface.place_count += surface.representative[v] == v;

    Result<Triangulation> triangulation = triangulate(mesh, context);
    if (!triangulation) return triangulation.error();
    std::vector<Triangle>& triangles = triangulation->triangles;
    std::size_t kept = 0;
    for (std::size_t t = 0; t < triangles.size(); ++t) {
        Triangle welded;
        for (int k = 0; k < 3; ++k) welded[k] = surface.representative[triangles[t][k]];
        if (welded[0] == welded[1] || welded[1] == welded[2] || welded[2] == welded[0]) continue;
        triangles[kept] = welded;
        triangulation->source_face[kept++] = triangulation->source_face[t];
    }
    triangles.resize(kept);
    triangulation->source_face.resize(kept);
    surface.triangles = std::move(triangles);
    surface.source_face = std::move(triangulation->source_face);
    return surface;
}

} // namespace filigree
