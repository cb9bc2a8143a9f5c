// Poses from an animated glTF: its animation, sampled at the frame rate from 0 s to its last key.
#include "filigree/io/gltf.h"
#include "filigree/io/point_cache_formats.h"
#include "filigree/io/pose_match.h"

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

/// Positions by the file's vertices, relative to the model's origin.
std::vector<Vec3f> relative_to(std::vector<Vec3f> positions, const Vec3d& from, const Vec3d& origin) {
    const Vec3d shift = from - origin;
    if (!shift.isZero())
        for (Vec3f& p : positions) p = (p.cast<double>() + shift).cast<float>();
    return positions;
}

/// Which of the file's vertices are the driver's: by number, or by their places in the file's own rest mesh, else in
/// its first frame.
Result<VertexMatch> match_scene(const GltfScene& scene, std::size_t animation, std::size_t points, const Vec3d& origin,
                                const PoseFileOptions& options, const std::string& path, const RunContext& context) {
    VertexMatch plain;
    const std::size_t count = scene.mesh().vertex_count();
    std::vector<Vec3f> places = relative_to(scene.mesh().positions, scene.mesh().origin, origin);
    if (options.up) turn_up(places, origin, *options.up);
    std::optional<VertexMatch> match;
    if (options.rest.size() == points) match = match_by_place(options.rest, places);
    if (!match && options.rest.size() == points) {
        if (Status placed = scene.positions(animation, 0, places, context); !placed) return placed.error();
        places = relative_to(std::move(places), scene.mesh().origin, origin);
        if (options.up) turn_up(places, origin, *options.up);
        match = match_by_place(options.rest, places);
    }
    if (!match && count == points) return plain;
    if (!match)
        return Error{ErrorCode::mismatch,
                     path + ": has " + std::to_string(count) + " vertices, and what it should move has " +
                         std::to_string(points) +
                         "; it is of another mesh, or vertices were split for their normals or UVs on the way and are "
                         "not at the driver's places at rest, where they would be welded (in Blender: Shade Smooth)."};
    if (match->is_plain()) return plain;
    if (options.warnings)
        options.warnings->push_back(path + ": its " + std::to_string(count) +
                                    (count > points ? " vertices were split for their normals or UVs, and were matched"
                                                    : " vertices are in another order, and were matched") +
                                    " to the driver's " + std::to_string(points) + " by their places at rest.");
    return *std::move(match);
}

} // namespace

Result<FrameSource<Pose>> open_gltf_poses(const std::filesystem::path& path, std::size_t points, const Vec3d& origin,
                                          const PoseFileOptions& options, const RunContext& context) {
    constexpr double kMostFrames = 1e7, kRounding = 1e-6; // of a frame: a last key that float's rounding put before it
    Result<GltfScene> read = GltfScene::read(path, context);
    if (!read) return read.error();
    const auto scene = std::make_shared<const GltfScene>(std::move(*read));
    const Result<std::size_t> animation = find_animation(*scene, options.animation, path.string());
    if (!animation) return animation.error();
    const GltfAnimation& keys = scene->animations()[*animation];
    const double rate = options.frames_per_second.value_or(kUnsaidRate);
    // a clip begins at 0 and holds its first key until then, so that those of one scene stay in step
    const double first = std::min(keys.first_key, 0.0);
    const double last_frame = (keys.last_key - first) * rate + kRounding;
    if (!(last_frame >= 0 && last_frame < kMostFrames))
        return Error{ErrorCode::unsuitable, path.string() + ": its animation is too long for this frame rate."};
    RunContext silent = context; // whoever fetches tells of frames
    silent.progress = nullptr;
    Result<VertexMatch> match = match_scene(*scene, *animation, points, origin, options, path.string(), silent);
    if (!match) return match.error();
    return FrameSource<Pose>{static_cast<std::size_t>(last_frame) + 1, rate,
                             [scene, which = *animation, first, rate, points, origin, silent, path,
                              match = *std::move(match)](std::size_t frame) -> Result<Pose> {
                                 std::vector<Vec3f> positions(scene->mesh().vertex_count());
                                 const double seconds = first + double(frame) / rate;
                                 if (Status done = scene->positions(which, seconds, positions, silent); !done)
                                     return done.error();
                                 positions = relative_to(std::move(positions), scene->mesh().origin, origin);
                                 Pose pose;
                                 if (match.source.empty()) {
                                     pose.positions = std::move(positions);
                                     return pose;
                                 }
                                 pose.positions.resize(points);
                                 if (Status done = match.apply(positions, pose.positions, path); !done)
                                     return done.error();
                                 return pose;
                             }};
}

} // namespace filigree
