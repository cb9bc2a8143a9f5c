// The fem material: cells a second for forces, against a plain loop of the same formulas.
// One thread counts processor time, two count the clock's; items are cells.
#include "interactive/cell_forces.h"

#include <benchmark/benchmark.h>
#include <map>

namespace {

using namespace filigree;

const ShakenBox& box(std::int64_t corners) {
    static const std::map<std::int64_t, std::array<std::size_t, 3>> kSizes = {
        {1000, {10, 10, 10}},  {8000, {20, 20, 20}},  {10000, {25, 20, 20}},
        {27000, {30, 30, 30}}, {64000, {40, 40, 40}}, {200000, {58, 59, 58}}};
    static std::map<std::int64_t, ShakenBox> boxes;
    return boxes.try_emplace(corners, kSizes.at(corners)).first->second;
}

void count_cells(benchmark::State& state, const ShakenBox& s) {
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(s.cell_count()));
    state.SetLabel(std::to_string(s.positions.size()) + " corners");
}

void forces(benchmark::State& state, int lanes, unsigned threads) {
    const ShakenBox& s = box(state.range(0));
    const cell_kernel::Plan plan = cell_kernel::make_plan(s.body);
    const RunContext context(threads);
    Vectors result(s.positions.size());
    cell_kernel::Sums sums;
    for (auto _ : state) {
        cell_kernel::forces(plan, s.positions, result, sums, lanes, context);
        benchmark::DoNotOptimize(result.x.data());
    }
    count_cells(state, s);
}

/// The same where stiffness and density vary.
void forces_of_fields(benchmark::State& state) {
    const ShakenBox& s = box(state.range(0));
    Body varied = s.body;
    BodyFields fields;
    for (std::size_t c = 0; c < s.cell_count(); ++c) {
        fields.stiffness.push_back(float(1 + c % 7));
        fields.density.push_back(float(1 + c % 3));
    }
    if (!set_fields(varied, fields)) return state.SkipWithError("no fields");
    const cell_kernel::Plan plan = cell_kernel::make_plan(varied);
    const RunContext context(1);
    Vectors result(s.positions.size());
    cell_kernel::Sums sums;
    for (auto _ : state) {
        cell_kernel::forces(plan, s.positions, result, sums, context);
        benchmark::DoNotOptimize(result.x.data());
    }
    count_cells(state, s);
}

void plain(benchmark::State& state) {
    const ShakenBox& s = box(state.range(0));
    Vectors result(s.positions.size());
    for (auto _ : state) {
        plain_forces(s, result);
        benchmark::DoNotOptimize(result.x.data());
    }
    count_cells(state, s);
    const cell_kernel::Plan plan = cell_kernel::make_plan(s.body);
    Vectors ours(s.positions.size());
    cell_kernel::Sums sums;
    const RunContext context(1);
    cell_kernel::forces(plan, s.positions, ours, sums, context);
    float most = 0, off = 0;
    for (std::size_t i = 0; i < ours.size(); ++i) {
        most = std::max(most, result[i].norm());
        off = std::max(off, (result[i] - ours[i]).norm());
    }
    if (!(off < 1e-4f * most)) state.SkipWithError("not the same forces");
}

const bool kRegistered = [] {
    benchmark::RegisterBenchmark("plain_forces", plain)->Arg(8000)->Arg(200000);
    benchmark::RegisterBenchmark("forces/fields", forces_of_fields)->Unit(benchmark::kMicrosecond)->Arg(8000);
    for (const int lanes : cell_kernel::lane_counts()) {
        const std::string suffix = "/lanes:" + std::to_string(lanes);
        auto* f = benchmark::RegisterBenchmark(("forces" + suffix).c_str(), forces, lanes, 1u);
        f->Unit(benchmark::kMicrosecond);
        if (lanes == cell_kernel::lane_counts().back())
            f->Arg(1000)->Arg(8000)->Arg(10000)->Arg(27000)->Arg(64000)->Arg(200000);
        else
            f->Arg(8000)->Arg(200000);
    }
    const int lanes = cell_kernel::lane_counts().back();
    for (const unsigned threads : {1u, 2u}) {
        const std::string suffix = "/threads:" + std::to_string(threads);
        benchmark::RegisterBenchmark(("forces" + suffix).c_str(), forces, lanes, threads)
            ->Unit(benchmark::kMicrosecond)
            ->Arg(8000)
            ->Arg(200000)
            ->UseRealTime();
    }
    return true;
}();

} // namespace
