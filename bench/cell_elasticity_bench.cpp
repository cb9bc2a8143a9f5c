// The fem material: cells a second for forces and for descent sweeps, against a plain loop of the same formulas.
// One thread counts processor time, two count the clock's; items are cells.
#include "filigree/physics/body.h"
#include "filigree/physics/cell_kernel.h"

#include <benchmark/benchmark.h>
#include <map>
#include <random>

namespace {

using namespace filigree;

/// A box with its corners shaken by a tenth of the spacing, and a step from there.
struct Scene {
    Body body;
    Vectors positions;
    std::vector<float> inertia;
    std::vector<std::uint8_t> fixed, touched;

    explicit Scene(const std::array<std::size_t, 3>& corners) {
        const double h = 1.0 / static_cast<double>(corners[0] - 1);
        body.cells = box_cells(corners[0] - 1, corners[1] - 1, corners[2] - 1, h);
        const std::size_t count = body.cells.corners.size();
        body.rest = positions = Vectors(count);
        std::mt19937 random(1);
        std::uniform_real_distribution<float> shift(-0.1f, 0.1f);
        for (std::size_t i = 0; i < count; ++i) {
            const auto& at = body.cells.corners[i];
            const Vec3f rest = float(h) * Vec3f(at[0], at[1], at[2]);
            body.rest.set(i, rest);
            positions.set(i, rest + float(h) * Vec3f(shift(random), shift(random), shift(random)));
        }
        const double dt = 1.0 / 240;
        inertia.assign(count, float(body.material.density * h * h * h / (dt * dt)));
        fixed.assign(count, 0);
        touched.assign(count, 0);
    }
    std::size_t cell_count() const { return body.cells.cells.size(); }
};

const Scene& scene(std::int64_t corners) {
    static const std::map<std::int64_t, std::array<std::size_t, 3>> kSizes = {
        {1000, {10, 10, 10}},  {8000, {20, 20, 20}},  {10000, {25, 20, 20}},
        {27000, {30, 30, 30}}, {64000, {40, 40, 40}}, {200000, {58, 59, 58}}};
    static std::map<std::int64_t, Scene> scenes;
    return scenes.try_emplace(corners, kSizes.at(corners)).first->second;
}

void count_cells(benchmark::State& state, const Scene& s) {
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(s.cell_count()));
    state.SetLabel(std::to_string(s.positions.size()) + " corners");
}

void forces(benchmark::State& state, int lanes, unsigned threads) {
    const Scene& s = scene(state.range(0));
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

void sweep(benchmark::State& state, int lanes, unsigned threads) {
    const Scene& s = scene(state.range(0));
    const cell_kernel::Plan plan = cell_kernel::make_plan(s.body);
    const RunContext context(threads);
    Vectors positions = s.positions;
    const Descent descent{s.positions, s.inertia, s.fixed, s.touched};
    for (auto _ : state) cell_kernel::sweep(plan, positions, descent, lanes, context);
    count_cells(state, s);
}

/// The same forces, cell by cell and corner by corner, as one writes them first.
void plain_forces(const Scene& s, Vectors& result) {
    const Body& body = s.body;
    const cell_kernel::CellMaterial m = cell_kernel::cell_material(body.material, body.cells.spacing);
    const float h = m.spacing, size = 4 * h, size3 = size * size * size;
    constexpr float kappa[] = {0, 1, 1, 2.0f / 3, 1, 2.0f / 3, 2.0f / 3, 1.0f / 3};
    for (auto* axis : {&result.x, &result.y, &result.z}) std::fill(axis->begin(), axis->end(), 0.0f);
    const auto sign = [](unsigned m_, unsigned corner) {
        return ((m_ & ~corner & 1) + (m_ & ~corner & 2) / 2 + (m_ & ~corner & 4) / 4) % 2 ? -1.0f : 1.0f;
    };
    for (std::size_t cell = 0; cell < body.cells.cells.size(); ++cell) {
        const auto& corners = body.cells.cell_corners[cell];
        Vec3f X[8];
        for (unsigned k = 1; k < 8; ++k) {
            X[k] = Vec3f::Zero();
            for (unsigned c = 0; c < 8; ++c) X[k] += sign(k, c) * s.positions[corners[c]];
        }
        float I = 0;
        for (unsigned k = 1; k < 8; ++k) I += kappa[k] * X[k].squaredNorm() / (size * size);
        const Vec3f cofactor[3] = {X[2].cross(X[4]), X[4].cross(X[1]), X[1].cross(X[2])};
        const float J = X[1].dot(cofactor[0]) / size3;
        const float linear = body.cells.fraction[cell] * m.shear * (1 - 1 / (I + 1)) * h / 16;
        const float volume = body.cells.fraction[cell] * m.bulk * (J - m.rest_ratio) / 64;
        for (unsigned c = 0; c < 8; ++c) {
            Vec3f gradient = Vec3f::Zero();
            for (unsigned k = 1; k < 8; ++k) gradient += sign(k, c) * linear * kappa[k] * X[k];
            for (unsigned axis = 0; axis < 3; ++axis) gradient += sign(1u << axis, c) * volume * cofactor[axis];
            result.add(corners[c], -gradient);
        }
    }
}

void plain(benchmark::State& state) {
    const Scene& s = scene(state.range(0));
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
    for (const int lanes : cell_kernel::lane_counts()) {
        const std::string suffix = "/lanes:" + std::to_string(lanes);
        auto* f = benchmark::RegisterBenchmark(("forces" + suffix).c_str(), forces, lanes, 1u);
        auto* d = benchmark::RegisterBenchmark(("sweep" + suffix).c_str(), sweep, lanes, 1u);
        for (auto* b : {f, d}) {
            b->Unit(benchmark::kMicrosecond);
            if (lanes == cell_kernel::lane_counts().back())
                b->Arg(1000)->Arg(8000)->Arg(10000)->Arg(27000)->Arg(64000)->Arg(200000);
            else
                b->Arg(8000)->Arg(200000);
        }
    }
    const int lanes = cell_kernel::lane_counts().back();
    for (const unsigned threads : {1u, 2u}) {
        const std::string suffix = "/threads:" + std::to_string(threads);
        benchmark::RegisterBenchmark(("forces" + suffix).c_str(), forces, lanes, threads)
            ->Unit(benchmark::kMicrosecond)
            ->Arg(8000)
            ->Arg(200000)
            ->UseRealTime();
        benchmark::RegisterBenchmark(("sweep" + suffix).c_str(), sweep, lanes, threads)
            ->Unit(benchmark::kMicrosecond)
            ->Arg(8000)
            ->Arg(200000)
            ->UseRealTime();
    }
    return true;
}();

} // namespace
