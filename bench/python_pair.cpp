// The C++ half of bench/python_bench.py: does a task once for each line that it reads, and answers with the seconds.
// Usage: python_pair MESH THREADS
#include "filigree/file.h"
#include "filigree/physics/simulation.h"
#include "filigree/pose.h"
#include "filigree/restore.h"
#include "filigree/strip.h"

#include <chrono>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <map>
#include <string>

using namespace filigree;

namespace {

constexpr int kRestores = 20, kCalls = 20000;

/// Mean of so many times.
double seconds_of(int times, const std::function<void()>& work) {
    const auto start = std::chrono::steady_clock::now();
    for (int k = 0; k < times; ++k) work();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() / times;
}

/// A model with all that restoring it takes.
struct Restoring {
    Model model;
    Restorer restorer;
    Pose pose;
    std::vector<Vec3f> out;

    Restoring(Model stripped, const RunContext& context)
        : model(std::move(stripped)), restorer(Restorer::create(model, {}, context).value()),
          pose(warp_pose(*make_bend(world_bounds(model.mesh), Axis::y, 60), model, context)),
          out(restorer.vertex_count()) {}
    Restoring(const Restoring&) = delete;
};

Model strip_to(const Mesh& mesh, std::size_t base, const RunContext& context) {
    StripOptions options;
    options.base = base;
    return strip(mesh, options, context).value().model;
}

} // namespace

int main(int count, char** words) {
    if (count != 3) return 2;
    const RunContext context(unsigned(std::atoi(words[2])));
    const Mesh mesh = read_mesh(words[1], context).value().mesh;
    Restoring large(strip_to(mesh, 1000, context), context);
    const Restoring tiny(strip_to(level_mesh(strip_to(mesh, 50, context), 0), 50, context), context);
    Pose without = large.pose;
    without.gradients.clear();
    std::vector<Vec3f> tiny_out(tiny.out.size());

    BodyOptions options;
    options.cells.count = 8000;
    Material material;
    Simulation simulation =
        Simulation::create(
            {}, {{.body = std::make_shared<const Body>(make_body(mesh, material, options, context).value())}},
            {.mode = StepMode::explicit_steps}, context)
            .value();

    const std::map<std::string, std::function<double()>> tasks = {
        {"restore",
         [&] {
             return seconds_of(kRestores, [&] { large.restorer.positions(large.pose, large.out, context).value(); });
         }},
        {"restore positions",
         [&] { return seconds_of(kRestores, [&] { large.restorer.positions(without, large.out, context).value(); }); }},
        {"call",
         [&] { return seconds_of(kCalls, [&] { tiny.restorer.positions(tiny.pose, tiny_out, context).value(); }); }},
        {"strip", [&] { return seconds_of(1, [&] { strip_to(mesh, 1000, context); }); }},
        {"body step", [&] { return seconds_of(1, [&] { simulation.advance(context).value(); }); }},
    };
    std::cout << tiny.out.size() << std::endl;
    for (std::string task; std::getline(std::cin, task);) std::cout << tasks.at(task)() << std::endl;
}
