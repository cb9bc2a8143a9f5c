#include "animation_output.h"

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

void add_frames(std::size_t frames, double rate, std::size_t vertices, Table& table, Json& json) {
    table.row("frames",
              fmt::format("{} at {:.6g} a second, {} vertices each", with_commas(frames), rate, with_commas(vertices)));
    json["frames"] = frames;
    json["frames_per_second"] = rate;
    json["vertices"] = vertices;
}

/// What an export as skin or morph targets came to.
void add_report(const ExportReport& report, bool is_skin, const std::string& path, Session& session, Table& table,
                Json& json) {
    for (const std::string& warning : report.warnings) session.warn(warning);
    add_size(path, report.bytes, table, json);
    table.row(is_skin ? "skin" : "morph targets",
              is_skin ? fmt::format("{} vertices, {} joints, {} keys in {:.4g} s", with_commas(report.vertices),
                                    with_commas(report.joints), with_commas(report.keys), report.seconds)
                      : fmt::format("{} of {} vertices in {:.4g} s", with_commas(report.keys),
                                    with_commas(report.vertices), report.seconds));
    if (report.moments_checked > 0)
        table.row("error of the file", fmt::format("{:.1e} of the diagonal at keys (rms {:.1e}), {:.1e} between them "
                                                   "(rms {:.1e}); {} moments evaluated",
                                                   report.error_at_keys, report.rms_at_keys, report.error_between_keys,
                                                   report.rms_between_keys, with_commas(report.moments_checked)));
    if (report.normal_error_degrees > 0)
        table.row("normals", fmt::format("up to {:.3g} degrees off (95th percentile) in viewers that turn them with "
                                         "the skin's matrix, such as three.js",
                                         report.normal_error_degrees));
    json["as"] = is_skin ? "skin" : "morph";
    json["vertices"] = report.vertices;
    json["joints"] = report.joints;
    json["keys"] = report.keys;
    json["seconds_long"] = report.seconds;
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
    const auto set_normals = [&output](ExportNormals normals) { output.skin.normals = output.morph.normals = normals; };
    add_choice<bool>(
        command, "--as", {{"skin", false}, {"morph", true}},
        [&output](bool as_morph) {
            output.as_morph = as_morph;
            output.as_skin = !as_morph;
        },
        "GLB: a skin, one joint a driver vertex, or morph targets, every frame's positions (unset: a skin where the "
        "model's code makes one)");
    command
        .add_option_function<double>(
            "--key-rate", [&output](const double& rate) { output.skin.key_rate = rate; },
            "Skin: keys a second (unset: one a frame)")
        ->check(positive_number());
    add_choice<KeyInterpolation>(
        command, "--interpolation", {{"linear", KeyInterpolation::linear}, {"cubic", KeyInterpolation::cubic}},
        [&output](KeyInterpolation interpolation) { output.skin.interpolation = interpolation; },
        "Skin: between keys (unset: linear; cubic needs fewer keys, but Blender ignores it)");
    add_choice<unsigned>(
        command, "--influences", {{"3", 3U}, {"6", 6U}},
        [&output](unsigned influences) { output.skin.influences = influences; },
        "Skin: joints a vertex (unset: 3, which plays in everything; 6 shows Blender the true rest shape)");
    command.add_flag("--full-precision", output.skin.full_precision, "Skin: float rotations and weights");
    command.add_flag("--all-levels", output.skin.all_levels, "Skin: coarser levels too (MSFT_lod)");
    command.add_flag_callback(
        "--no-normals", [set_normals] { set_normals(ExportNormals::leave); },
        "GLB: leave normals out; viewers then shade flat, which is right under any stretch");
    command.add_flag("--morph-normals", output.morph.morph_normals, "Morph targets: normals of each frame too");
}

bool is_animation_path(const std::string& path) { return animation_format(path).ok(); }

void check_animation_path(const std::string& path) {
    const AnimationFormat format = require(animation_format(path));
    std::error_code ignored;
    const fs::path folder = fs::path(path).parent_path();
    if (format != AnimationFormat::numbered && !folder.empty() && !fs::is_directory(folder, ignored))
        throw Failure{{ErrorCode::unwritable, path + ": cannot be written: there is no such folder."}};
}

void check_not_input(const std::string& output, const std::vector<std::string>& inputs) {
    std::error_code failed;
    for (const std::string& input : inputs) {
        const bool is_one = fs::equivalent(output, input, failed) && !failed;
        if (is_one || (!input.empty() && fs::path(output) == fs::path(input)))
            throw Failure{{ErrorCode::usage, output + ": is the input and would be overwritten; choose another with "
                                                      "-o."}};
    }
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
        add_report(require(write_skin_glb(model, poses, options, path, session.context())), true, path, session, table,
                   json);
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
        add_report(require(write_morph_glb(animation, options, path, session.context())), false, path, session, table,
                   json);
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
