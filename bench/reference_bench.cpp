// The reference code's restore against the streaming triad of the same run: both are bound by memory, so the fraction
// says how much of the machine the restore uses. Counters: vertices/s, bytes moved a vertex, fraction of the triad.
#include "filigree/core/parallel_for.h"
#include "filigree/hierarchy/reference_code.h"
#include "filigree/mesh/shapes.h"

#include <benchmark/benchmark.h>
#include <chrono>
#include <map>
#include <memory>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace {

using namespace filigree;

constexpr std::size_t kTriadFloats = std::size_t{16} << 20; // three arrays of 64 MiB: larger than caches
constexpr std::size_t kTriadGrain = std::size_t{1} << 16;

struct TriadArrays {
    std::vector<float> a = std::vector<float>(kTriadFloats, 1), b = a, c = a;
};
TriadArrays& triad_arrays() {
    static TriadArrays arrays;
    return arrays;
}

/// a = b + 3 c; bytes counted: two reads and a write, and for plain stores the line that each write first reads.
void triad(const RunContext& context, bool streams) {
    TriadArrays& t = triad_arrays();
    parallel_for(context, kTriadFloats, kTriadGrain, [&](std::size_t begin, std::size_t end) {
#if defined(__SSE2__)
        if (streams) {
            for (std::size_t i = begin; i < end; i += 4)
                _mm_stream_ps(&t.a[i],
                              _mm_add_ps(_mm_loadu_ps(&t.b[i]), _mm_mul_ps(_mm_set1_ps(3), _mm_loadu_ps(&t.c[i]))));
            _mm_sfence();
            return;
        }
#endif
        for (std::size_t i = begin; i < end; ++i) t.a[i] = t.b[i] + 3 * t.c[i];
    });
    benchmark::ClobberMemory();
}
constexpr std::size_t triad_bytes(bool streams) { return (streams ? 12 : 16) * kTriadFloats; }

void BM_triad(benchmark::State& state) {
    const RunContext context(static_cast<unsigned>(state.range(0)));
    const bool streams = state.range(1) != 0;
    for (auto _ : state) triad(context, streams);
    state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations() * triad_bytes(streams)));
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
    const ReferenceRestorer restorer(c.detail, static_cast<Law>(state.range(2)), context);
    const std::size_t side = c.detail.patches.side() + 1;
    std::vector<Vec3f> grids(c.detail.patches.patch_count() * side * side);
    double best = 1e9, best_triad = 1e9;
    for (auto _ : state) {
        best = std::min(best, seconds([&] {
                            restorer.restore_grids(c.detail.rest_driver, c.detail.patches.levels, grids, context);
                        }));
        if (state.iterations() % 10 == 0) {
            state.PauseTiming();
            best_triad = std::min(best_triad, seconds([&] { triad(context, true); }));
            state.ResumeTiming();
        }
    }
    // Records once; of the points a level writes, those of all but the finest are read again.
    const double points = static_cast<double>(grids.size());
    const double bytes = static_cast<double>(restorer.code_bytes()) + points * 12 * (4.0 / 3 + 1.0 / 3);
    const double rate = bytes / best, triad_rate = static_cast<double>(triad_bytes(true)) / best_triad;
    state.counters["vertices/s"] = points / best;
    state.counters["bytes/vertex"] = bytes / points;
    state.counters["bytes/s"] = rate;
    state.counters["of_triad"] = rate / triad_rate;
    state.SetLabel(std::to_string(c.vertices) + " vertices, " +
                   std::string(law_name(static_cast<Law>(state.range(2)))));
}
BENCHMARK(BM_restore_grids)
    ->ArgNames({"resolution", "threads", "law", "references"})
    ->ArgsProduct({{128, 256, 512, 1024}, {1, 2}, {0, 1}, {3}})
    ->ArgsProduct({{1024}, {1}, {2, 3}, {3}})
    ->ArgsProduct({{1024}, {1}, {0, 1}, {4, 6}})
    ->MinTime(1)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

void BM_encode(benchmark::State& state) {
    const Mesh mesh = make_wavy_cube({.resolution = static_cast<unsigned>(state.range(0))});
    for (auto _ : state) benchmark::DoNotOptimize(encode_reference(mesh, {}, RunContext()));
    state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations() * mesh.vertex_count()));
}
BENCHMARK(BM_encode)->Arg(128)->Arg(512)->Unit(benchmark::kMillisecond)->UseRealTime();

} // namespace
