#include "commands.h"
#include "drawing.h"
#include "output_folder.h"
#include "restore_options.h"

#include "filigree/mesh.h"
#include "filigree/pose.h"
#include "filigree/strip.h"

#include <algorithm>
#include <cmath>

#include "interactive/timing.h"

#include <fmt/format.h>

namespace filigree::cli {

namespace {

constexpr unsigned kDemoResolution =
    264; // of the wavy cube, as large as the cube of the report Detail-Preserving Animation

/// What the demo does to a mesh: a twist and a bend along one axis, as far as the mesh is slim enough not to fold.
struct DemoWarp {
    Box box;
    Axis axis;
    double twist_deg, bend_deg;

    /// What stands leans over, and its base stays on the ground; what lies is bent along its longest side.
    DemoWarp(const Box& of, UpAxis up) : box(of), axis(up) {
        constexpr double kLying = 1.5; // longest side over height
        if (box.size().maxCoeff() > kLying * box.size()[int(axis)]) axis = longest_axis(box);
        const int a = int(axis);
        const double length = box.size()[a];
        const double half_width = 0.5 * std::hypot(box.size()[(a + 1) % 3], box.size()[(a + 2) % 3]);
        const double slimness = length / std::max(half_width, 1e-9 * length);
        twist_deg = std::min(90.0, 45 * slimness);
        bend_deg = std::min(75.0, 25 * slimness); // the inner side keeps half of the radius or more
        if (axis != up) return;
        box.min[a] -= length; // the middle of a box twice as high does not move, and that is the base
        twist_deg *= 2;
        bend_deg *= 2;
    }

