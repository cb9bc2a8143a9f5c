#include "filigree/io/animation/point_cache.h"
#include "filigree/file.h"
#include "filigree/io/animation/point_cache_formats.h"
#include "filigree/io/animation/pose_match.h"
#include "filigree/io/animation/usd.h"
#include "filigree/io/animation/usd_scene.h"
#include "filigree/io/model/model_file.h"
#include "filigree/io/system/extension.h"
#include "filigree/io/system/numbered_name.h"
#include "filigree/mesh/normals.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace filigree {

namespace {

namespace fs = std::filesystem;

constexpr const char* kKnownCacheFormats =
    "use .pc2, .mdd, .usda, .glb, a folder (NAME/), or NAME_####.ply for numbered meshes";

void take_origin_off(std::span<Vec3f> positions, const Vec3d& origin) {
    if (origin.isZero()) return;
    for (Vec3f& p : positions) p = (p.cast<double>() - origin).cast<float>();
}

Result<FrameSource<Pose>> open_own_poses(const fs::path& path, std::size_t points, const PoseFileOptions& options,
                                         const RunContext& context) {
    Result<PoseSequence> poses = read_poses(path, context);
    if (!poses) return poses.error();
    if (poses->empty())
        return Error{ErrorCode::unsuitable,
                     path.string() + ": has no poses of its own; a simulation writes models that have some."};
    if (poses->frames[0].positions.size() != points)
        return Error{ErrorCode::mismatch,
                     path.string() + ": its poses have " + std::to_string(poses->frames[0].positions.size()) +
                         " vertices and the driver has " + std::to_string(points) + "; they are of another model."};
    const auto kept = std::make_shared<PoseSequence>(std::move(*poses));
    return FrameSource<Pose>{kept->frames.size(), options.frames_per_second.value_or(kept->frames_per_second),
                             [kept](std::size_t frame) -> Result<Pose> { return kept->frames[frame]; }};
}

/// Positions of a stream's poses alone.
MeshAnimation animation_of(FrameSource<Pose> stream, const Mesh& rest) {
    return {&rest, stream.frames, stream.frames_per_second,
            [pose = std::move(stream.frame)](std::size_t frame, std::span<Vec3f> positions) -> Status {
                const Result<Pose> moved = pose(frame);
                if (!moved) return moved.error();
                std::copy(moved->positions.begin(), moved->positions.end(), positions.begin());
                return Success{};
            },
            stream.metres_per_unit};
}

bool is_cache(const std::string& extension) { return extension == ".pc2" || extension == ".mdd"; }

Result<MeshAnimation> open_cache(const fs::path& path, const std::string& extension, std::size_t points,
                                 const PoseFileOptions& options) {
    return extension == ".pc2" ? open_pc2(path, points, options.frames_per_second)
                               : open_mdd(path, points, options.frames_per_second);
}

Status check_rate(const PoseFileOptions& options) {
    if (options.frames_per_second && !(std::isfinite(*options.frames_per_second) && *options.frames_per_second > 0))
        return Error{ErrorCode::usage, "A frame rate must be a number above 0."};
    return Success{};
}

/// The rest mesh as a frame moves it.
Result<Mesh> mesh_at(const MeshAnimation& animation, std::size_t frame, const RunContext& context) {
    Mesh mesh = *animation.rest;
    if (Status fetched = animation.positions(frame, mesh.positions); !fetched) return fetched.error();
    if (!mesh.normals.empty()) mesh.normals = {vertex_normals(mesh, mesh.positions, context), {}};
    return mesh;
}

} // namespace

Status CheckedFrames::fetch(std::size_t frame, std::span<Vec3f> positions) {
    if (Status fetched = animation_.positions(frame, positions); !fetched) return fetched;
    const bool is_far = !origin_.isZero();
    for (Vec3f& p : positions) {
        if (is_far) {
            const Vec3d world = origin_ + p.cast<double>();
            p = world.cast<float>();
            lost_ = std::max(lost_, (p.cast<double>() - world).cwiseAbs().maxCoeff());
        }
        if (!p.allFinite())
            return Error{ErrorCode::unsuitable, path_.string() + ": not written: frame " + std::to_string(frame + 1) +
                                                    " is beyond what numbers can hold; deform less."};
    }
    return Success{};
}

