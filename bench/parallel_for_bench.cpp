// Loops on our pool beside oneTBB's parallel_for with the same pieces, on all processors. Without oneTBB (Debian:
// libtbb-dev) only ours is measured. Arguments: pieces, and work in each (additions).
#include "filigree/core/parallel_for.h"

#include <benchmark/benchmark.h>

#include <vector>

#ifdef FILIGREE_BENCH_TBB
#include <tbb/parallel_for.h>
#endif

using namespace filigree;

namespace {

float work(std::size_t piece, std::size_t additions) {
    float sum = float(piece);
    for (std::size_t i = 0; i < additions; ++i) benchmark::DoNotOptimize(sum += 1);
    return sum;
}

void pool(benchmark::State& state) {
    const auto pieces = std::size_t(state.range(0)), additions = std::size_t(state.range(1));
    const RunContext context;
    std::vector<float> sums(pieces);
    for (auto _ : state)
        parallel_for(context, pieces, 1, [&](std::size_t begin, std::size_t) { sums[begin] = work(begin, additions); });
}
BENCHMARK(pool)
    ->Args({16, 10})
    ->Args({16, 1000})
    ->Args({64, 2000})
    ->Args({64, 16384})
    ->Args({4096, 100})
    ->UseRealTime();

#ifdef FILIGREE_BENCH_TBB
void one_tbb(benchmark::State& state) {
    const auto pieces = std::size_t(state.range(0)), additions = std::size_t(state.range(1));
    std::vector<float> sums(pieces);
    for (auto _ : state)
        tbb::parallel_for(std::size_t{0}, pieces, [&](std::size_t piece) { sums[piece] = work(piece, additions); });
}
BENCHMARK(one_tbb)
    ->Args({16, 10})
    ->Args({16, 1000})
    ->Args({64, 2000})
    ->Args({64, 16384})
    ->Args({4096, 100})
    ->UseRealTime();
#endif

} // namespace
