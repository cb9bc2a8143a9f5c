#include "animation_output.h"
#include "filigree/io/animation/point_cache.h"
#include "filigree/io/system/platform.h"
#include "restore_options.h"

#include <set>

#include <fmt/format.h>

namespace filigree::cli {

namespace {

namespace fs = std::filesystem;

/// Where numbered meshes go: into a folder under the input's name, or as the path says.
std::string numbered_path(const std::string& path, const std::string& input) {
    std::error_code ignored;
    if (!path.ends_with('/') && !fs::is_directory(path_of(path), ignored)) return path;
    return (path_of(path) / path_of(path_of(input).stem().string() + "_####.ply")).string();
}

std::size_t bytes_of_file(const std::string& path) {
    std::error_code failed;
    const auto bytes = fs::file_size(path_of(path), failed);
    return failed ? 0 : bytes;
}

std::string size_text(std::size_t bytes) {
    return bytes < 1'000'000 ? fmt::format("{:.3g} kB", double(bytes) / 1e3)
                             : fmt::format("{:.4g} MB", double(bytes) / 1e6);
}

void report_size(const std::string& path, std::size_t bytes, Report& report) {
    report.add("file", fmt::format("{}, {}", path, size_text(bytes)), "output", path);
    report.set("bytes", bytes);
}

void set_moments(std::size_t frames, double rate, Report& report) {
    report.set("frames", frames);
    report.set("frames_per_second", rate);
}

void report_frames(std::size_t frames, double rate, std::size_t vertices, Report& report) {
    report.row("frames", fmt::format("{} at {:.6g} a second, {} vertices each", with_commas(frames), rate,
                                     with_commas(vertices)));
    set_moments(frames, rate, report);
    report.set("vertices", vertices);
}

std::string error_text(const ExportReport& exported, bool is_skin) {
    std::string error = fmt::format("the farthest vertex is off by {:.1e} of the diagonal at keys (rms {:.1e})",
                                    exported.error_at_keys, exported.rms_at_keys);
    if (is_skin)
        error += fmt::format(", by {:.1e} between keys (rms {:.1e})", exported.error_between_keys,
                             exported.rms_between_keys);
    return fmt::format("{}; {} of {} moments measured", error, with_commas(exported.moments_checked),
                       with_commas(exported.moments));
}

/// Whom the file's normals show wrong, and what to do; nothing below a few degrees, which nobody sees.
std::string normals_text(double degrees) {
    constexpr double kSeen = 5;
    if (degrees < kSeen) return "right in three.js; in Blender, import with Shading: Smooth";
    return fmt::format("turned too far in three.js where the mesh stretches: by less than {:.3g} degrees "
                       "at 95 % of the driver. --no-normals shades flat and right; docs/exchange.md has a line for "
                       "three.js. In Blender, import with Shading: Smooth",
                       degrees);
}

/// What an export as skin or morph targets came to.
void report_export(const ExportReport& exported, bool is_skin, bool has_normals, const std::string& path,
                   Report& report) {
    report_size(path, exported.bytes, report);
    report.add(is_skin ? "skin" : "morph targets",
               is_skin ? fmt::format("{} vertices, {} joints, {} keys in {:.4g} s", with_commas(exported.vertices),
                                     with_commas(exported.joints), with_commas(exported.keys), exported.seconds)
                       : fmt::format("{} of {} vertices in {:.4g} s", with_commas(exported.keys),
                                     with_commas(exported.vertices), exported.seconds),
               "as", is_skin ? "skin" : "morph");
    if (exported.moments_checked > 0) report.row("error of the file", error_text(exported, is_skin));
    if (has_normals && exported.normal_error_degrees > 0)
        report.row("normals", normals_text(exported.normal_error_degrees));
    report.set("vertices", exported.vertices);
    report.set("joints", exported.joints);
    report.set("keys", exported.keys);
    report.set("seconds", exported.seconds);
    report.set("error_at_keys", exported.error_at_keys);
    report.set("error_between_keys", exported.error_between_keys);
    report.set("rms_at_keys", exported.rms_at_keys);
    report.set("rms_between_keys", exported.rms_between_keys);
    report.set("moments_checked", exported.moments_checked);
    report.set("normal_error_degrees", exported.normal_error_degrees);
}

/// A model's poses as the restored level moves.
MeshAnimation restored_animation(const Restorer& restorer, const FrameSource<Pose>& poses, const Mesh& rest,
                                 const RunContext& silent) {
    return {&rest, poses.frames, poses.frames_per_second,
            [&restorer, &poses, &silent](std::size_t frame, std::span<Vec3f> positions) -> Status {
                const Result<Pose> pose = poses.frame(frame);
                if (!pose) return pose.error();
                return restorer.positions(*pose, positions, silent);
            },
            poses.metres_per_unit};
}

void write_numbered(const Restorer& restorer, const FrameSource<Pose>& poses, const std::string& path,
                    const std::string& input, const RunContext& silent, Session& session) {
    const auto mesh = [&](std::size_t frame) -> Result<Mesh> {
        const Result<Pose> pose = poses.frame(frame);
        if (!pose) return pose.error();
        return restorer.mesh(*pose, silent);
    };
    session.warn(require(write_numbered_meshes({poses.frames, poses.frames_per_second, mesh},
                                               path_of(numbered_path(path, input)), session.context())));
}

} // namespace

OptionList animation_options(AnimationOutput& output) {
    return {
        choice<GlbMotion>("--as", output.glb, {{"skin", GlbMotion::skin}, {"morph", GlbMotion::morph}},
                          "GLB: skin (a joint for each driver vertex) or morph (morph targets: the positions of every "
                          "frame). Default: skin for a model, morph for a mesh"),
        Option("--key-rate", output.skin.key_rate,
               "Skin: keys per second (default: one per frame; for bodies that melt: 10)")
            .above_zero(),
        choice<KeyInterpolation>(
            "--interpolation", output.skin.interpolation,
            {{"linear", KeyInterpolation::linear}, {"cubic", KeyInterpolation::cubic}},
            "Skin: interpolation between keys (default: linear). Cubic needs fewer keys; Blender ignores it"),
        choice<unsigned>("--influences", output.skin.influences, {{"3", 3U}, {"6", 6U}},
                         "Skin: joints per vertex (default: 3, for every viewer). 6 is for Blender: the file then has "
                         "the true rest shape"),
        Option("--full-precision", output.skin.full_precision,
               "Skin: rotations and weights as floats, not as 16-bit numbers"),
        Option("--compress", output.compress,
               "GLB: packed for the web; the viewer needs EXT_meshopt_compression and KHR_mesh_quantization"),
        Option("--key-error", output.key_error,
               "Skin with --compress: how far rounded and fewer keys may move a vertex at a key, fraction of the "
               "diagonal (default: 1e-05; fit: its rms error)")
            .between(1e-9, 0.1),
        Option("--all-levels", output.skin.all_levels, "Skin: also write the coarser levels (MSFT_lod)"),
        Option("--no-normals", output.no_normals,
               "GLB: write no normals. Viewers then shade flat, which is right under stretch too"),
        Option("--morph-normals", output.morph.morph_normals, "Morph targets: also write the normals of every frame")};
}

std::string given_animation_option(const Session& session) {
    return session.first_given({"--as", "--key-rate", "--interpolation", "--influences", "--full-precision",
                                "--all-levels", "--compress", "--key-error", "--no-normals", "--morph-normals"});
}

bool is_animation_path(const std::string& path) { return animation_format(path_of(path)).ok(); }

void check_animation_path(const std::string& path) {
    if (path == "-") refuse("An animation cannot go to standard output; give -o a file or a folder.");
    if (require(animation_format(path_of(path))) != AnimationFormat::numbered) check_folder_of(path);
}

void check_animation_options(const std::vector<std::string>& paths, const Session& session) {
    const auto is_glb = [](const std::string& path) {
        const Result<AnimationFormat> format = animation_format(path_of(path));
        return format && *format == AnimationFormat::glb;
    };
    const std::string given = given_animation_option(session);
    if (!given.empty() && std::none_of(paths.begin(), paths.end(), is_glb))
        refuse(given + " belongs to an animation that goes to a .glb.");
    if (!session.first_given({"--key-error"}).empty() && session.first_given({"--compress"}).empty())
        refuse("--key-error belongs to --compress.");
}

void check_not_input(const std::string& output, const std::vector<std::string>& inputs) {
    std::set<std::pair<std::uint64_t, std::uint64_t>> taken; // whatever names lead there
    const auto file_of = [](const fs::path& path) -> std::optional<std::pair<std::uint64_t, std::uint64_t>> {
        const std::optional<platform::Status> status = platform::status_of(path);
        if (!status) return {};
        return std::pair(status->device, status->number);
    };
    for (const std::string& input : inputs)
        for (const fs::path& path : animation_files(path_of(input)))
            if (const auto file = file_of(path)) taken.insert(*file);
    for (const fs::path& path : animation_files(path_of(numbered_path(output, inputs.front())))) {
        const auto file = file_of(path);
        if (file && taken.contains(*file))
            refuse(path.string() + ": is the input and would be overwritten; choose another place with -o.");
    }
}

Option pose_up_option(PoseFileOptions& options) {
    return choice<UpAxis>("--pose-up", options.up, {{"y", UpAxis::y}, {"z", UpAxis::z}},
                          "Up axis of the pose file, if it is not the model's; the poses are turned");
}

OptionList pose_file_options(PoseFileOptions& options) {
    return {Option("--frame-rate", options.frames_per_second,
                   "Frames per second (default: that of the file; 60 for .pc2, .glb and numbered meshes)")
                .above_zero(),
            Option("--animation", options.animation, "Name of the animation in a .glb (default: the first)"),
            pose_up_option(options)};
}

FrameSource<Pose> poses_of(const std::string& poses, const PoseFileOptions& options, const Model& model,
                           const PoseSequence& own, const std::string& model_path, Session& session) {
    if (!poses.empty()) {
        const std::vector<Vec3f> rest = driver_positions(model);
        std::vector<std::string> warnings;
        PoseFileOptions matched = options;
        matched.rest = rest;
        matched.warnings = &warnings;
        FrameSource<Pose> stream =
            require(open_poses(path_of(poses), rest.size(), model.mesh.origin, matched, session.context()));
        session.warn(warnings);
        return stream;
    }
    if (!options.animation.empty()) refuse("--animation belongs to --poses.");
    own_pose(own, 1, model_path);
    FrameSource<Pose> stream = frames_of(own);
    stream.frames_per_second = options.frames_per_second.value_or(own.frames_per_second);
    return stream;
}

ChunkReport write_chunk_output(const Model& model, const FrameSource<Pose>& poses, const RestoreOptions& restore,
                               const WorkChunk& chunk, const std::string& path, Session& session) {
    const Restorer restorer = require(Restorer::create(model, restore, session.context()));
    const Mesh rest = level_mesh(model, require(restored_level(model, restore)));
    session.begin_writing(path);
    return require(write_animation_chunk(restored_animation(restorer, poses, rest, session.silent_context()),
                                         path_of(path), chunk, session.context()));
}

void write_chunks_output(const ModelChunks& model, const FrameSource<Pose>& poses, const RestoreOptions& restore,
                         const std::string& path, Session& session, Report& report) {
    session.begin_writing(path);
    session.warn(require(write_restored_chunks(model, poses, restore, path_of(path), session.context())));
    report_size(path, bytes_of_file(path), report);
    report_frames(poses.frames, poses.frames_per_second, model.vertex_count(), report);
}

void write_animation_output(const Model& model, const FrameSource<Pose>& poses, const RestoreOptions& restore,
                            const AnimationOutput& output, const std::string& path, const std::string& materials_beside,
                            Session& session, Report& report) {
    const AnimationFormat format = require(animation_format(path_of(path)));
    const bool makes_skin = output.glb != GlbMotion::morph;
    if (format == AnimationFormat::glb && makes_skin) {
        SkinOptions options = output.skin;
        if (output.no_normals) options.normals = ExportNormals::leave;
        options.compress = output.compress;
        options.key_error = output.key_error.value_or(options.key_error);
        options.restore = restore;
        options.materials_beside = path_of(materials_beside);
        session.begin_writing(path);
        const ExportReport exported = require(write_skin_glb(model, poses, options, path_of(path), session.context()));
        session.warn(exported.warnings);
        report_export(exported, true, !output.no_normals, path, report);
        set_moments(poses.frames, poses.frames_per_second, report);
        return;
    }
    const Restorer restorer = require(Restorer::create(model, restore, session.context()));
    const RunContext silent = session.silent_context(); // the bar tells of frames
    if (format == AnimationFormat::numbered) {
        session.begin_writing(path);
        write_numbered(restorer, poses, path, materials_beside, silent, session);
        report.set("output", path);
        report_frames(poses.frames, poses.frames_per_second, restorer.vertex_count(), report);
        return;
    }
    const Mesh rest = level_mesh(model, require(restored_level(model, restore)));
    write_animation_output(restored_animation(restorer, poses, rest, silent), output, path, materials_beside, session,
                           report);
}

void write_animation_output(const MeshAnimation& animation, const AnimationOutput& output, const std::string& path,
                            const std::string& materials_beside, Session& session, Report& report) {
    const AnimationFormat format = require(animation_format(path_of(path)));
    session.begin_writing(path);
    if (format == AnimationFormat::glb) {
        if (output.glb == GlbMotion::skin)
            refuse(ErrorCode::unsuitable, path + ": a skin needs a model ('filigree strip' makes one); leave "
                                                 "out --as skin for morph targets.");
        MorphOptions options = output.morph;
        if (output.no_normals) options.normals = ExportNormals::leave;
        options.compress = output.compress;
        options.materials_beside = path_of(materials_beside);
        const ExportReport exported = require(write_morph_glb(animation, options, path_of(path), session.context()));
        session.warn(exported.warnings);
        report_export(exported, false, !output.no_normals, path, report);
        set_moments(animation.frames, animation.frames_per_second, report);
        return;
    }
    const std::string place = format == AnimationFormat::numbered ? numbered_path(path, materials_beside) : path;
    session.warn(require(write_animation(animation, path_of(place), session.context())));
    if (format == AnimationFormat::numbered)
        report.set("output", path);
    else
        report_size(path, bytes_of_file(path), report);
    report_frames(animation.frames, animation.frames_per_second, animation.rest->vertex_count(), report);
}

} // namespace filigree::cli