MeshAnimation CheckedFrames::animation() {
    MeshAnimation checked = animation_;
    checked.positions = [this](std::size_t frame, std::span<Vec3f> positions) { return fetch(frame, positions); };
    return checked;
}

void CheckedFrames::warn(std::vector<std::string>& warnings) const {
    constexpr double kUnseen = 1e-7; // of the diagonal: what 32 bits lose anyway
    const double diagonal = bounds(animation_.rest->positions).diagonal();
    if (!(lost_ > kUnseen * diagonal)) return;
    char percent[16];
    std::snprintf(percent, sizeof percent, "%.2g", lost_ / diagonal * 100);
    warnings.push_back("The mesh is far from the world's origin, and the format holds 32 bits a coordinate: positions "
                       "are rounded by up to " +
                       std::string(percent) +
                       " % of the mesh's diagonal. USD (.usda) and glTF (.glb) hold where it is in full.");
}

Result<AnimationFormat> animation_format(const fs::path& path) {
    std::error_code ignored;
    const std::string extension = lower_extension(path);
    if ((!path.empty() && !path.has_filename()) || fs::is_directory(path, ignored) || numbered_name(path)) {
        if (!numbered_name(path)) return AnimationFormat::numbered;
        if (const Result<MeshFormat> format = mesh_format(path); !format) return format.error();
        return AnimationFormat::numbered;
    }
    if (extension == ".pc2") return AnimationFormat::pc2;
    if (extension == ".mdd") return AnimationFormat::mdd;
    if (extension == ".usda") return AnimationFormat::usda;
    if (extension == ".glb") return AnimationFormat::glb;
    return Error{ErrorCode::unsupported,
                 path.string() + ": is no name for an animation; " + std::string(kKnownCacheFormats) + "."};
}

bool is_usd(const fs::path& path) {
    const std::string extension = lower_extension(path);
    return extension == ".usda" || extension == ".usd" || extension == ".usdc" || extension == ".usdz";
}

std::optional<Error> alembic_error(const fs::path& path) {
    if (lower_extension(path) != ".abc") return std::nullopt;
    return Error{ErrorCode::unsupported, path.string() +
                                             ": Alembic is not read; in Blender, import it, and export .pc2 "
                                             "or .mdd (add-on NewTek MDD), .usda, or an animated .glb."};
}

namespace {

/// As the file has them.
Result<FrameSource<Pose>> open_unturned(const fs::path& path, std::size_t points, const Vec3d& origin,
                                        const PoseFileOptions& options, const RunContext& context) {
    if (Status sound = check_rate(options); !sound) return sound.error();
    const std::string extension = lower_extension(path);
    if (is_cache(extension)) {
        Result<MeshAnimation> source = open_cache(path, extension, points, options);
        if (!source) return source.error();
        return FrameSource<Pose>{
            source->frames, source->frames_per_second,
            [points, origin, positions = std::move(source->positions)](std::size_t frame) -> Result<Pose> {
                Pose pose;
                pose.positions.resize(points);
                if (Status read = positions(frame, pose.positions); !read) return read.error();
                take_origin_off(pose.positions, origin);
                return pose;
            }};
    }
    if (extension == ".fil") return open_own_poses(path, points, options, context);
    if (extension == ".glb" || extension == ".gltf") {
        if (!numbered_name(path)) return open_gltf_poses(path, points, origin, options, context);
    } else if (is_usd(path) && !numbered_name(path)) {
        return open_usd_poses(path, points, origin, options);
    }
    if (std::optional<Error> error = alembic_error(path)) return *error;
    if (const Result<AnimationFormat> format = animation_format(path); !format) return format.error();
    return open_numbered(path, points, origin, options, context);
}

void turn_pose(Pose& pose, const Vec3d& origin, UpAxis up) {
    turn_up(pose.positions, origin, up);
    const Mat3f turn = turn_of(up).cast<float>();
    for (Mat3f& gradient : pose.gradients) gradient = turn * gradient * turn.transpose();
}

/// Programs with another axis up save their drivers lying on their faces.
Status warn_of_turn(const FrameSource<Pose>& stream, const fs::path& path, const Vec3d& origin,
                    const PoseFileOptions& options) {
    if (!options.warnings || options.rest.empty() || stream.frames == 0 || lower_extension(path) == ".fil")
        return Success{};
    const Result<Pose> first = stream.frame(0);
    if (!first) return first.error();
    if (const std::string turned = turned_first_frame(options.rest, first->positions, origin, path); !turned.empty())
        options.warnings->push_back(turned);
    return Success{};
}

} // namespace

