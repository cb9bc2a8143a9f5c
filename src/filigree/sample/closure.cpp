#include "filigree/sample/closure.h"

#include "filigree/core/disjoint_sets.h"
#include "filigree/mesh/surface.h"
#include "filigree/sample/edge_balance.h"

namespace filigree {

namespace {

/// What tells whether any face may have to be turned.
struct Survey {
    Closure closure;
    bool is_crowded = false;          ///< an edge has more than two triangles
    std::size_t parts = 0;            ///< that share no edge
    Vec3d border_sum = Vec3d::Zero(); ///< of the open edges' ends
};

Survey survey(std::span<const Triangle> triangles, std::span<const Vec3f> positions) {
    Survey found;
    Closure& closure = found.closure;
    DisjointSets joined(triangles.size());
    found.parts = triangles.size();
    for_each_edge(positions.size(), triangles, [&](const EdgeBalance& edge) {
        closure.unbalanced += edge.net != 0;
        closure.turned += edge.triangles == 2 && edge.net != 0;
        found.is_crowded |= edge.triangles > 2;
        for (const TriangleSide& side : edge.sides.subspan(1))
            found.parts -= joined.join(edge.sides[0].triangle(), side.triangle());
        if (edge.triangles % 2 == 0) return;
        found.border_sum += positions[edge.low].cast<double>() + positions[edge.high].cast<double>();
        if (closure.open_edges++ == 0) closure.first_open = {positions[edge.low], positions[edge.high]};
    });
    return found;
}

/// One part of which all looks outwards: nothing is to be turned.
bool looks_outwards(const Survey& found, std::span<const Triangle> triangles, std::span<const Vec3f> positions) {
    const Closure& closure = found.closure;
    if (found.parts > 1 || found.is_crowded || closure.turned > 0 || triangles.empty()) return false;
    // Seen from the middle of its border a part is as large as with cones over it.
    const Vec3d apex = closure.open_edges > 0 ? Vec3d(found.border_sum / (2 * double(closure.open_edges)))
                                              : Vec3d(positions[triangles[0][0]].cast<double>());
    double volume = 0;
    for (const Triangle& t : triangles) {
        const auto corner = [&](std::size_t k) -> Vec3d { return positions[t[k]].cast<double>() - apex; };
        volume += corner(0).dot(corner(1).cross(corner(2)));
    }
    return volume > 0;
}

} // namespace

std::vector<FaceTurn> turns_of(const Surface& surface, std::span<const Vec3f> positions, OutwardReport& report,
                               Closure* closure) {
    const Survey found = survey(surface.triangles, positions);
    if (closure) *closure = found.closure;
    report = {.parts = found.parts};
    if (looks_outwards(found, surface.triangles, positions)) return {};
    return outward_turns(surface.triangles, surface.source_face, positions, report);
}

Result<WeldedTriangles> weld_triangles(const Mesh& mesh, const RunContext& context) {
    Result<Surface> surface = make_surface(mesh, context);
    if (!surface) return surface.error();
    WeldedTriangles welded;
    const std::vector<FaceTurn> turns = turns_of(*surface, mesh.positions, welded.outward, &welded.closure);
    welded.triangles = std::move(surface->triangles);
    std::size_t kept = 0;
    for (std::size_t t = 0; t < turns.size(); ++t) {
        if (turns[t] == FaceTurn::left_out) continue;
        welded.triangles[kept] = welded.triangles[t];
        if (turns[t] == FaceTurn::turned) std::swap(welded.triangles[kept][1], welded.triangles[kept][2]);
        ++kept;
    }
    if (!turns.empty()) {
        welded.triangles.resize(kept);
        welded.closure = survey(welded.triangles, mesh.positions).closure;
    }
    if (context.is_cancelled()) return cancelled_error();
    return welded;
}

Result<InsideVolume> inside_volume(const Mesh& mesh, const RunContext& context) {
    const Result<WeldedTriangles> welded = weld_triangles(mesh, context);
    if (!welded) return welded.error();
    InsideVolume inside{std::nullopt, welded->outward};
    if (welded->triangles.empty() || !welded->closure.is_closed() || !welded->closure.is_oriented()) return inside;
    const Vec3d middle = bounds(mesh.positions).centre();
    double six = 0;
    for (const Triangle& t : welded->triangles) {
        const auto corner = [&](std::size_t k) -> Vec3d { return mesh.positions[t[k]].cast<double>() - middle; };
        six += corner(0).dot(corner(1).cross(corner(2)));
    }
    inside.volume = six / 6;
    return inside;
}

} // namespace filigree
