#include "live_page.h"

#include "output_folder.h"
#include "web_page.h"

#include "filigree/core/text.h"
#include "filigree/scene/page_file.h"

#include <filesystem>
#include <vector>

#include <fmt/format.h>

namespace filigree::cli {

namespace {

namespace fs = std::filesystem;

/// Substeps of particles that a browser makes in a frame, about: with more of them time slows down.
constexpr double kUsualWork = 300'000;

} // namespace

void export_live_page(const SceneFile& scene, const std::string& folder_name, const std::string& input,
                      const WebLook& look, Session& session, Report& report) {
    OutputFolder folder(path_of(folder_name), path_of(input));
    std::vector<fs::path> meshes;
    for (const SceneBody& body : scene.bodies) meshes.push_back(path_of(body.mesh));
    for (const SceneObstacle& obstacle : scene.obstacles) meshes.push_back(path_of(obstacle.mesh));
    folder.protect(meshes);
    WebPage page(folder, look, WebModel::live);
    const ReadyScene ready = require(set_up(scene, session.context()));
    session.warn(ready.warnings);
    const LiveWorld live = live_world(scene, ready);
    Simulation simulation = require(Simulation::create(live.world, live.actors, live.options, session.context()));
    const unsigned substeps = require(simulation.advance(session.silent_context())).substeps;
    const PageFile file = require(write_page_file(
        scene, ready, [&](const ReadyBody& body) { return with_page_materials(body.model, body.mesh_path, session); }));
    session.begin_writing(folder_name);
    require(write_file(path_of(page.model_path()), file.bytes));
    page.write(session);
    folder.keep();

    std::size_t particles = 0, vertices = 0;
    for (const ReadyBody& body : ready.bodies) {
        particles += body.body->particle_count();
        vertices += body.model.vertex_count();
    }
    if (const double work = double(particles) * substeps / kUsualWork; work > 1)
        session.warn(
            {fmt::format("A frame takes {} substeps of {} particles, about {:.2g} times what a browser computes "
                         "in real time; the page then shows slow motion. Softer bodies (young_modulus) and "
                         "fewer particles take less.",
                         with_commas(substeps), with_commas(particles), work)});
    const std::string index = (path_of(folder_name) / "index.html").string();
    report.set("output", folder_name);
    report.count("bodies", "bodies", ready.bodies.size());
    report.count("particles", "particles", particles);
    report.count("substeps", "substeps", substeps);
    report.count("vertices", "vertices", vertices);
    report.count("bytes", "bytes", file.bytes.size());
    report.count("of that physics", "physics_bytes", file.physics_bytes);
    report.add("page", index, "page", index);
}

} // namespace filigree::cli
