// What a body that breaks costs as a whole: frames a second of a mesh that is thrown on the ground and goes to pieces
// which touch each other. FILIGREE_SCAN names the mesh; a wavy sphere unless said.
#include "filigree/file.h"
#include "filigree/fracture.h"
#include "filigree/mesh.h"
#include "filigree/physics/simulation.h"

#include <benchmark/benchmark.h>

#include <cstdlib>

namespace {

using namespace filigree;

constexpr int kFrames = 40; // it lands at once

const Mesh& thrown_mesh() {
    static const Mesh mesh = [] {
        const char* path = std::getenv("FILIGREE_SCAN");
        return path ? read_mesh(path, RunContext(2)).value().mesh : make_wavy_sphere({.resolution = 192});
    }();
    return mesh;
}

/// The mesh, 1 m long, with 10,000 particles, 0.02 m over the ground. pieces: 0: it does not break.
Simulation thrown(Index pieces, const RunContext& context) {
    const Mesh& mesh = thrown_mesh();
    const Box box = bounds(mesh.positions);
    const double scale = 1 / box.size().maxCoeff();
    Material brittle;
    brittle.young_modulus = 1e6;
    BodyOptions options;
    options.scale = scale;
    options.cells.count = 10'000;
    const auto body = std::make_shared<const Body>(make_body(mesh, brittle, options, context).value());
    Actor actor{.body = body, .velocity = {0, -4, 0}, .spin = {1, 0, 1}};
    const Vec3d foot(box.centre().x(), box.min.y(), box.centre().z());
    actor.placement.translation() = Vec3d(0, 0.02, 0) - scale * foot;
    if (pieces > 0) {
        const auto cells =
            std::make_shared<const FractureCells>(make_fracture_cells(mesh, {.pieces = pieces}, context).value());
        Partition partition{cells->pieces(),
                            [cells, scale](const Vec3d& point) { return cells->piece_at(point / scale); }};
        auto fracture = std::make_shared<Fracture>();
        fracture->body = break_body(body, std::move(partition), context).value();
        fracture->material = {.strength = 1e4, .scatter = 0.2, .energy = 3};
        actor.fracture = fracture;
    }
    World world;
    world.obstacles.emplace_back().shape = HalfSpace{};
    return Simulation::create(world, {actor}, {.frames_per_second = 60}, context).value();
}

/// Pieces; threads.
void fall(benchmark::State& state) {
    const RunContext context(unsigned(state.range(1)));
    Simulation simulation = thrown(Index(state.range(0)), context);
    const std::string start = simulation.save();
    double contact = 0, elastic = 0, substeps = 0;
    for (auto _ : state) {
        state.PauseTiming();
        (void)simulation.restore(start);
        state.ResumeTiming();
        for (int frame = 0; frame < kFrames; ++frame) {
            const FrameReport report = simulation.advance(context).value();
            contact += report.contact_seconds;
            elastic += report.elastic_seconds;
            substeps += report.substeps;
        }
    }
    const double frames = double(state.iterations()) * kFrames;
    state.counters["frames_a_second"] = benchmark::Counter(frames, benchmark::Counter::kIsRate);
    state.counters["elastic_ms"] = 1e3 * elastic / frames;
    state.counters["contact_ms"] = 1e3 * contact / frames;
    state.counters["substeps"] = substeps / frames;
    state.counters["particles"] = double(simulation.body(0).particle_count());
    const FractureReport broken = simulation.fracture(0);
    state.counters["parts"] = double(broken.parts);
}

BENCHMARK(fall)
    ->ArgNames({"pieces", "threads"})
    ->ArgsProduct({{0, 10, 30, 100}, {1, 2}})
    ->Iterations(1)
    ->MeasureProcessCPUTime()
    ->UseRealTime()
    ->Unit(benchmark::kSecond);

} // namespace
