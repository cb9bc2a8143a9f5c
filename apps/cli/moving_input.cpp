#include "moving_input.h"

#include "filigree/io/animation/pose_match.h"
#include "filigree/io/animation/usd_scene.h"
#include "filigree/io/gltf/gltf.h"
#include "filigree/io/model/model_file.h"
#include "filigree/io/system/extension.h"
#include "filigree/io/system/numbered_name.h"

#include <algorithm>
#include <filesystem>

namespace filigree::cli {

namespace {

namespace fs = std::filesystem;

/// A model's restored mesh as its own poses move it.
void open_model_animation(const MovingFiles& files, Session& session, MovingInput& input) {
    input.model = session.read_model(files.input, &input.poses);
    if (input.poses.empty()) refuse(ErrorCode::unsuitable, files.input + ": has no poses, and so it does not move.");
    input.restorer = require(Restorer::create(*input.model, {}, session.silent_context()));
    input.rest = level_mesh(*input.model, input.model->finest_level());
    input.animation = {&input.rest, input.poses.frames.size(),
                       files.options.frames_per_second.value_or(input.poses.frames_per_second),
                       [&input](std::size_t frame, std::span<Vec3f> positions) {
                           return input.restorer->positions(input.poses.frames[frame], positions);
                       }};
}

} // namespace

Mesh first_mesh(const std::string& path, Session& session) {
    const std::vector<fs::path> files = animation_files(path_of(path));
    if (files.empty()) refuse(ErrorCode::not_found, path + ": has no meshes.");
    std::vector<std::pair<std::uint64_t, fs::path>> numbered;
    for (const fs::path& file : files) {
        const std::string stem = file.stem().string();
        const std::size_t digits = stem.find_last_not_of("0123456789") + 1;
        if (digits < stem.size()) numbered.emplace_back(std::stoull(stem.substr(digits).substr(0, 18)), file);
    }
    return session.read_mesh((numbered.empty() ? files.front() : std::ranges::min(numbered).second).string());
}

void open_moving_input(const MovingFiles& files, Session& session, MovingInput& input) {
    const std::string extension = lower_extension(path_of(files.input));
    const bool is_gltf_file = extension == ".glb" || extension == ".gltf";
    std::error_code ignored;
    const bool is_sequence = numbered_name(path_of(files.input)) || fs::is_directory(path_of(files.input), ignored);
    if (!is_sequence && extension == ".fil" && files.mesh.empty()) return open_model_animation(files, session, input);
    PoseFileOptions file = files.options;
    std::vector<std::string> warnings;
    if (!files.mesh.empty()) {
        input.rest = session.read_mesh(files.mesh);
        if (is_gltf_file || is_sequence) { // vertices may have been split or sorted on the way
            file.rest = input.rest.positions;
            file.warnings = &warnings;
        }
    } else if (is_sequence) {
        input.rest = first_mesh(files.input, session);
        input.needs_rest = true;
    } else if (is_gltf_file) {
        const GltfScene scene = require(GltfScene::read(path_of(files.input), session.context()));
        session.warn(scene.warnings());
        input.rest = scene.mesh();
        input.joints = scene.joint_count();
    } else if (is_usd(path_of(files.input))) {
        input.rest = require(read_usd_mesh(path_of(files.input)));
    } else if (const std::optional<Error> error = alembic_error(path_of(files.input))) {
        refuse(error->code, error->message);
    } else {
        refuse(files.input + ": has positions alone; --mesh FILE gives the mesh that it moves.");
    }
    input.animation = require(open_animation(path_of(files.input), input.rest, file, session.context()));
    session.warn(warnings);
    if (files.mesh.empty() || file.warnings || input.animation.frames == 0) return;
    std::vector<Vec3f> first(input.rest.vertex_count()); // caches of programs with another axis up lie on their faces
    require(input.animation.positions(0, first));
    if (const std::string turned =
            turned_first_frame(input.rest.positions, first, input.rest.origin, path_of(files.input));
        !turned.empty())
        session.warn(turned);
}

} // namespace filigree::cli
