#include "motion_file.h"

#include "words.h"
#include "workbench_impl.h"

#include "filigree/io/animation/pose_match.h"
#include "filigree/io/gltf/gltf.h"
#include "filigree/io/system/extension.h"
#include "filigree/io/system/numbered_name.h"
#include "filigree/skin.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

namespace filigree::studio {

namespace {

namespace fs = std::filesystem;

constexpr double kUsualRate = 30;
constexpr std::size_t kMostBytes = std::size_t{1} << 30; ///< of all frames

using Frames = std::vector<std::vector<Vec3f>>;

Result<Frames> frames_in_memory(const MeshAnimation& animation, const RunContext& context) {
    const std::size_t bytes = animation.frames * animation.rest->vertex_count() * sizeof(Vec3f);
    if (bytes > kMostBytes)
        return Error{ErrorCode::unsuitable, "Its frames take " + size_text(bytes).toStdString() +
                                                ", more than the window holds (1 GB); 'filigree fit' reads them one by "
                                                "one, and the window opens what it writes."};
    Frames frames;
    for (std::size_t frame = 0; frame < animation.frames; ++frame) {
        if (context.is_cancelled()) return cancelled_error();
        context.report("reading frames", double(frame) / double(animation.frames));
        frames.emplace_back(animation.rest->vertex_count());
        if (const Status read = animation.positions(frame, frames.back()); !read) return read.error();
        for (const Vec3f& p : frames.back())
            if (!p.allFinite())
                return Error{ErrorCode::unsuitable,
                             "Frame " + std::to_string(frame + 1) + " has a position that is not finite."};
    }
    return frames;
}

/// The driver rests in every frame: it is not fitted yet.
std::shared_ptr<const Recording> unfitted(MovingMesh original, const Model& model) {
    auto recording = std::make_shared<Recording>();
    recording->frames_per_second = original.frames_per_second;
    recording->frames.assign(original.frames.size(), std::make_shared<const Pose>(rest_pose(model)));
    recording->original = std::make_shared<const MovingMesh>(std::move(original));
    return recording;
}

std::string contents_of(const GltfScene& scene, const std::vector<std::string>& clips) {
    std::vector<QString> parts;
    if (scene.joint_count() > 0) parts.push_back("a skin of " + counted(scene.joint_count(), "joint", "joints"));
    if (scene.morph_count() > 0) parts.push_back(counted(scene.morph_count(), "morph target", "morph targets"));
    std::vector<QString> names;
    constexpr std::size_t kMostNames = 4;
    for (const std::string& clip : clips)
        if (names.size() < kMostNames) names.push_back(QString::fromStdString(clip));
    if (clips.size() > kMostNames) names.push_back("others");
    if (!clips.empty()) parts.push_back(counted(clips.size(), "clip", "clips") + " (" + listed(names) + ')');
    return listed(parts).toStdString();
}

std::vector<std::string> clip_names(const GltfScene& scene) {
    std::vector<std::string> names;
    for (const GltfAnimation& animation : scene.animations())
        names.push_back(animation.name.empty() ? "clip " + std::to_string(names.size() + 1) : animation.name);
    return names;
}

std::string all_but_number(const fs::path& path) {
    const std::string stem = path.stem().string();
    return stem.substr(0, stem.find_last_not_of("0123456789") + 1);
}

/// "a_####.obj" of "a_0001.obj".
fs::path pattern_of(const fs::path& path) {
    const std::string before = all_but_number(path);
    return path.parent_path() /
           (before + std::string(path.stem().string().size() - before.size(), '#') + path.extension().string());
}

} // namespace

bool is_point_cache(const std::string& path) {
    const std::string extension = lower_extension(path_of(path));
    return extension == ".pc2" || extension == ".mdd";
}

bool is_gltf_file(const std::string& path) {
    const std::string extension = lower_extension(path_of(path));
    return extension == ".glb" || extension == ".gltf";
}

bool is_numbered(const std::string& path) {
    const fs::path one = path_of(path);
    if (!mesh_format(one) || all_but_number(one) == one.stem().string()) return false;
    std::error_code none;
    std::size_t count = 0;
    const std::optional<NumberedName> name = numbered_name(pattern_of(one));
    for (const auto& entry : fs::directory_iterator(one.parent_path(), none))
        if (name && name->number_of(entry.path().filename().string()) && ++count > 1) return true;
    return false;
}

Result<State> gltf_state(const std::string& path, std::size_t clip, std::optional<double> frames_per_second,
                         const RunContext& context) {
    const Result<GltfScene> scene = GltfScene::read(path_of(path), context);
    if (!scene) return scene.error();
    const std::vector<std::string> clips = clip_names(*scene);
    auto source = source_of(scene->mesh(), path, file_name(path).toStdString(), context);
    source->contents = contents_of(*scene, clips);
    source->warnings = scene->warnings();
    std::ranges::copy(source->materials.warnings, std::back_inserter(source->warnings));
    State state;
    state.source = source;
    if (clip < clips.size() && scene->mesh().face_count() > 0) {
        MovingMesh original{path, clips, clip, {}, frames_per_second.value_or(kUsualRate)};
        if (scene->joint_count() > 0)
            if (const Result<SkinnedMesh> skin = read_skin(path_of(path), context)) // else flesh is refused, with why
                for (const SkinJoint& joint : skin->joints)
                    if (!joint.is_node_of_mesh) original.joints.push_back(joint.name);
        const GltfAnimation& animation = scene->animations()[clip];
        const double seconds = std::max(0.0, animation.last_key - animation.first_key);
        const auto frames = std::size_t(std::lround(seconds * original.frames_per_second)) + 1;
        const auto positions = [&](std::size_t frame, std::span<Vec3f> out) {
            const double at = std::min(double(frame) / original.frames_per_second, seconds);
            return scene->positions(clip, animation.first_key + at, out, context);
        };
        Result<Frames> read = frames_in_memory({&source->mesh, frames, original.frames_per_second, positions}, context);
        if (!read) return read.error();
        original.frames = std::move(*read);
        Result<State> stripped = stripped_state(std::move(state), context);
        if (!stripped) return stripped.error();
        stripped->recording = unfitted(std::move(original), *stripped->model);
        return stripped;
    }
    return stripped_state(std::move(state), context);
}

Result<State> numbered_state(const std::string& path, double frames_per_second, const RunContext& context) {
    const fs::path pattern = pattern_of(path_of(path));
    Result<MeshFile> file = read_mesh(path_of(path), context);
    if (!file) return file.error();
    MovingMesh original{path, {}, 0, {}, frames_per_second};
    Result<MeshAnimation> animation =
        open_animation(pattern, file->mesh, {.frames_per_second = frames_per_second}, context);
    if (!animation) return animation.error();
    Result<Frames> frames = frames_in_memory(*animation, context);
    if (!frames) return frames.error();
    original.frames = std::move(*frames);
    animation->positions = [&](std::size_t frame, std::span<Vec3f> out) -> Status {
        std::ranges::copy(original.frames[frame], out.begin());
        return Success{};
    };
    const Result<std::size_t> rest = least_stretched_frame(*animation, context);
    if (!rest) return rest.error();
    file->mesh.positions = original.frames[*rest];
    file->mesh.normals = {};
    auto source = source_of(std::move(file->mesh), path, file_name(pattern.string()).toStdString(), context);
    source->warnings = std::move(file->warnings);
    State state;
    state.source = std::move(source);
    Result<State> stripped = stripped_state(std::move(state), context);
    if (!stripped) return stripped.error();
    stripped->recording = unfitted(std::move(original), *stripped->model);
    return stripped;
}

Result<std::shared_ptr<const Recording>> cache_recording(const std::string& path, const State& state,
                                                         double frames_per_second, std::vector<std::string>& warnings,
                                                         const RunContext& context) {
    const Mesh& mesh = state.source->mesh;
    PoseFileOptions options;
    if (lower_extension(path_of(path)) == ".pc2") options.frames_per_second = frames_per_second;
    const Result<MeshAnimation> animation = open_animation(path_of(path), mesh, options, context);
    if (!animation && animation.error().code == ErrorCode::mismatch)
        return Error{ErrorCode::mismatch, animation.error().message + " Open the mesh that the file moves first."};
    if (!animation) return animation.error();
    Result<Frames> frames = frames_in_memory(*animation, context);
    if (!frames) return frames.error();
    if (frames->empty()) return Error{ErrorCode::unsuitable, "It has no frames."};
    if (const std::string turned = turned_first_frame(mesh.positions, frames->front(), mesh.origin, path_of(path));
        !turned.empty())
        warnings.push_back(turned);
    return unfitted({path, {}, 0, {}, animation->frames_per_second, std::move(*frames)}, *state.model);
}

} // namespace filigree::studio
