// Space warps: time a vertex on one thread, for positions alone (a whole mesh) and with gradients (a driver).
// Handles: factoring, and one round, on wavy sheets of 1,024 and 40,000 vertices held at two opposite sides.
#include "filigree/mesh.h"
#include "filigree/pose.h"

#include <array>
#include <benchmark/benchmark.h>
#include <cmath>
#include <string>

namespace filigree {
namespace {

std::unique_ptr<SpaceWarp> make_rbf_of_200(const Box& box) {
    std::vector<Vec3d> centres, displacements;
    for (int i = 0; i < 200; ++i) { // a spiral through the box
        const double t = i / 199.0;
        centres.push_back(box.centre() +
                          0.5 * box.size().cwiseProduct(Vec3d(2 * t - 1, std::sin(31 * t), std::cos(31 * t))));
        displacements.push_back(0.1 * box.diagonal() * Vec3d(std::sin(7 * t), std::cos(5 * t), std::sin(3 * t)));
    }
    return make_rbf(centres, displacements);
}

std::unique_ptr<SpaceWarp> make_chain_of_three(const Box& box) {
    std::vector<std::unique_ptr<SpaceWarp>> warps;
    warps.push_back(make_bend(box, Axis::x, 90));
    warps.push_back(make_twist(box, Axis::y, 90));
    warps.push_back(make_taper(box, Axis::z, 0.5).value());
    return make_chain(std::move(warps));
}

struct NamedWarp {
    const char* name;
    std::unique_ptr<SpaceWarp> (*make)(const Box& box);
};

constexpr std::array<NamedWarp, 8> kWarps = {{
    {"stretch", [](const Box& box) { return make_stretch(box, Axis::x, 2).value(); }},
    {"squeeze", [](const Box& box) { return make_squeeze(box, Axis::x, 0.5).value(); }},
    {"bend", [](const Box& box) { return make_bend(box, Axis::x, 90); }},
    {"twist", [](const Box& box) { return make_twist(box, Axis::x, 180); }},
    {"taper", [](const Box& box) { return make_taper(box, Axis::x, 0.5).value(); }},
    {"smooth_random", [](const Box& box) { return make_smooth_random(box, 0.1, 1); }},
    {"rbf_200", make_rbf_of_200},
    {"chain_of_3", make_chain_of_three},
}};

void warp_vertices(benchmark::State& state, const NamedWarp& named, bool with_gradients) {
    const Mesh mesh = make_wavy_sphere({.resolution = 64}); // 24,578 vertices
    const auto warp = named.make(bounds(mesh.positions));
    const RunContext context(1);
    for ([[maybe_unused]] auto _ : state) {
        if (with_gradients)
            benchmark::DoNotOptimize(warp_pose(*warp, mesh.positions, mesh.origin, context));
        else
            benchmark::DoNotOptimize(warp_positions(*warp, mesh.positions, mesh.origin, context));
    }
    state.counters["per_vertex"] =
        benchmark::Counter(static_cast<double>(mesh.vertex_count()),
                           benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

/// A square sheet held at two opposite sides, one of which is lifted and turned.
struct HeldSheet {
    std::vector<Vec3f> positions, targets;
    std::vector<Triangle> triangles;
    std::vector<Index> handles;

    explicit HeldSheet(unsigned side) {
        const Mesh mesh = make_wavy_plane({.resolution = side - 1});
        positions = mesh.positions;
        triangles = triangulate(mesh).triangles;
        const Box box = bounds(positions);
        for (std::size_t i = 0; i < positions.size(); ++i) {
            const Vec3f& p = positions[i];
            const bool low =
                p.x()<box.min.x() + 1e-6 * box.diagonal(), high = p.x()> box.max.x() - 1e-6 * box.diagonal();
            if (!low && !high) continue;
            handles.push_back(static_cast<Index>(i));
            targets.push_back(low ? p : Vec3f(0.6f * p.x(), p.z(), 0.5f + p.y()));
        }
    }
};

void factor_handles(benchmark::State& state) {
    const HeldSheet sheet(static_cast<unsigned>(state.range(0)));
    const RunContext context;
    for ([[maybe_unused]] auto _ : state)
        benchmark::DoNotOptimize(HandleSolver::create(sheet.positions, sheet.triangles, sheet.handles, context));
    state.counters["vertices"] = static_cast<double>(sheet.positions.size());
}

void iterate_handles(benchmark::State& state) {
    constexpr unsigned kRounds = 50;
    const HeldSheet sheet(static_cast<unsigned>(state.range(0)));
    const RunContext context(static_cast<unsigned>(state.range(1)));
    HandleSolver solver = HandleSolver::create(sheet.positions, sheet.triangles, sheet.handles, context).value();
    for ([[maybe_unused]] auto _ : state) {
        solver.reset();
        benchmark::DoNotOptimize(solver.solve(sheet.targets, {.iterations = kRounds, .tolerance = 0}, context));
    }
    state.counters["vertices"] = static_cast<double>(sheet.positions.size());
    state.counters["per_round"] =
        benchmark::Counter(kRounds, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

const bool kRegistered = [] {
    for (const NamedWarp& warp : kWarps) {
        const std::string name = std::string("warp/") + warp.name;
        benchmark::RegisterBenchmark((name + "/positions").c_str(), warp_vertices, warp, false);
        benchmark::RegisterBenchmark((name + "/with_gradients").c_str(), warp_vertices, warp, true);
    }
    benchmark::RegisterBenchmark("handles/factor", factor_handles)->Arg(32)->Arg(200)->Unit(benchmark::kMillisecond);
    benchmark::RegisterBenchmark("handles/iterate", iterate_handles)
        ->ArgsProduct({{32, 200}, {1, 2}})
        ->ArgNames({"side", "threads"})
        ->UseRealTime()
        ->Unit(benchmark::kMillisecond);
    return true;
}();

} // namespace
} // namespace filigree
