#include "filigree/sample/closure.h"

#include "filigree/mesh/orientation.h"
#include "filigree/mesh/surface.h"
#include "filigree/sample/edge_balance.h"

namespace filigree {

namespace {

Closure closure_of(std::span<const Triangle> triangles, std::span<const Vec3f> positions) {
    Closure closure;
    for_each_edge(positions.size(), triangles, [&](const EdgeBalance& edge) {
        closure.unbalanced += edge.net != 0;
        closure.turned += edge.triangles == 2 && edge.net != 0;
        if (edge.triangles % 2 == 0) return;
        if (closure.open_edges++ == 0) closure.first_open = {positions[edge.low], positions[edge.high]};
    });
    return closure;
}

} // namespace

Result<WeldedTriangles> weld_triangles(const Mesh& mesh, const RunContext& context) {
    Result<Surface> surface = make_surface(mesh, context);
    if (!surface) return surface.error();
    WeldedTriangles welded;
    welded.triangles = std::move(surface->triangles);
    welded.closure = closure_of(welded.triangles, mesh.positions);
    if (welded.closure.turned > 0 && orient(welded.triangles, mesh.positions) > 0)
        welded.closure = closure_of(welded.triangles, mesh.positions);
    if (context.is_cancelled()) return cancelled_error();
    return welded;
}

} // namespace filigree
