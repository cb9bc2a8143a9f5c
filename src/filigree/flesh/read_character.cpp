// Any file that moves, as a skin.
#include "filigree/file.h"
#include "filigree/flesh.h"
#include "filigree/io/gltf/gltf.h"
#include "filigree/restore.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

constexpr double kOftenEnough = 60; ///< samples a second of what is known at any moment

Error nothing_moves(const std::string& name, const char* why) { return {ErrorCode::unsuitable, name + ": " + why}; }

/// Frames of an animation, linear in between.
MovingSurface surface_of(MeshAnimation animation, Mesh rest, std::string clip) {
    MovingSurface surface;
    surface.samples_per_second = animation.frames_per_second;
    surface.clips = {{std::move(clip), double(animation.frames - 1) / animation.frames_per_second}};
    surface.rest = std::move(rest);
    surface.positions = [animation = std::move(animation)](std::size_t, double seconds,
                                                           std::span<Vec3f> out) -> Status {
        const auto last = double(animation.frames - 1);
        const double place = std::clamp(seconds * animation.frames_per_second, 0.0, last);
        const auto frame = std::size_t(place + 1e-6);
        if (Status read = animation.positions(frame, out); !read) return read;
        const auto part = float(place - double(frame));
        if (part < 1e-4f || frame + 1 >= animation.frames) return Success{};
        std::vector<Vec3f> next(out.size());
        if (Status read = animation.positions(frame + 1, next); !read) return read;
        for (std::size_t v = 0; v < out.size(); ++v) out[v] += part * (next[v] - out[v]);
        return Success{};
    };
    return surface;
}

Result<SkinnedMesh> gltf_surface(GltfScene read, const std::string& name, std::size_t patches,
                                 const RunContext& context) {
    const auto scene = std::make_shared<const GltfScene>(std::move(read));
    if (scene->animations().empty())
        return nothing_moves(name, "has no skin and no animation, and so nothing moves; export it with its actions.");
    MovingSurface surface{.rest = scene->mesh(), .clips = {}, .positions = {}, .samples_per_second = kOftenEnough};
    std::vector<double> begins;
    for (std::size_t a = 0; a < scene->animations().size(); ++a) {
        const GltfAnimation& animation = scene->animations()[a];
        surface.clips.push_back({animation.name.empty() ? "clip " + std::to_string(a + 1) : animation.name,
                                 std::max(0.0, animation.last_key - animation.first_key)});
        begins.push_back(animation.first_key);
    }
    surface.positions = [scene, begins](std::size_t clip, double seconds, std::span<Vec3f> out) {
        return scene->positions(clip, begins[clip] + seconds, out, RunContext(1));
    };
    Result<SkinnedMesh> skin = skin_of_surface(std::move(surface), patches, context);
    if (skin) skin->warnings.insert(skin->warnings.begin(), scene->warnings().begin(), scene->warnings().end());
    return skin;
}

/// A model that its own poses move.
Result<SkinnedMesh> model_surface(const std::filesystem::path& path, const std::string& clip, std::size_t patches,
                                  const RunContext& context) {
    Result<Model> read = read_model(path, context);
    if (!read) return read.error();
    Result<PoseSequence> poses = read_poses(path, context);
    if (!poses) return poses.error();
    if (poses->empty()) return nothing_moves(path.string(), "has no poses, and so it does not move.");
    const auto model = std::make_shared<const Model>(std::move(*read));
    Result<Restorer> made = Restorer::create(*model, {}, context);
    if (!made) return made.error();
    const auto restorer = std::make_shared<const Restorer>(std::move(*made));
    const auto frames = std::make_shared<const PoseSequence>(std::move(*poses));
    MeshAnimation animation{.rest = nullptr,
                            .frames = frames->frames.size(),
                            .frames_per_second = frames->frames_per_second,
                            .positions = [model, restorer, frames](std::size_t frame, std::span<Vec3f> out) {
                                return restorer->positions(frames->frames[frame], out, RunContext(1));
                            }};
    return skin_of_surface(surface_of(std::move(animation), level_mesh(*model, model->finest_level()), clip), patches,
                           context);
}

} // namespace

Result<SkinnedMesh> read_character(const std::filesystem::path& path, const CharacterOptions& options,
                                   const RunContext& context) {
    const std::string clip = path.stem().string();
    if (!options.rest) {
        const Result<std::string> bytes = path.extension() == ".fil" || std::filesystem::is_directory(path)
                                              ? Result<std::string>(std::string())
                                              : read_file(path);
        if (!bytes) return bytes.error();
        if (path.extension() == ".fil") return model_surface(path, clip, options.patches, context);
        if (!is_gltf(*bytes))
            return nothing_moves(path.string(), "has positions alone; name the mesh that it moves as well.");
        Result<GltfScene> scene = GltfScene::read(path, context);
        if (!scene) return scene.error();
        if (scene->joint_count() > 0 && options.by_joints) return read_skin(path, context);
        return gltf_surface(std::move(*scene), path.string(), options.patches, context);
    }
    // Copies: the animation refers to the mesh for as long as it is asked.
    const auto rest = std::make_shared<const Mesh>(*options.rest);
    std::vector<std::string> warnings;
    PoseFileOptions file{.frames_per_second = options.frames_per_second,
                         .animation = {},
                         .up = {},
                         .rest = rest->positions,
                         .warnings = &warnings};
    if (const Result<AnimationFormat> format = animation_format(path);
        format && *format != AnimationFormat::glb && *format != AnimationFormat::numbered)
        file.rest = {}; // caches keep the order
    Result<MeshAnimation> opened = open_animation(path, *rest, file, context);
    if (!opened) return opened.error();
    if (opened->frames < 2) return nothing_moves(path.string(), "has one frame, and so it does not move.");
    MeshAnimation animation = std::move(*opened);
    animation.positions = [rest, positions = std::move(animation.positions)](std::size_t frame, std::span<Vec3f> out) {
        return positions(frame, out);
    };
    Result<SkinnedMesh> skin = skin_of_surface(surface_of(std::move(animation), *rest, clip), options.patches, context);
    if (skin) skin->warnings.insert(skin->warnings.begin(), warnings.begin(), warnings.end());
    return skin;
}

} // namespace filigree
