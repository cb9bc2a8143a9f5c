#include "filigree/sample/closure.h"

#include "filigree/mesh/triangulate.h"
#include "filigree/mesh/weld.h"
#include "filigree/sample/edge_balance.h"

namespace filigree {

namespace {

Closure closure_of(std::span<const Triangle> triangles, std::span<const Vec3f> positions) {
    Closure closure;
    for_each_edge(positions.size(), triangles, [&](const EdgeBalance& edge) {
        closure.unbalanced += edge.net != 0;
        if (edge.triangles % 2 == 0) return;
        if (closure.open_edges++ == 0) closure.first_open = {positions[edge.low], positions[edge.high]};
    });
    return closure;
}

} // namespace

Result<WeldedTriangles> weld_triangles(const Mesh& mesh, const RunContext& context) {
    WeldedTriangles welded;
    const std::vector<Index> representative = weld_map(mesh.positions);
    for (Triangle t : triangulate(mesh).triangles) {
        for (Index& v : t) v = representative[v];
        if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) welded.triangles.push_back(t);
    }
    if (context.is_cancelled()) return cancelled_error();
    welded.closure = closure_of(welded.triangles, mesh.positions);
    if (context.is_cancelled()) return cancelled_error();
    return welded;
}

} // namespace filigree
