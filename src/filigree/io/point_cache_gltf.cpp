// Poses from an animated glTF: its animation, sampled at the frame rate from 0 s to its last key.
#include "filigree/io/gltf.h"
#include "filigree/io/point_cache_formats.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

Result<std::size_t> find_animation(const GltfScene& scene, const std::string& name, const std::string& path) {
    const std::vector<GltfAnimation>& all = scene.animations();
    if (all.empty()) return Error{ErrorCode::unsuitable, path + ": has no animation."};
    if (name.empty()) return std::size_t{0};
    const auto found =
        std::find_if(all.begin(), all.end(), [&](const GltfAnimation& animation) { return animation.name == name; });
    if (found != all.end()) return std::size_t(found - all.begin());
    std::string known;
    for (const GltfAnimation& animation : all) known += (known.empty() ? "'" : ", '") + animation.name + "'";
    return Error{ErrorCode::usage, path + ": has no animation '" + name + "', but " + known + "."};
}

} // namespace

Result<PoseStream> open_gltf_poses(const std::filesystem::path& path, std::size_t points, const Vec3d& origin,
                                   const PoseFileOptions& options, const RunContext& context) {
    constexpr double kMostFrames = 1e7, kRounding = 1e-6; // of a frame: a last key that float's rounding put before it
    Result<GltfScene> read = GltfScene::read(path, context);
    if (!read) return read.error();
    const auto scene = std::make_shared<const GltfScene>(std::move(*read));
    const Result<std::size_t> animation = find_animation(*scene, options.animation, path.string());
    if (!animation) return animation.error();
    if (scene->mesh().vertex_count() != points)
        return Error{ErrorCode::mismatch,
                     path.string() + ": has " + std::to_string(scene->mesh().vertex_count()) +
                         " vertices, and what it should move has " + std::to_string(points) +
                         "; it is of another mesh, or vertices were split for their normals or UVs on the way."};
    const GltfAnimation& keys = scene->animations()[*animation];
    const double rate = options.frames_per_second.value_or(kUnsaidRate);
    // a clip begins at 0 and holds its first key until then, so that those of one scene stay in step
    const double first = std::min(keys.first_key, 0.0);
    const double last_frame = (keys.last_key - first) * rate + kRounding;
    if (!(last_frame >= 0 && last_frame < kMostFrames))
        return Error{ErrorCode::unsuitable, path.string() + ": its animation is too long for this frame rate."};
    RunContext silent = context; // whoever fetches tells of frames
    silent.progress = nullptr;
    return PoseStream{
        static_cast<std::size_t>(last_frame) + 1, rate,
        [scene, which = *animation, first, rate, points, origin, silent](std::size_t frame) -> Result<Pose> {
            Pose pose;
            pose.positions.resize(points);
            const double seconds = first + double(frame) / rate;
            if (Status done = scene->positions(which, seconds, pose.positions, silent); !done) return done.error();
            const Vec3d shift = scene->mesh().origin - origin;
            if (!shift.isZero())
                for (Vec3f& p : pose.positions) p = (p.cast<double>() + shift).cast<float>();
            return pose;
        }};
}

} // namespace filigree
