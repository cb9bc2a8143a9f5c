// What a step of the material point method costs: particles a second, by their number and by threads; beside other
// work look at processor time.
#include "filigree/physics/body/make_cells.h"
#include "filigree/physics/material.h"
#include "filigree/physics/simulation.h"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <ctime>

namespace {

using namespace filigree;

/// A cube of wax, side^3 particles, that falls while the air melts it. range(0): side; range(1): threads.
void melting_cube(benchmark::State& state) {
    const auto side = std::size_t(state.range(0));
    const RunContext context(unsigned(state.range(1)));
    const auto materials = named_materials();
    const Material& wax = std::ranges::find(materials, "wax", &NamedMaterial::name)->material;
    World world;
    world.air_heat_transfer = 100;
    world.air_temperature.constant = 400;
    world.heat_pace = 100;
    world.obstacles.emplace_back().shape = HalfSpace{};
    Actor actor{std::make_shared<const Body>(bare_body(box_cells(side, side, side, 0.32 / double(side)), wax))};
    actor.placement.translation() = Vec3d(0, 0.05, 0);
    Simulation simulation = Simulation::create(world, {actor}, {}, context).value();
    std::size_t steps = 0;
    const std::clock_t begun = std::clock(); // processor time of all threads
    for (auto _ : state) steps += simulation.advance(context).value().substeps;
    const double particles = double(side * side * side);
    state.counters["particles"] = particles;
    const double processor = double(std::clock() - begun) / CLOCKS_PER_SEC;
    state.counters["particles_a_processor_second"] = particles * double(steps) / processor;
    state.counters["particles_a_second"] = benchmark::Counter(particles * double(steps), benchmark::Counter::kIsRate);
}
BENCHMARK(melting_cube)
    ->ArgsProduct({{22, 46}, {1, 2}})
    ->Args({100, 1})
    ->Iterations(3)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

} // namespace
