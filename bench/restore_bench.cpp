// Restoring, against the streaming triad of the same run: both are bound by memory, so the fraction says how much of
// the machine the restore uses. Counters: vertices/s, bytes moved a vertex, fraction of the triad.
#include "interactive/triad.h"

#include "filigree/blend/blend_code.h"
#include "filigree/mesh.h"
#include "filigree/reference/height_law.h"
#include "filigree/reference/reference_code.h"
#include "filigree/strip.h"

#include <benchmark/benchmark.h>
#include <chrono>
#include <map>
#include <memory>

namespace {

using namespace filigree;

Triad& shared_triad() {
    static Triad triad;
    return triad;
}

void BM_triad(benchmark::State& state) {
    const RunContext context(static_cast<unsigned>(state.range(0)));
    const bool streams = state.range(1) != 0;
    for (auto _ : state) shared_triad().run(context, streams);
    state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations() * Triad::bytes(streams)));
}
BENCHMARK(BM_triad)->ArgNames({"threads", "streams"})->ArgsProduct({{1, 2}, {0, 1}})->UseRealTime();

struct Cube {
    std::size_t vertices;
    ReferenceDetail detail;
};
const Cube& cube(unsigned resolution, unsigned references) {
    static std::map<std::pair<unsigned, unsigned>, Cube> cubes;
    const auto key = std::pair(resolution, references);
    if (!cubes.contains(key)) {
        const Mesh mesh = make_wavy_cube({.resolution = resolution});
        auto detail = encode_reference(mesh, {.references = references}, RunContext());
        cubes.emplace(key, Cube{mesh.vertex_count(), std::move(detail.value())});
    }
    return cubes.at(key);
}

