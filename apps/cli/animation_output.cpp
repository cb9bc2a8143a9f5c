#include "animation_output.h"
#include "restore_options.h"

#include <set>

#include <sys/stat.h>

namespace filigree::cli {

namespace {

namespace fs = std::filesystem;

/// Where numbered meshes go: into a folder under the input's name, or as the path says.
std::string numbered_path(const std::string& path, const std::string& input) {
    std::error_code ignored;
    if (!path.ends_with('/') && !fs::is_directory(path, ignored)) return path;
    return (fs::path(path) / (fs::path(input).stem().string() + "_####.ply")).string();
}

std::size_t bytes_of_file(const std::string& path) {
    std::error_code failed;
    const auto bytes = fs::file_size(path, failed);
    return failed ? 0 : bytes;
}

std::string size_text(std::size_t bytes) {
    return bytes < 1'000'000 ? fmt::format("{:.3g} kB", double(bytes) / 1e3)
                             : fmt::format("{:.4g} MB", double(bytes) / 1e6);
}

void add_size(const std::string& path, std::size_t bytes, Table& table, Json& json) {
    table.row("file", fmt::format("{}, {}", path, size_text(bytes)));
    json["output"] = path;
    json["bytes"] = bytes;
}

void add_moments(std::size_t frames, double rate, Json& json) {
    json["frames"] = frames;
    json["frames_per_second"] = rate;
}

void add_frames(std::size_t frames, double rate, std::size_t vertices, Table& table, Json& json) {
    table.row("frames",
              fmt::format("{} at {:.6g} a second, {} vertices each", with_commas(frames), rate, with_commas(vertices)));
    add_moments(frames, rate, json);
    json["vertices"] = vertices;
}

/// What an export as skin or morph targets came to.
void add_report(const ExportReport& report, bool is_skin, bool has_normals, const std::string& path, Session& session,
                Table& table, Json& json) {
    constexpr double kSeen = 10; // degrees
    for (const std::string& warning : report.warnings) session.warn(warning);
    if (has_normals && report.normal_error_degrees > kSeen)
        session.warn(fmt::format("{}: normals are up to {:.0f} degrees off in viewers that do not correct them "
                                 "(three.js): --no-normals makes them flat and right; see docs/exchange.md.",
                                 path, report.normal_error_degrees));
    add_size(path, report.bytes, table, json);
    table.row(is_skin ? "skin" : "morph targets",
              is_skin ? fmt::format("{} vertices, {} joints, {} keys in {:.4g} s", with_commas(report.vertices),
                                    with_commas(report.joints), with_commas(report.keys), report.seconds)
                      : fmt::format("{} of {} vertices in {:.4g} s", with_commas(report.keys),
                                    with_commas(report.vertices), report.seconds));
    std::string error =
        fmt::format("{:.1e} of the diagonal at keys (rms {:.1e})", report.error_at_keys, report.rms_at_keys);
    if (is_skin)
        error += fmt::format(", {:.1e} between them (rms {:.1e})", report.error_between_keys, report.rms_between_keys);
    if (report.moments_checked > 0)
        table.row("error of the file", fmt::format("{}; {} of {} moments evaluated", error,
                                                   with_commas(report.moments_checked), with_commas(report.moments)));
    if (has_normals && report.normal_error_degrees > 0)
        table.row("normals", fmt::format("up to {:.3g} degrees off (95th percentile) in viewers that turn them with "
                                         "the skin's matrix, such as three.js",
                                         report.normal_error_degrees));
    json["as"] = is_skin ? "skin" : "morph";
    json["vertices"] = report.vertices;
    json["joints"] = report.joints;
    json["keys"] = report.keys;
    json["seconds"] = report.seconds;
    json["error_at_keys"] = report.error_at_keys;
    json["error_between_keys"] = report.error_between_keys;
    json["rms_at_keys"] = report.rms_at_keys;
    json["rms_between_keys"] = report.rms_between_keys;
    json["moments_checked"] = report.moments_checked;
    json["normal_error_degrees"] = report.normal_error_degrees;
}

/// A model's poses as the restored level moves.
MeshAnimation restored_animation(const Restorer& restorer, const PoseStream& poses, const Mesh& rest,
                                 const RunContext& silent) {
    return {&rest, poses.frames, poses.frames_per_second,
            [&restorer, &poses, &silent](std::size_t frame, std::span<Vec3f> positions) -> Status {
                const Result<Pose> pose = poses.pose(frame);
                if (!pose) return pose.error();
                return restorer.positions(*pose, positions, silent);
            }};
}

void write_numbered(const Restorer& restorer, const PoseStream& poses, const std::string& path,
                    const std::string& input, const RunContext& silent, Session& session) {
    const auto mesh = [&](std::size_t frame) -> Result<Mesh> {
        const Result<Pose> pose = poses.pose(frame);
        if (!pose) return pose.error();
        return restorer.mesh(*pose, silent);
    };
    for (const std::string& warning :
         require(write_numbered_meshes(poses.frames, mesh, numbered_path(path, input), session.context())))
        session.warn(warning);
}

} // namespace

void add_animation_options(CLI::App& command, AnimationOutput& output) {
    const auto given = [&output](const char* name) { output.given.emplace_back(name); };
    const auto add_flag = [&](const char* name, const std::function<void()>& set, const char* text) {
        command.add_flag_callback(
            name,
            [given, name, set] {
                given(name);
                set();
            },
            text);
    };
    add_choice<bool>(
        command, "--as", {{"skin", false}, {"morph", true}},
        [&output, given](bool as_morph) {
            given("--as");
            output.as_morph = as_morph;
            output.as_skin = !as_morph;
        },
        "GLB: a skin, one joint a driver vertex, or morph targets, every frame's positions (unset: a skin where the "
        "model's code makes one)");
    command
        .add_option_function<double>(
            "--key-rate",
            [&output, given](const double& rate) {
                given("--key-rate");
                output.skin.key_rate = rate;
            },
            "Skin: keys a second (unset: one a frame)")
        ->check(positive_number());
    add_choice<KeyInterpolation>(
        command, "--interpolation", {{"linear", KeyInterpolation::linear}, {"cubic", KeyInterpolation::cubic}},
        [&output, given](KeyInterpolation interpolation) {
            given("--interpolation");
            output.skin.interpolation = interpolation;
        },
        "Skin: between keys (unset: linear; cubic needs fewer keys, but Blender ignores it)");
    add_choice<unsigned>(
        command, "--influences", {{"3", 3U}, {"6", 6U}},
        [&output, given](unsigned influences) {
            given("--influences");
            output.skin.influences = influences;
        },
        "Skin: joints a vertex (unset: 3, which plays in everything; 6 shows Blender the true rest shape)");
    add_flag(
        "--full-precision", [&output] { output.skin.full_precision = true; }, "Skin: float rotations and weights");
    add_flag(
        "--all-levels", [&output] { output.skin.all_levels = true; }, "Skin: coarser levels too (MSFT_lod)");
    add_flag(
        "--no-normals", [&output] { output.skin.normals = output.morph.normals = ExportNormals::leave; },
        "GLB: leave normals out; viewers then shade flat, which is right under any stretch");
    add_flag(
        "--morph-normals", [&output] { output.morph.morph_normals = true; },
        "Morph targets: normals of each frame too");
}

bool is_animation_path(const std::string& path) { return animation_format(path).ok(); }

void check_animation_path(const std::string& path) {
    if (path == "-")
        throw Failure{{ErrorCode::usage, "An animation cannot go to standard output; give -o a file or a folder."}};
    const AnimationFormat format = require(animation_format(path));
    std::error_code ignored;
    const fs::path folder = fs::path(path).parent_path();
    if (format != AnimationFormat::numbered && !folder.empty() && !fs::is_directory(folder, ignored))
        throw Failure{{ErrorCode::unwritable, path + ": cannot be written: there is no such folder."}};
}

void check_animation_options(const AnimationOutput& output, const std::vector<std::string>& paths) {
    const auto is_glb = [](const std::string& path) {
        const Result<AnimationFormat> format = animation_format(path);
        return format && *format == AnimationFormat::glb;
    };
    if (!output.given.empty() && std::none_of(paths.begin(), paths.end(), is_glb))
        throw Failure{{ErrorCode::usage, output.given.front() + " belongs to an animation that goes to a .glb."}};
}

void check_not_input(const std::string& output, const std::vector<std::string>& inputs) {
    std::set<std::pair<dev_t, ino_t>> taken; // whatever names lead there
    const auto file_of = [](const fs::path& path) -> std::optional<std::pair<dev_t, ino_t>> {
        struct stat status {};
        if (::stat(path.c_str(), &status) != 0) return {};
        return std::pair(status.st_dev, status.st_ino);
    };
    for (const std::string& input : inputs)
        for (const fs::path& path : animation_files(input))
            if (const auto file = file_of(path)) taken.insert(*file);
    for (const fs::path& path : animation_files(numbered_path(output, inputs.front()))) {
        const auto file = file_of(path);
        if (file && taken.contains(*file))
            throw Failure{{ErrorCode::usage,
                           path.string() + ": is the input and would be overwritten; choose another place with -o."}};
    }
}

void add_pose_file_options(CLI::App& command, PoseFileOptions& options) {
    command
        .add_option_function<double>(
            "--frame-rate", [&options](const double& rate) { options.frames_per_second = rate; },
            "Frames a second (unset: as the file says; 60 for .pc2 and numbered meshes)")
        ->check(positive_number());
    command.add_option("--animation", options.animation, "Of a .glb with several (unset: the first)");
}

PoseStream poses_of(const std::string& poses, const PoseFileOptions& options, const Model& model,
                    const PoseSequence& own, const std::string& model_path, Session& session) {
    if (!poses.empty())
        return require(
            open_poses(poses, model.driver().vertices.size(), model.mesh.origin, options, session.context()));
    if (!options.animation.empty()) throw Failure{{ErrorCode::usage, "--animation belongs to --poses."}};
    own_pose(own, 1, model_path);
    PoseStream stream = stream_of(own);
    stream.frames_per_second = options.frames_per_second.value_or(own.frames_per_second);
    return stream;
}

void write_animation_output(const Model& model, const PoseStream& poses, const RestoreOptions& restore,
                            const AnimationOutput& output, const std::string& path, const std::string& materials_beside,
                            Session& session, Table& table, Json& json) {
    const AnimationFormat format = require(animation_format(path));
    const bool is_skin =
        format == AnimationFormat::glb && !output.as_morph && (output.as_skin || model.code() == DetailCode::blend);
    if (is_skin) {
        SkinOptions options = output.skin;
        options.restore = restore;
        options.materials_beside = materials_beside;
        session.begin_writing(path);
        add_report(require(write_skin_glb(model, poses, options, path, session.context())), true,
                   options.normals != ExportNormals::leave, path, session, table, json);
        add_moments(poses.frames, poses.frames_per_second, json);
        return;
    }
    const Restorer restorer = require(Restorer::create(model, restore, session.context()));
    RunContext silent = session.context(); // the bar tells of frames
    silent.progress = nullptr;
    if (format == AnimationFormat::numbered) {
        session.begin_writing(path);
        write_numbered(restorer, poses, path, materials_beside, silent, session);
        json["output"] = path;
        add_frames(poses.frames, poses.frames_per_second, restorer.vertex_count(), table, json);
        return;
    }
    const Mesh rest = level_mesh(model, require(restored_level(model, restore)));
    write_animation_output(restored_animation(restorer, poses, rest, silent), output, path, materials_beside, session,
                           table, json);
}

void write_animation_output(const MeshAnimation& animation, const AnimationOutput& output, const std::string& path,
                            const std::string& materials_beside, Session& session, Table& table, Json& json) {
    const AnimationFormat format = require(animation_format(path));
    session.begin_writing(path);
    if (format == AnimationFormat::glb) {
        if (output.as_skin)
            throw Failure{{ErrorCode::unsuitable, path + ": a skin needs a model ('filigree strip' makes one); leave "
                                                         "out --as skin for morph targets."}};
        MorphOptions options = output.morph;
        options.materials_beside = materials_beside;
        add_report(require(write_morph_glb(animation, options, path, session.context())), false,
                   options.normals != ExportNormals::leave, path, session, table, json);
        add_moments(animation.frames, animation.frames_per_second, json);
        return;
    }
    const std::string place = format == AnimationFormat::numbered ? numbered_path(path, materials_beside) : path;
    for (const std::string& warning : require(write_animation(animation, place, session.context())))
        session.warn(warning);
    if (format == AnimationFormat::numbered)
        json["output"] = path;
    else
        add_size(path, bytes_of_file(path), table, json);
    add_frames(animation.frames, animation.frames_per_second, animation.rest->vertex_count(), table, json);
}

} // namespace filigree::cli
