// What contacts cost: a frame of bodies that meet, with the part of it that contacts take. One thread.
#include "filigree/io/mesh_file.h"
#include "filigree/physics/simulation.h"

#include <benchmark/benchmark.h>

#include <cstdlib>

namespace {

using namespace filigree;

const RunContext kOneThread(1);

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
         bool within_bodies = true) {
    Simulation simulation =
        Simulation::create(world, actors, {.contacts_within_bodies = within_bodies}, kOneThread).value();
    for (int frame = 0; frame < from; ++frame) (void)simulation.advance(kOneThread).value();
    const std::string start = simulation.save();
    double contact = 0, deepest = 0, substeps = 0;
    std::size_t frames = 0;
    for (auto _ : state) {
        if (frames % std::size_t(until - from) == 0) {
            state.PauseTiming();
            (void)simulation.restore(start);
            state.ResumeTiming();
        }
        const FrameReport report = simulation.advance(kOneThread).value();
        contact += report.contact_seconds;
        substeps += report.substeps;
        deepest = std::max(deepest, report.deepest_in_matter);
        ++frames;
    }
    state.counters["contact_ms"] = 1e3 * contact / double(frames);
    state.counters["substeps"] = substeps / double(frames);
    state.counters["deepest_spacings"] = deepest / actors[0].body->spacing();
}

/// 200 rigid pieces over a tray: 0 falling, 1 heaped.
void heap(benchmark::State& state) {
    World world = ground();
    world.body_friction = 0.5;
    world.body_restitution = 0.3;
    for (const Vec3d& side : {Vec3d(1, 0, 0), Vec3d(-1, 0, 0), Vec3d(0, 0, 1), Vec3d(0, 0, -1)})
        world.obstacles.emplace_back().shape = HalfSpace{-0.5 * side, side};
    Material stone;
    stone.model = MaterialModel::rigid;
    stone.density = 2600;
    std::vector<std::shared_ptr<const Body>> kinds;
    for (const auto& [x, y, z] : {std::array{3u, 3u, 3u}, {4u, 3u, 2u}, {5u, 2u, 3u}, {3u, 4u, 3u}})
        kinds.push_back(std::make_shared<Body>(
            make_body(box_cells(x, y, z, 0.025, -0.0125 * Vec3d(double(x), double(y), double(z))), stone)));
    std::vector<Actor> actors;
    for (int i = 0; i < 200; ++i) {
        const int x = i % 5, z = i / 5 % 5, y = i / 25;
        actors.push_back(put(kinds[std::size_t(i % 4)],
                             {0.16 * (x - 2) + 0.01 * (y % 3), 0.1 + 0.15 * y, 0.14 * (z - 2) + 0.01 * (2 * y % 3)}));
        actors.back().placement.rotate(Eigen::AngleAxisd(0.4 * (7 * i % 16), Vec3d(1, i % 3, i % 5).normalized()));
    }
    const int from = state.range(0) ? 300 : 0;
    run(state, world, actors, from, from + 60);
}

/// A mesh of 1 m, FILIGREE_SCAN, that falls 0.3 m; 0 or 1: whether it meets itself.
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
    run(state, ground(), {put(body, Vec3d(0, 0.3, 0) - options.scale * foot)}, 0, 90, state.range(0) != 0);
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

BENCHMARK(heap)->Arg(0)->Arg(1)->Iterations(60)->Unit(benchmark::kMillisecond);
BENCHMARK(scan)->Arg(0)->Arg(1)->Iterations(90)->Unit(benchmark::kMillisecond);
BENCHMARK(stack)->Iterations(60)->Unit(benchmark::kMillisecond);

} // namespace
