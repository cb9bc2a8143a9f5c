// A body made of a mesh falls on the ground; the driver goes along, and takes the detail with it.
#include <filigree/mesh.h>
#include <filigree/physics/simulation.h>
#include <filigree/restore.h>
#include <filigree/strip.h>

#include <cstdio>

using namespace filigree;

int main() {
    const RunContext context;
    const Model model = strip(make_wavy_cube({.resolution = 32}), {.base = 300}, context).value().model;

    const Material rubber{.density = 1000, .young_modulus = 1e5, .poisson_ratio = 0.4};
    const auto body =
        std::make_shared<const Body>(make_body(model.mesh, rubber, {.cells = {.count = 1000}}, context).value());
    const double bottom = bounds(model.mesh.positions).min.y();

    World world;
    Obstacle& ground = world.obstacles.emplace_back();
    ground.shape = HalfSpace{Vec3d(0, bottom - 0.5, 0), Vec3d::UnitY()};
    Simulation simulation = Simulation::create(world, {{body}}, {}, context).value();

    const std::vector<Vec3f> driver = driver_positions(model);
    const std::size_t attachment = simulation.attach(0, driver, context);
    const Restorer restorer = Restorer::create(model, {}, context).value();
    Pose pose{driver, std::vector<Mat3f>(driver.size())};
    double lowest = 0;
    for (int frame = 0; frame < 60; ++frame) {
        const FrameReport report = simulation.advance(context).value();
        simulation.attached(attachment, pose.positions, pose.gradients, context);
        const std::vector<Vec3f> restored = restorer.positions(pose, context).value();
        lowest = std::min(lowest, bounds(restored).min.y() - bottom);
        if (frame % 10 == 9)
            std::printf("frame %d: %u substeps, %zu contacts, %zu vertices restored\n", frame + 1, report.substeps,
                        report.contacts, restored.size());
    }
    return lowest < -0.45 && lowest > -0.55 ? 0 : 1; // it fell half a metre, and lay on the ground
}