    /// The way to it, from 0 to 1.
    std::unique_ptr<SpaceWarp> warp(double part = 1) const {
        std::vector<std::unique_ptr<SpaceWarp>> warps;
        warps.push_back(make_twist(box, axis, twist_deg * part));
        warps.push_back(make_bend(box, axis, bend_deg * part));
        return make_chain(std::move(warps));
    }
};

struct DemoArguments {
    std::string input, output = "filigree-demo";
    bool no_pictures = false;
    std::optional<UpAxis> up;
};

void run_demo(const DemoArguments& options, Session& session) {
    const auto& [input, folder, no_pictures, asked_up] = options;
    const RunContext& context = session.context();
    OutputFolder files(path_of(folder), path_of(input));
    const std::string model_file = files.file("model.fil"), mesh_file = files.file("mesh.ply"),
                      driver_file = files.file("driver.ply"), posed_driver_file = files.file("driver_bent.ply"),
                      full_file = files.file("full_deformation.ply"), restored_file = files.file("restored.ply"),
                      picture_file = files.file("demo.png"), film_file = files.file("demo.mp4");

    const double start = now_seconds();
    Mesh mesh = input.empty() ? make_wavy_cube({.resolution = kDemoResolution}) : session.read_mesh(input);
    const double read = now_seconds();
    const Stripped stripped = require(strip(mesh, {}, context));
    const Model& model = stripped.model;
    const double strip_seconds = now_seconds() - read;

    // The long way: every vertex, and every normal where the mesh has them.
    const UpAxis up = up_of(asked_up, mesh, input);
    const DemoWarp deformation(world_bounds(mesh), up);
    const auto warp = deformation.warp();
    Mesh full = mesh;
    const double full_seconds =
        bench::median_seconds([&] { full.positions = warp_positions(*warp, mesh.positions, mesh.origin, context); });
    full = mesh;
    warp_mesh(*warp, full, context);

    // Ours: the driver with its gradients, then all detail back.
    const Restorer restorer = require(Restorer::create(model, {}, context));
    Pose pose;
    const double driver_seconds = bench::median_seconds([&] { pose = warp_pose(*warp, model, context); });
    std::vector<Vec3f> positions(mesh.vertex_count());
    const double restore_seconds =
        bench::median_seconds([&] { require(restorer.positions(pose, positions, context)); });
    const Mesh restored = require(restorer.mesh(pose, context));
    const MeshDistance with_gradients = require(mesh_distance(restored, full, 0, context));
    const Mesh from_positions = require(restorer.mesh({pose.positions, {}}, context));
    const MeshDistance positions_only = require(mesh_distance(from_positions, full, 0, context));

    session.write_model(model, model_file);
    session.write_mesh(driver_mesh(model), driver_file);
    session.write_mesh(posed_driver(model, pose), posed_driver_file);
    session.write_mesh(mesh, mesh_file);
    session.write_mesh(full, full_file);
    session.write_mesh(restored, restored_file);
    std::vector<std::string> pictures_made;
    if (!no_pictures && mesh.face_count() > 0) {
        const DemoScene scene{mesh, model, pose, restored, with_gradients, up};
        const auto pose_at = [&](double part) { return warp_pose(*deformation.warp(part), model, context); };
        pictures_made = draw_demo(scene, pose_at, picture_file, film_file, session);
    }
    files.keep();

    const double ours = driver_seconds + restore_seconds;
    const VertexDistance& d = *with_gradients.vertices;
    const VertexDistance& p = *positions_only.vertices;
    Report report;
    report.row("mesh", fmt::format("{} vertices, {} faces  ({})", with_commas(mesh.vertex_count()),
                                   with_commas(mesh.face_count()), input.empty() ? "the built-in wavy cube" : input));
    report.row("driver", fmt::format("{} vertices, stripped in {}", with_commas(model.driver().vertices.size()),
                                     seconds_text(strip_seconds)));
    report.row("deform every vertex", seconds_text(full_seconds));
    report.row("deform driver, restore", fmt::format("{}  ({} + {})", seconds_text(ours), seconds_text(driver_seconds),
                                                     seconds_text(restore_seconds)));
    report.row("speed ratio", fmt::format("{:.1f} times", full_seconds / ours));
    report.row("difference, rms", distance_text(with_gradients, d.rms));
    report.row("normals, mean error",
               fmt::format("{:.2g} degrees; 95 % within {:.2g}", d.normal_mean_deg, d.normal_p95_deg));
    report.row("without gradients", fmt::format("rms {:.2e} of the diagonal, 95 % of normals within {:.2g} degrees",
                                                positions_only.relative(p.rms), p.normal_p95_deg));
    report.row("files", folder + "/: mesh, driver, driver_bent, restored, full_deformation (.ply), model.fil");
    if (!pictures_made.empty()) report.row("to look at", fmt::format("{}", fmt::join(pictures_made, ", ")));
    session.print(report.text(), {{"mesh", input.empty() ? "wavy-cube" : input},
                                  {"output", folder},
                                  {"pictures", pictures_made},
                                  {"vertices", mesh.vertex_count()},
                                  {"driver_vertices", model.driver().vertices.size()},
                                  {"read_seconds", read - start},
                                  {"strip_seconds", strip_seconds},
                                  {"full_seconds", full_seconds},
                                  {"driver_seconds", driver_seconds},
                                  {"restore_seconds", restore_seconds},
                                  {"speed_ratio", full_seconds / ours},
                                  {"rms", with_gradients.relative(d.rms)},
                                  {"rms_units", d.rms},
                                  {"max", with_gradients.relative(d.max)},
                                  {"max_units", d.max},
                                  {"normal_mean_deg", d.normal_mean_deg},
                                  {"normal_p95_deg", d.normal_p95_deg},
                                  {"positions_only_rms", positions_only.relative(p.rms)},
                                  {"positions_only_rms_units", p.rms},
                                  {"positions_only_normal_p95_deg", p.normal_p95_deg}});
}

} // namespace

Command demo_command() {
    const auto options = std::make_shared<DemoArguments>();
    return {.name = "demo",
            .text = "The main job from start to end: strip, bend and twist the driver, restore, compare",
            .options = {Option("mesh", options->input,
                               fmt::format("Mesh (default: a wavy cube with {} vertices)",
                                           with_commas(wavy_cube_vertices(kDemoResolution)))),
                        Option("-o,--output", options->output, "Folder for the meshes, the picture and the film")
                            .with_default(),
                        Option("--no-pictures", options->no_pictures, "Make no picture and no film"),
                        found_up_option(options->up)},
            .examples = "  filigree demo\n  filigree demo scan.ply -o out",
            .run = [options](Session& session) { run_demo(*options, session); }};
}

} // namespace filigree::cli
