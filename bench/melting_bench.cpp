// What a surface of particles costs: the field a particle, the mesh a triangle. One thread; boxes of 10 k to 1 M
// particles. And what stitching costs: a ball of 200 k triangles whose upper half is new matter.
#include "filigree/melting/composite_surface.h"
#include "filigree/melting/field_surface.h"
#include "filigree/mesh.h"

#include <benchmark/benchmark.h>

#include <algorithm>
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

/// Renewal below, at and above a height.
float renewal_at(const Vec3f& at) { return std::clamp(at[2] / 0.1f, 0.0f, 1.0f); }

void stitch(benchmark::State& state) {
    const Mesh mesh = make_wavy_sphere({.resolution = 129, .amplitude = 0.01});
    MatterParticles matter;
    matter.spacing = 1.0f / 45;
    for (int z = -23; z < 23; ++z)
        for (int y = -23; y < 23; ++y)
            for (int x = -23; x < 23; ++x) {
                const Vec3f at = matter.spacing * Vec3f(float(x) + 0.5f, float(y) + 0.5f, float(z) + 0.5f);
                if (at.norm() < 0.5f) matter.positions.push_back(at);
            }
    matter.volumes.assign(matter.positions.size(), std::pow(matter.spacing, 3.0f));
    std::vector<float> renewal;
    for (const Vec3f& at : mesh.positions) renewal.push_back(renewal_at(at));
    for (const Vec3f& at : matter.positions) matter.renewal.push_back(renewal_at(at));
    const ParticleField of = make_particle_field(matter, {}, kOneThread).value();
    const CompositeMesher mesher = CompositeMesher::create(mesh, kOneThread).value();
    CompositeSurface surface;
    for (auto _ : state) {
        std::vector<std::uint8_t> dead;
        surface = mesher.make(mesh, renewal, matter, {}, of, dead, kOneThread).value();
    }
    state.counters["kept"] = double(surface.kept_triangles);
    state.counters["seam"] = double(surface.seam_triangles);
    state.counters["matter"] = double(surface.matter_triangles);
}

BENCHMARK(field)->Arg(10'000)->Arg(100'000)->Arg(1'000'000)->Unit(benchmark::kMillisecond);
BENCHMARK(surface)->Arg(10'000)->Arg(100'000)->Arg(1'000'000)->Unit(benchmark::kMillisecond);
BENCHMARK(stitch)->Unit(benchmark::kMillisecond);

} // namespace
