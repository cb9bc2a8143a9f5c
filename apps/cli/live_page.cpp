#include "live_page.h"

#include "json.h"
#include "output_folder.h"
#include "web_page.h"

#include "filigree/core/text.h"
#include "filigree/io/model/model_file.h"
#include "filigree/physics/step/live_world.h"
#include "filigree/scene/world_setup.h"

#include <filesystem>
#include <map>
#include <optional>

#include <fmt/format.h>

namespace filigree::cli {

namespace {

namespace fs = std::filesystem;

/// Substeps of particles that a browser makes in a frame, about: with more of them time slows down.
constexpr double kUsualWork = 300'000;
constexpr std::size_t kAligned = 8;

/// The page's one file: "FLGPAGE1", the length of a JSON text, the text, then the parts that it names by their place.
class PageFile {
public:
    /// Of the parts, from behind the text on.
    Json add(std::string_view bytes) {
        parts_.resize((parts_.size() + kAligned - 1) / kAligned * kAligned, '\0');
        Json place{{"at", parts_.size()}, {"bytes", bytes.size()}};
        parts_ += bytes;
        return place;
    }
    template <class T>
    Json add(const std::vector<T>& values) {
        return add(std::string_view(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)));
    }
    std::string bytes(const Json& head) const {
        std::string text = head.text();
        text.resize((text.size() + kAligned - 1) / kAligned * kAligned, ' ');
        std::string all = "FLGPAGE1";
        const auto length = std::uint64_t(text.size());
        all.append(reinterpret_cast<const char*>(&length), sizeof length);
        return all + text + parts_;
    }

private:
    std::string parts_;
};

template <class Vector>
Json numbers(const Vector& v) {
    Json list = Json::array();
    for (int k = 0; k < 3; ++k) list.push_back(double(v[k]));
    return list;
}

LiveWorld live_world(const SceneFile& scene, const ReadyScene& ready) {
    LiveWorld live{ready.world, ready.actors, scene.step, {}};
    for (std::size_t b = 0; b < ready.bodies.size(); ++b) {
        const ReadyBody& body = ready.bodies[b];
        live.attached.push_back({b, body.in_metres(driver_positions(body.model)), body.pieces.driver});
    }
    return live;
}

/// Each model once, and which of them a body is.
Json add_bodies(const ReadyScene& ready, PageFile& file, Json& head, Session& session) {
    std::map<const Body*, std::size_t> known;
    Json bodies = Json::array(), models = Json::array();
    for (const ReadyBody& body : ready.bodies) {
        const auto [found, is_new] = known.try_emplace(body.body.get(), known.size());
        if (is_new) {
            const std::optional<Model> embedding = with_page_materials(body.model, body.mesh_path, session);
            models.push_back(file.add(write_model(embedding ? *embedding : body.model)));
        }
        bodies.push_back({{"name", body.name},
                          {"model", found->second},
                          {"scale", body.scale},
                          {"color", numbers(body.color)},
                          {"own_color", body.has_own_color},
                          {"breaks", !body.pieces.empty()}});
    }
    head["models"] = models;
    return bodies;
}

Json add_obstacles(const SceneFile& scene, const ReadyScene& ready, PageFile& file) {
    Json obstacles = Json::array();
    std::size_t drawn = 0;
    for (std::size_t number = 0; number < scene.obstacles.size(); ++number) {
        if (!scene.obstacles[number].visible) continue;
        const ShownObstacle& shown = ready.drawn[drawn++];
        Json obstacle{{"number", number}, {"color", numbers(shown.color)}};
        if (shown.is_ground) {
            obstacle["point"] = numbers(shown.plane.point);
            obstacle["normal"] = numbers(shown.plane.normal);
        } else {
            obstacle["positions"] = file.add(shown.mesh.positions);
            std::vector<Triangle> triangles;
            for (std::size_t f = 0; f < shown.mesh.face_count(); ++f) {
                const std::span<const Index> face = shown.mesh.face(f);
                for (std::size_t k = 2; k < face.size(); ++k) triangles.push_back({face[0], face[k - 1], face[k]});
            }
            obstacle["triangles"] = file.add(triangles);
        }
        obstacles.push_back(obstacle);
    }
    return obstacles;
}

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
    PageFile file;
    Json head{{"up", std::string(1, "xyz"[int(scene.picture.up)])},
              {"frame_rate", scene.step.frames_per_second},
              {"gravity", numbers(ready.world.gravity)}};
    const LiveWorld live = live_world(scene, ready);
    const std::string world = require(write_live_world(live));
    Simulation simulation = require(Simulation::create(live.world, live.actors, live.options, session.context()));
    const unsigned substeps = require(simulation.advance(session.silent_context())).substeps;
    head["world"] = file.add(world);
    head["bodies"] = add_bodies(ready, file, head, session);
    head["obstacles"] = add_obstacles(scene, ready, file);
    session.begin_writing(folder_name);
    const std::string bytes = file.bytes(head);
    require(write_file(path_of(page.model_path()), bytes));
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
    report.count("bytes", "bytes", bytes.size());
    report.count("of that physics", "physics_bytes", world.size());
    report.add("page", index, "page", index);
}

} // namespace filigree::cli
