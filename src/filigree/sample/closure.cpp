#include "filigree/sample/closure.h"

#include "filigree/core/disjoint_sets.h"
#include "filigree/mesh/edges.h"
#include "filigree/mesh/surface.h"
#include "filigree/sample/nesting.h"

namespace filigree {

namespace {

/// What tells whether any face may have to be turned.
struct Survey {
    Closure closure = {};
    bool is_crowded = false;          ///< an edge has more than two triangles
    std::size_t parts = 0;            ///< that share no edge
    DisjointSets joined;              ///< triangles of a part
    Vec3d border_sum = Vec3d::Zero(); ///< of the open edges' ends
};

Survey survey(std::span<const Triangle> triangles, std::span<const Vec3f> positions) {
    Survey found{.parts = triangles.size(), .joined = DisjointSets(triangles.size())};
    Closure& closure = found.closure;
    for (const std::span<const Index> edge : edges_of(triangles, positions.size())) {
        const bool is_balanced = edge_balance(triangles, edge) == 0;
        closure.unbalanced += !is_balanced;
        closure.turned += edge.size() == 2 && !is_balanced;
        found.is_crowded |= edge.size() > 2;
        for (const Index h : edge.subspan(1)) found.parts -= found.joined.join(edge[0] / 3, h / 3);
        if (edge.size() % 2 == 0) continue;
        const auto [low, high] = edge_ends(triangles, edge);
        found.border_sum += positions[low].cast<double>() + positions[high].cast<double>();
        if (closure.open_edges++ == 0) closure.first_open = {positions[low], positions[high]};
    }
    return found;
}

double six_volumes(const Triangle& t, std::span<const Vec3f> positions, const Vec3d& apex) {
    const auto corner = [&](std::size_t k) -> Vec3d { return positions[t[k]].cast<double>() - apex; };
    return corner(0).dot(corner(1).cross(corner(2)));
}

/// One part of which all looks outwards.
bool one_looks_outwards(const Survey& found, std::span<const Triangle> triangles, std::span<const Vec3f> positions) {
    // Seen from the middle of its border a part is as large as with cones over it.
    const std::size_t open = found.closure.open_edges;
    const Vec3d apex =
        open > 0 ? Vec3d(found.border_sum / (2 * double(open))) : Vec3d(positions[triangles[0][0]].cast<double>());
    double volume = 0;
    for (const Triangle& t : triangles) volume += six_volumes(t, positions, apex);
    return volume > 0;
}

/// Of closed parts whose neighbours agree: those look inwards that lie in an odd number of others, or are turned.
std::vector<FaceTurn> turns_of_parts(Survey& found, std::span<const Triangle> triangles,
                                     std::span<const Vec3f> positions, OutwardReport& report) {
    std::vector<Index> part(triangles.size(), kNoIndex);
    std::vector<double> volume;
    for (Index t = 0; t < triangles.size(); ++t) {
        const Index root = found.joined.root(t); // the lowest of its part
        if (root == t) {
            part[t] = Index(volume.size());
            volume.push_back(0);
        }
        part[t] = part[root];
        volume[part[t]] += six_volumes(triangles[t], positions, positions[triangles[root][0]].cast<double>());
    }
    std::vector<std::uint8_t> looks_inwards(volume.size());
    for (std::size_t p = 0; p < volume.size(); ++p) looks_inwards[p] = volume[p] < 0;
    const std::vector<Index> depths = nesting_depths(positions, triangles, part, volume.size(), looks_inwards);
    for (std::size_t p = 0; p < volume.size(); ++p) {
        const bool is_cavity = depths[p] % 2 == 1;
        report.cavities += is_cavity && !looks_inwards[p];
        report.inward_parts += !is_cavity && looks_inwards[p];
    }
    if (report.cavities + report.inward_parts == 0) return {};
    std::vector<FaceTurn> turns(triangles.size(), FaceTurn::kept);
    for (std::size_t t = 0; t < triangles.size(); ++t)
        if (looks_inwards[part[t]] != depths[part[t]] % 2) turns[t] = FaceTurn::turned;
    return turns;
}

} // namespace

std::vector<FaceTurn> turns_of(const Surface& surface, std::span<const Vec3f> positions, OutwardReport& report,
                               Closure* closure) {
    Survey found = survey(surface.triangles, positions);
    if (closure) *closure = found.closure;
    report = {.parts = found.parts};
    if (surface.triangles.empty()) return {};
    if (!found.is_crowded && found.closure.turned == 0) { // what nearly all meshes are
        if (found.parts == 1 && one_looks_outwards(found, surface.triangles, positions)) return {};
        if (found.closure.is_closed()) return turns_of_parts(found, surface.triangles, positions, report);
    }
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
    if (!turns.empty()) welded.triangles.resize(kept);
    if (welded.outward.turned_faces + welded.outward.inner_faces > 0) // parts turned as a whole close as they did
        welded.closure = survey(welded.triangles, mesh.positions).closure;
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
    for (const Triangle& t : welded->triangles) six += six_volumes(t, mesh.positions, middle);
    inside.volume = six / 6;
    return inside;
}

} // namespace filigree
