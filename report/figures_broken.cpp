// Our own figure of the report's broken cube: thrown on the ground, it breaks where the stress is too much for it, and
// its pieces keep their detail.
#include "figures.h"
#include "figures_layout.h"

#include "filigree/blend/pose_mesh.h"
#include "filigree/core/text.h"
#include "filigree/scene/scene_run.h"

#include <fmt/format.h>

namespace filigree::report {

namespace {

/// The gallery's shatter.toml with z up: a wavy cube falls on its corner, turning.
SceneFile thrown_cube() {
    SceneFile scene;
    scene.frames = 40;
    scene.world.gravity = {0, 0, -9.81};
    SceneBody& cube = scene.bodies.emplace_back();
    cube.name = cube.shape = "wavy-cube";
    cube.material.young_modulus = 3e6;
    cube.material.poisson_ratio = 0.45;
    cube.material.density = 1100;
    cube.material.damping = 0.2;
    cube.material.internal_damping = 2e-4;
    cube.body.cells.count = 4000;
    cube.centre = Vec3d(0, 0, 1);
    cube.velocity = {0, 0, -4};
    cube.rotation = Eigen::AngleAxisd(0.45, Vec3d(1, 1, 0).normalized());
    cube.spin = {0.7, 1.5, 0};
    SceneFracture& fracture = scene.fractures.emplace_back();
    fracture.pattern.pieces = 24;
    fracture.pattern.roughness = 0.8;
    fracture.material = {.strength = 6e4, .scatter = 0.2, .seed = 1};
    fracture.energy = 100;
    scene.obstacles.emplace_back().shape = "ground";
    scene.obstacles[0].ground = {Vec3d::Zero(), Vec3d::UnitZ()};
    return scene;
}

} // namespace

Figure draw_broken_cube(FigureRenderer& renderer) {
    constexpr double kPanelHeight = 250;
    const RunContext& context = renderer.context();
    RunContext quiet = context;
    quiet.progress = nullptr;
    const SceneFile scene = thrown_cube();
    const ReadyScene ready = set_up(scene, quiet).value();
    SceneRun run = SceneRun::create(scene, ready, false, quiet).value();
    const ReadyBody& cube = ready.bodies[0];
    std::size_t cracked = 0;
    FractureReport first;
    for (std::size_t frame = 1; frame <= scene.frames; ++frame) {
        run.advance_to(frame, quiet).value();
        context.report("breaking the cube", double(frame) / double(scene.frames));
        const FractureReport now = run.fracture(0);
        if (cracked == 0 && now.broken_area > 0.25 * now.crack_area) {
            cracked = frame + 1; // when it shows
            first = now;
        }
    }
    const FractureReport last = run.fracture(0);
    const Pose& end = run.recording().poses[0].frames.back();
    const Mesh whole = run.mesh(0, 0, quiet).value(), cracks = run.mesh(0, cracked, quiet).value(),
               apart = run.mesh(0, scene.frames, quiet).value(), driver = posed_driver(cube.model, end);

    Page page = captioned_page(
        content_height(2, kPanelHeight), "The broken cube",
        fmt::format(
            "The cube is thrown on the ground. It may break into {} pieces; it is simulated as one body, with a "
            "driver of {} vertices, until the stress is too much somewhere. (ii) is {:.0f} ms after the first "
            "crack, (iii) {:.1f} s later: {} parts. The detail stays on the pieces, vertex for vertex. (iv) is "
            "all that moved: what a player far away would see.",
            last.pieces, with_commas(cube.model.driver().vertices.size()),
            1e3 * (double(cracked) / scene.step.frames_per_second - last.first),
            double(scene.frames - cracked) / scene.step.frames_per_second, last.parts));
    const std::vector<Panel> panels = panels_in_rows(2, 2, kPanelHeight);
    const Mesh* in_pieces[] = {&apart, &driver};
    const Vec3d direction(0.62, -0.86, 0.52);
    const std::tuple<const char*, const char*, const Mesh*, std::size_t> parts[] = {
        {"i", "whole", &whole, whole.vertex_count()},
        {"ii", "cracked", &cracks, cracks.vertex_count()},
        {"iii", "apart", &apart, apart.vertex_count()},
        {"iv", "the driver", &driver, driver.vertex_count()}};
    for (std::size_t k = 0; k < 4; ++k) {
        const auto& [number, text, mesh, vertices] = parts[k];
        FigureRenderer::Look look = k == 3 ? with_edges(0.5f) : FigureRenderer::Look{};
        look.ground_level = k == 0 ? world_bounds(whole).min.z() - 0.15 : 0.0;
        const Mesh* alone[] = {mesh};
        const Camera camera =
            k < 2 ? common_camera(alone, direction, panels[k]) : common_camera(in_pieces, direction, panels[k]);
        draw_mesh(page, panels[k], renderer, *mesh, look, camera);
        subcaption(page, panels[k], number, fmt::format("{}, {} vertices", text, with_commas(vertices)));
    }
    return {std::move(page),
            {{"pieces", last.pieces},
             {"parts", last.parts},
             {"driver_vertices", cube.model.driver().vertices.size()},
             {"first_crack", last.first},
             {"broken_share", last.broken_area / last.crack_area},
             {"dissipated", last.dissipated}}};
}

} // namespace filigree::report
