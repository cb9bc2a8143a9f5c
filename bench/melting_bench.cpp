// What a surface of particles costs: the field a particle, the mesh a triangle. One thread; boxes of 10 k to 1 M
// particles.
#include "filigree/melting/field_surface.h"

#include <benchmark/benchmark.h>

#include <cmath>

namespace {

using namespace filigree;

const RunContext kOneThread(1);

MatterParticles box_of(std::int64_t count) {
    MatterParticles matter;
    matter.spacing = 1;
    const int side = int(std::lround(std::cbrt(double(count))));
    for (int z = 0; z < side; ++z)
        for (int y = 0; y < side; ++y)
            for (int x = 0; x < side; ++x) matter.positions.emplace_back(float(x), float(y), float(z));
    matter.volumes.assign(matter.positions.size(), 1);
    return matter;
}

void field(benchmark::State& state) {
    const MatterParticles matter = box_of(state.range(0));
    for (auto _ : state) benchmark::DoNotOptimize(make_particle_field(matter, {}, kOneThread).value());
    state.SetItemsProcessed(state.iterations() * std::int64_t(matter.positions.size()));
}

void surface(benchmark::State& state) {
    const ParticleField of = make_particle_field(box_of(state.range(0)), {}, kOneThread).value();
    std::int64_t triangles = 0;
    for (auto _ : state) triangles += std::int64_t(make_field_surface(of, kOneThread)->face_count());
    state.SetItemsProcessed(triangles);
}

BENCHMARK(field)->Arg(10'000)->Arg(100'000)->Arg(1'000'000)->Unit(benchmark::kMillisecond);
BENCHMARK(surface)->Arg(10'000)->Arg(100'000)->Arg(1'000'000)->Unit(benchmark::kMillisecond);

} // namespace
