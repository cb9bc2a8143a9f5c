// What contacts cost: a frame of bodies that meet, with the part of it that contacts take. One thread, unless said.
#include "heap.h"

#include "filigree/file.h"
#include "filigree/physics/body/make_cells.h"
#include "filigree/physics/simulation.h"

#include <benchmark/benchmark.h>

#include <cstdlib>

namespace {

using namespace filigree;

const RunContext kOneThread(1), kTwoThreads(2);

World ground() {
    World world;
    world.obstacles.emplace_back().shape = HalfSpace{};
    return world;
}

Actor put(std::shared_ptr<const Body> body, const Vec3d& at) {
    Actor actor{.body = std::move(body)};
    actor.placement.translation() = at;
    return actor;
}

/// Frames from..until of a scene, over and over.
void run(benchmark::State& state, const World& world, const std::vector<Actor>& actors, int from, int until,
         bool within_bodies = true, const RunContext& context = kOneThread) {
    Simulation simulation =
        Simulation::create(world, actors, {.contacts_within_bodies = within_bodies}, context).value();
    for (int frame = 0; frame < from; ++frame) (void)simulation.advance(context).value();
    const std::string start = simulation.save();
    double contact = 0, deepest = 0, substeps = 0;
    std::size_t frames = 0;
    for (auto _ : state) {
        if (frames % std::size_t(until - from) == 0) {
            state.PauseTiming();
            (void)simulation.restore(start);
            state.ResumeTiming();
        }
        const FrameReport report = simulation.advance(context).value();
        contact += report.contact_seconds;
        substeps += report.substeps;
        deepest = std::max(deepest, report.deepest_in_matter);
        ++frames;
    }
    state.counters["contact_ms"] = 1e3 * contact / double(frames);
    state.counters["substeps"] = substeps / double(frames);
    state.counters["deepest_spacings"] = deepest / actors[0].body->spacing();
}

/// 0: the heap's pieces fall, 1: they lie; and threads.
void heap(benchmark::State& state) {
    const bench::Heap heap = bench::make_heap();
    const int from = state.range(0) ? bench::kHeapRests : 0;
    run(state, heap.world, heap.actors, from, from + 60, true, state.range(1) == 2 ? kTwoThreads : kOneThread);
}

/// A mesh of 1 m, FILIGREE_SCAN, that falls 0.3 m; 0 or 1: whether it meets itself; and threads.
void scan(benchmark::State& state) {
    const char* path = std::getenv("FILIGREE_SCAN");
    if (!path || !*path) {
        state.SkipWithError("FILIGREE_SCAN names no mesh");
        return;
    }
    const Mesh mesh = read_mesh(path, kOneThread).value().mesh;
    const Box box = bounds(mesh.positions);
    Material rubber;
    rubber.young_modulus = 1e6;
    BodyOptions options;
    options.scale = 1 / box.size().maxCoeff();
    options.cells.count = 10'600;
    const auto body = std::make_shared<Body>(make_body(mesh, rubber, options, kOneThread).value());
    const Vec3d foot(box.centre().x(), box.min.y(), box.centre().z());
    run(state, ground(), {put(body, Vec3d(0, 0.3, 0) - options.scale * foot)}, 0, 90, state.range(0) != 0,
        state.range(1) == 2 ? kTwoThreads : kOneThread);
}

/// Five soft cubes in a stack that has come to rest.
void stack(benchmark::State& state) {
    Material rubber;
    rubber.young_modulus = 1e6;
    const auto cube = std::make_shared<Body>(make_body(box_cells(6, 6, 6, 0.4 / 6, Vec3d(-0.2, -0.2, -0.2)), rubber));
    std::vector<Actor> actors;
    for (int i = 0; i < 5; ++i) actors.push_back(put(cube, Vec3d(0, 0.2 + 0.4 * i, 0)));
    run(state, ground(), actors, 120, 180);
}

BENCHMARK(heap)->Args({0, 1})->Args({1, 1})->Args({0, 2})->Iterations(60)->Unit(benchmark::kMillisecond);
BENCHMARK(scan)->Args({0, 1})->Args({1, 1})->Args({1, 2})->Iterations(90)->Unit(benchmark::kMillisecond);
BENCHMARK(stack)->Iterations(60)->Unit(benchmark::kMillisecond);

} // namespace