double seconds(auto&& body) {
    const auto start = std::chrono::steady_clock::now();
    body();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Restores the cube; every tenth time a triad runs beside it, and the fraction compares the best of each.
void BM_restore_grids(benchmark::State& state) {
    const Cube& c = cube(static_cast<unsigned>(state.range(0)), static_cast<unsigned>(state.range(3)));
    const RunContext context(static_cast<unsigned>(state.range(1)));
    const ReferenceRestorer restorer(c.detail, static_cast<HeightLaw>(state.range(2)), context);
    const std::size_t side = c.detail.patches.side() + 1;
    std::vector<Vec3f> grids(c.detail.patches.patch_count() * side * side);
    double best = 1e9, best_triad = 1e9;
    for (auto _ : state) {
        best = std::min(best, seconds([&] {
                            restorer.restore_grids(c.detail.rest_driver, c.detail.patches.levels, grids, context);
                        }));
        if (state.iterations() % 10 == 0) {
            state.PauseTiming();
            best_triad = std::min(best_triad, seconds([&] { shared_triad().run(context, true); }));
            state.ResumeTiming();
        }
    }
    // Records once; of the points a level writes, those of all but the finest are read again.
    const double points = static_cast<double>(grids.size());
    const double bytes = static_cast<double>(restorer.code_bytes()) + points * 12 * (4.0 / 3 + 1.0 / 3);
    const double rate = bytes / best, triad_rate = static_cast<double>(Triad::bytes(true)) / best_triad;
    state.counters["vertices/s"] = points / best;
    state.counters["bytes/vertex"] = bytes / points;
    state.counters["bytes/s"] = rate;
    state.counters["of_triad"] = rate / triad_rate;
    state.SetLabel(std::to_string(c.vertices) + " vertices, " +
                   std::string(height_law_name(static_cast<HeightLaw>(state.range(2)))));
}
BENCHMARK(BM_restore_grids)
    ->ArgNames({"resolution", "threads", "law", "references"})
    ->ArgsProduct({{128, 256, 512, 1024}, {1, 2}, {0, 1}, {3}})
    ->ArgsProduct({{1024}, {1}, {2, 3}, {3}})
    ->ArgsProduct({{1024}, {1}, {0, 1}, {4, 6}})
    ->MinTime(1)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

/// A model of a wavy cube with 1,000 driver vertices.
const Model& blend_model(unsigned resolution) {
    static std::map<unsigned, Model> models;
    if (!models.contains(resolution))
        models.emplace(resolution,
                       strip(make_wavy_cube({.resolution = resolution}), {.base = 1000}, RunContext()).value().model);
    return models.at(resolution);
}

/// The blend code in record order, as a vertex buffer takes it, or in the mesh's own.
void BM_restore_blend(benchmark::State& state) {
    const bool with_normals = state.range(2) == 1, in_order = state.range(2) == 2;
    const Model& model = blend_model(static_cast<unsigned>(state.range(0)));
    const RunContext context(static_cast<unsigned>(state.range(1)));
    std::vector<BlendRestorer::Item> items(model.mesh.vertex_count());
    for (Index v = 0; v < items.size(); ++v) items[v] = {v, v};
    const std::vector<Vec3f> normals(with_normals ? items.size() : 0, Vec3f::UnitZ());
    const BlendRestorer restorer(model.detail, model.mesh.positions, model.driver().vertices, items, normals,
                                 RunContext());
    const std::vector<Vec3f> driver = driver_positions(model);
    const std::vector<Mat3f> gradients(driver.size(), Mat3f::Identity());
    std::vector<Vec3f> positions(items.size()), restored_normals(normals.size());
    double best = 1e9, best_triad = 1e9;
    for (auto _ : state) {
        best = std::min(best, seconds([&] {
                            restorer.restore(driver, gradients, positions, restored_normals, in_order, context);
                        }));
        if (state.iterations() % 10 == 0) {
            state.PauseTiming();
            best_triad = std::min(best_triad, seconds([&] { shared_triad().run(context, true); }));
            state.ResumeTiming();
        }
    }
    const double points = static_cast<double>(items.size());
    const double bytes = points * (20 + 12 + (with_normals ? 24 : 0) + (in_order ? 4 : 0));
    state.counters["vertices/s"] = points / best;
    state.counters["bytes/vertex"] = bytes / points;
    state.counters["bytes/s"] = bytes / best;
    state.counters["of_triad"] = bytes / best / (static_cast<double>(Triad::bytes(true)) / best_triad);
    state.SetLabel(std::to_string(items.size()) + " vertices" +
                   (with_normals ? ", with normals"
                    : in_order   ? ", in the mesh's order"
                                 : ""));
}
BENCHMARK(BM_restore_blend)
    ->ArgNames({"resolution", "threads", "extra"})
    ->ArgsProduct({{128, 256, 512, 1290}, {1, 2}, {0}})
    ->ArgsProduct({{256}, {1, 2}, {1, 2}})
    ->MinTime(1)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

/// Strip, with the seconds of its phases.
void BM_strip(benchmark::State& state) {
    const Mesh mesh = make_wavy_cube({.resolution = static_cast<unsigned>(state.range(0))});
    const RunContext context(static_cast<unsigned>(state.range(1)));
    StripReport report;
    for (auto _ : state) {
        state.PauseTiming();
        Mesh copy = mesh;
        state.ResumeTiming();
        report = strip(std::move(copy), {.base = 1000}, context)->report;
    }
    state.counters["simplify_s"] = report.simplify_seconds;
    state.counters["bind_s"] = report.bind_seconds;
    state.counters["encode_s"] = report.encode_seconds;
    state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations() * mesh.vertex_count()));
}
BENCHMARK(BM_strip)
    ->ArgNames({"resolution", "threads"})
    ->ArgsProduct({{128, 256, 512}, {1, 2}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

void BM_encode(benchmark::State& state) {
    const Mesh mesh = make_wavy_cube({.resolution = static_cast<unsigned>(state.range(0))});
    for (auto _ : state) benchmark::DoNotOptimize(encode_reference(mesh, {}, RunContext()));
    state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations() * mesh.vertex_count()));
}
BENCHMARK(BM_encode)->Arg(128)->Arg(512)->Unit(benchmark::kMillisecond)->UseRealTime();

} // namespace