Result<FrameSource<Pose>> open_poses(const fs::path& path, std::size_t points, const Vec3d& origin,
                                     const PoseFileOptions& options, const RunContext& context) {
    Result<FrameSource<Pose>> stream = open_unturned(path, points, origin, options, context);
    if (!stream) return stream;
    if (options.up)
        stream->frame = [pose = std::move(stream->frame), origin, up = *options.up](std::size_t frame) -> Result<Pose> {
            Result<Pose> read = pose(frame);
            if (read) turn_pose(*read, origin, up);
            return read;
        };
    if (Status looked = warn_of_turn(*stream, path, origin, options); !looked) return looked.error();
    return stream;
}

Result<MeshAnimation> open_animation(const fs::path& path, const Mesh& rest, const PoseFileOptions& options,
                                     const RunContext& context) {
    if (Status sound = check_rate(options); !sound) return sound.error();
    const std::string extension = lower_extension(path);
    if (is_cache(extension) && !options.up && !options.warnings) { // without a pose between
        Result<MeshAnimation> source = open_cache(path, extension, rest.vertex_count(), options);
        if (!source) return source.error();
        source->rest = &rest;
        source->positions = [&rest, read = std::move(source->positions)](std::size_t frame,
                                                                         std::span<Vec3f> positions) -> Status {
            if (Status done = read(frame, positions); !done) return done;
            take_origin_off(positions, rest.origin);
            return Success{};
        };
        return source;
    }
    Result<FrameSource<Pose>> stream = open_poses(path, rest.vertex_count(), rest.origin, options, context);
    if (!stream) return stream.error();
    return animation_of(std::move(*stream), rest);
}

Result<std::vector<std::string>> write_animation(const MeshAnimation& animation, const fs::path& path,
                                                 const RunContext& context) {
    const Result<AnimationFormat> format = animation_format(path);
    if (!format) return format.error();
    if (animation.frames == 0)
        return Error{ErrorCode::unsuitable, path.string() + ": not written: there are no frames."};
    std::vector<std::string> warnings;
    const bool holds_origin = *format == AnimationFormat::usda;
    CheckedFrames frames(animation, path, holds_origin ? Vec3d::Zero() : animation.rest->origin);
    Status written = Success{};
    switch (*format) {
    case AnimationFormat::pc2:
        written = write_pc2(frames.animation(), path, context);
        break;
    case AnimationFormat::mdd:
        written = write_mdd(frames.animation(), path, context);
        break;
    case AnimationFormat::usda:
        written = write_usda(frames.animation(), path, warnings, context);
        break;
    case AnimationFormat::glb: {
        Result<ExportReport> report = write_morph_glb(animation, {}, path, context);
        if (!report) return report.error();
        warnings = std::move(report->warnings);
        break;
    }
    case AnimationFormat::numbered:
        return write_numbered_meshes({animation.frames, animation.frames_per_second,
                                      [&](std::size_t frame) { return mesh_at(animation, frame, context); }},
                                     path, context);
    }
    if (!written) return written.error();
    frames.warn(warnings);
    return warnings;
}

} // namespace filigree
