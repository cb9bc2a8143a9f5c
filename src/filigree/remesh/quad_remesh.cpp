// Based on: [Lee 1998] (the parametrisation), and docs/remesh.md, which says where we differ and what was measured.
#include "filigree/remesh/quad_remesh.h"

#include "filigree/mesh/mesh_distance.h"
#include "filigree/mesh/triangulate.h"
#include "filigree/remesh/base_triangles.h"
#include "filigree/remesh/feature_curves.h"
#include "filigree/remesh/relax.h"
#include "filigree/remesh/voxel_wrap.h"

#include <chrono>
#include <cmath>
#include <cstdio>

namespace filigree {

namespace {

constexpr unsigned kMostLevels = 8;
constexpr double kEnoughPatches = 500;  // unset levels leave at least about so many
constexpr unsigned kSampledLevels = 3;  // taken from the map; finer ones are halved from there
constexpr unsigned kCoarseSweeps = 40, kFineSweeps = 6;
constexpr double kWantedJacobian = 0.2; // below it, places are searched

class Stopwatch {
public:
    explicit Stopwatch(std::vector<PhaseSeconds>& seconds) : seconds_(seconds) {}
    void phase_ends(const char* phase) {
        const auto now = std::chrono::steady_clock::now();
        const double passed = std::chrono::duration<double>(now - last_).count();
        last_ = now;
        for (PhaseSeconds& entry : seconds_)
            if (std::string_view(entry.phase) == phase) {
                entry.seconds += passed;
                return;
            }
        seconds_.push_back({phase, passed});
    }

private:
    std::vector<PhaseSeconds>& seconds_;
    std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

} // namespace

Result<QuadRemeshed> quad_remesh(const Mesh& mesh, const QuadRemeshOptions& options, const RunContext& context) {
    QuadRemeshed result;
    QuadRemeshReport& report = result.report;
    Stopwatch watch(report.seconds);
    Result<ManifoldSurface> manifold = make_manifold(mesh, report.clean, context);
    if (!manifold) return manifold.error();
    const ManifoldSurface surface = std::move(*manifold);
    watch.phase_ends("clean");
    report.input = surface_topology(surface);
    unsigned levels = options.levels.value_or(0);
    if (!options.levels)
        while (double(options.quads) / std::pow(4.0, levels + 1) >= kEnoughPatches && levels < kMostLevels) ++levels;
    const std::size_t patches = std::max<std::size_t>(1, std::size_t(std::llround(double(options.quads) / std::pow(4.0, levels))));
    double area = 0;
    for (const Triangle& t : surface.triangles)
        area += 0.5 * (surface.positions[t[1]] - surface.positions[t[0]]).cross(surface.positions[t[2]] - surface.positions[t[0]]).norm();
    const double side = std::sqrt(area / double(patches));
    const std::vector<Index> twins = half_edge_twins(surface.triangles);
    FeatureCurves curves = find_feature_curves(surface, twins, {options.feature_angle_deg, side});
    report.feature_edges = curves.edge_count;
    SurfaceMap map(surface, curves.half_edges, curves.corners);
    std::vector<std::uint8_t> features = curves.half_edges;
    for (Index h = 0; h < twins.size(); ++h)
        if (twins[h] == kNoIndex) features[h] = 1;
    std::vector<VertexKind> kinds(surface.positions.size());
    for (Index v = 0; v < kinds.size(); ++v) kinds[v] = map.kind(v);
    const SurfaceWalk walk(surface, twins, features, kinds);
    watch.phase_ends("features");
    if (Status made = make_base_triangles(map, {2 * patches}, context); !made) return made.error();
    std::fprintf(stderr, "base %zu triangles, %zu records\n", map.triangle_count(), map.record_count());
    watch.phase_ends("base");
    Result<BaseQuads> base = make_base_quads(map, context);
    if (!base) return base.error();
    if (base->halved && levels > 0) --levels;
    std::fprintf(stderr, "quads %zu halved %d\n", base->quads.size(), base->halved);
    watch.phase_ends("pairing");
    PatchGrid grid = sample_patches(map, *base, walk, std::min(levels, kSampledLevels), context);
    watch.phase_ends("sampling");
    relax(grid, walk, kCoarseSweeps, context);
    while (grid.patches.levels < levels) {
        grid = halve_grid(grid, walk, context);
        relax(grid, walk, kFineSweeps, context);
    }
    watch.phase_ends("relaxing");
    const Untangled untangled = untangle(grid, walk, kWantedJacobian, context);
    std::fprintf(stderr, "inverted %zu off %zu\n", untangled.inverted, untangled.off_surface);
    watch.phase_ends("untangling");
    result.mesh = grid_mesh(grid, mesh.origin);
    report.patches = grid.patches.patch_count();
    report.levels = levels;
    report.quality = measure_quads(result.mesh, context);
    watch.phase_ends("shape");
    Result<MeshDistance> distance = mesh_distance(result.mesh, mesh, 100000, context);
    if (!distance) return distance.error();
    report.diagonal = distance->diagonal;
    report.to_input = {0, distance->relative(distance->surfaces->max_a_to_b)};
    report.from_input = {0, distance->relative(distance->surfaces->max_b_to_a)};
    watch.phase_ends("distances");
    result.patches = std::move(grid.patches);
    return result;
}

} // namespace filigree
