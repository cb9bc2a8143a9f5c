#include "commands.h"
#include "drawing.h"

#include "filigree/io/system/extension.h"
#include "filigree/io/system/numbered_name.h"

#include <algorithm>

namespace filigree::cli {

namespace {

[[noreturn]] void refuse_to_draw(const std::string& path) {
    refuse(ErrorCode::unsupported, path + ": this program draws no pictures and no films, as it was built without the "
                                          "renderer; write a .glb, and look at it in another program.");
}

} // namespace

std::vector<Command> drawing_commands() { return {}; }

void check_picture_path(const std::string& path) { refuse_to_draw(path); }
void check_png_path(const std::string& path) { refuse_to_draw(path); }

// Nobody comes here: their paths are checked before.
void draw_distances(const Mesh&, const Mesh&, const std::array<std::string, 2>&, const MeshDistance&, UpAxis,
                    const std::string& path, Session&) {
    refuse_to_draw(path);
}
void draw_expected_error(const Model&, const PoseError::Estimate&, const Mesh&, const std::string&, UpAxis,
                         const std::string& path, Session&) {
    refuse_to_draw(path);
}
void draw_quads(const QuadRemeshed&, View, UpAxis, const std::string& path, Session&) { refuse_to_draw(path); }
void draw_points_inside(const Mesh&, const std::vector<Vec3f>&, double, UpAxis, const std::string& path, Session&) {
    refuse_to_draw(path);
}

void check_png(const std::string&, const std::string&) {}
constexpr const char* kNoPoster = "The page has no poster, as this program was built without the renderer.";
void draw_poster(const Model&, const FrameSource<Pose>&, const std::string&, const std::string&, Session& session) {
    session.warn(kNoPoster);
}
void draw_poster(const GltfScene&, const std::string&, Session& session) { session.warn(kNoPoster); }

std::vector<std::string> draw_demo(const DemoScene&, const std::function<Pose(double)>&, const std::string&,
                                   const std::string&, Session& session) {
    session.warn("No picture and no film: this program was built without the renderer.");
    return {};
}

std::vector<BodyLook> looks_of_bodies(const ReadyScene& ready, Session& session) {
    const auto has_materials = [](const ReadyBody& body) { return !body.model.mesh.materials.names.empty(); };
    if (std::ranges::any_of(ready.bodies, has_materials))
        session.warn("Textures of melting bodies are left out: this program was built without the renderer.");
    return std::vector<BodyLook>(ready.bodies.size());
}

bool is_film(const std::string& path) {
    const std::string ending = lower_extension(path_of(path));
    return ending == ".mp4" || ending == ".gif" || (ending == ".png" && printf_numbered_name(path_of(path)));
}

struct SceneFilms::Films {};
SceneFilms::SceneFilms(const std::vector<std::string>& paths, const SceneFile&) { refuse_to_draw(paths.front()); }
SceneFilms::~SceneFilms() = default;
void SceneFilms::write(const SceneFile&, const ReadyScene&, const Recording&, Session&) {}

} // namespace filigree::cli
