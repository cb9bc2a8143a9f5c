#include "animation_output.h"
#include "coding_report.h"
#include "commands.h"
#include "drawing.h"
#include "drop.h"
#include "live_page.h"
#include "pictures.h"
#include "restore_options.h"
#include "web_page.h"

#include "filigree/file.h"
#include "filigree/io/animation/point_cache.h"
#include "filigree/io/gltf/gltf.h"
#include "filigree/io/model/model_file.h"
#include "filigree/io/system/extension.h"
#include "filigree/io/system/file.h"

#include <filesystem>

#include <fmt/format.h>

namespace filigree::cli {

namespace {

namespace fs = std::filesystem;

struct ExportArguments {
    std::string input, output, poses;
    PoseFileOptions pose_file;
    bool at_rest = false, web = false, stream = false, live = false, no_poster = false;
    std::string title, logo;
    unsigned bits = 14;
    RestoreOptions restore;
    AnimationOutput animation;
};

/// Levels at rest, one beside the other.
void export_levels(const Model& model, const ExportArguments& options, Session& session, Report& report) {
    if (const AnimationFormat format = require(animation_format(path_of(options.output)));
        format != AnimationFormat::glb)
        refuse(ErrorCode::unsuitable,
               options.input + (options.at_rest ? ": a" : ": has no poses, and a") +
                   " model at rest goes to .glb, or with --web to a folder with a page; 'filigree simulate' makes "
                   "poses, and --poses takes another program's.");
    const std::string given = session.first_given(
        {"--as", "--key-rate", "--interpolation", "--influences", "--full-precision", "--compress", "--key-error",
         "--no-normals", "--morph-normals", "--level", "--frame-rate", "--animation", "--pose-up"});
    if (!given.empty())
        refuse(given + " belongs to a model that moves, and " + options.input +
               " is exported at rest; 'filigree level' writes one level of it.");
    session.begin_writing(options.output);
    session.warn(require(write_levels_glb(model, path_of(options.output), path_of(options.input), session.context())));
    const auto bytes = fs::file_size(path_of(options.output));
    report.set("vertices", model.vertex_count());
    report.add("levels", fmt::format("{}, as MSFT_lod", model.finest_level() + 1), "levels", model.finest_level() + 1);
    report.count("bytes", "bytes", bytes);
}

/// A moving file of another program, frame by frame, as another format.
void convert_animation(const Mesh& rest, const ExportArguments& options, Session& session, Report& report) {
    const bool may_move = !options.poses.empty() || lower_extension(path_of(options.input)) == ".glb" ||
                          lower_extension(path_of(options.input)) == ".gltf";
    if (!may_move)
        refuse(ErrorCode::unsuitable, options.input + ": is a mesh that does not move; --poses FILE moves it, and "
                                                      "'filigree strip' makes a model of it.");
    PoseFileOptions matched = options.pose_file;
    std::vector<std::string> warnings;
    if (!options.poses.empty()) { // else the file moves itself
        matched.rest = rest.positions;
        matched.warnings = &warnings;
    }
    const MeshAnimation animation = require(open_animation(
        path_of(options.poses.empty() ? options.input : options.poses), rest, matched, session.context()));
    session.warn(warnings);
    check_animation_options({options.output}, session);
    write_animation_output(animation, options.animation, options.output, options.input, session, report);
}

void export_model(const Model& model, const PoseSequence& own, const ExportArguments& options, Session& session,
                  Report& report) {
    const bool moves = !options.at_rest && (!options.poses.empty() || !own.empty());
    if (!moves) return export_levels(model, options, session, report);
    const FrameSource<Pose> poses = poses_of(options.poses, options.pose_file, model, own, options.input, session);
    if (!options.web) check_animation_options({options.output}, session);
    write_animation_output(model, poses, options.restore, options.animation, options.output, options.input, session,
                           report);
}

/// The model as a coded file that comes level by level, with its poses.
void export_stream(const Model& model, const PoseSequence& own, const ExportArguments& options, Session& session,
                   Report& report) {
    const std::string given = session.first_given({"--as", "--key-rate", "--interpolation", "--influences",
                                                   "--full-precision", "--no-normals", "--morph-normals", "--level"});
    if (!given.empty()) refuse(given + " belongs to pages that play a GLB; leave out --stream.");
    PoseSequence poses;
    if (!options.at_rest && (!options.poses.empty() || !own.empty())) {
        const FrameSource<Pose> from = poses_of(options.poses, options.pose_file, model, own, options.input, session);
        poses.frames_per_second = from.frames_per_second;
        for (std::size_t frame = 0; frame < from.frames; ++frame) poses.frames.push_back(require(from.frame(frame)));
    }
    const std::optional<Model> embedding = with_page_materials(model, options.input, session);
    session.begin_writing(options.output);
    const PackReport coding =
        require(pack_model(embedding ? *embedding : model, poses, {.bits = options.bits, .levels = true},
                           path_of(options.output), session.context()));
    const auto bytes = fs::file_size(path_of(options.output));
    report.set("vertices", model.vertex_count());
    report.count("frames", "frames", poses.frames.size());
    report.count("bytes", "bytes", bytes);
    add_coding_shares(coding.bytes, model.vertex_count(), bytes, report);
    const FileReader file = require(FileReader::open(path_of(options.output)));
    add_stream_marks(require(read_model_outline(file, options.output, session.silent_context())), report);
    if (coding.lacks_level_attributes) session.warn(kLevelsLackAttributes);
}

WebLook look_of(const ExportArguments& options) {
    return {options.title.empty() ? path_of(options.input).stem().string() : options.title, options.logo,
            !options.no_poster && !options.live};
}

/// A folder with a page that plays a GLB as it is, such as the key frames that `simulate` writes of what melts.
void export_glb_page(const ExportArguments& options, const std::string& glb, Session& session, Report& report) {
    if (!glb.starts_with("glTF")) {
        session.parse_mesh(glb, options.input); // says what is wrong with a file that is nothing
        refuse(ErrorCode::unsuitable, options.input + ": is a mesh, and the page shows a model or a GLB; 'filigree "
                                                      "strip' makes a model of it.");
    }
    const std::string given =
        session.first_given({"--poses", "--frame-rate", "--animation", "--rest", "--stream", "--bits", "--as",
                             "--key-rate", "--interpolation", "--influences", "--full-precision", "--all-levels",
                             "--no-normals", "--morph-normals", "--level", "--pose-up"});
    if (!given.empty()) refuse(given + " belongs to a model, and the page plays " + options.input + " as it is.");
    const GltfScene scene = require(GltfScene::read_view(glb, options.input, session.context()));
    if (!scene.files_beside().empty())
        refuse(ErrorCode::unsuitable, options.input + ": needs the file '" + scene.files_beside().front() +
                                          "' beside it, and the page shows a GLB that holds all of its parts.");
    session.warn(scene.warnings());
    OutputFolder folder(path_of(options.output), path_of(options.input));
    WebPage page(folder, look_of(options), WebModel::glb);
    session.begin_writing(options.output);
    require(write_file(path_of(page.model_path()), glb));
    if (!page.poster_path().empty()) draw_poster(scene, page.poster_path(), session);
    page.write(session);
    folder.keep();
    const std::string index = (path_of(options.output) / "index.html").string();
    report.count("bytes", "bytes", glb.size());
    report.add("page", index, "page", index);
}

/// A folder with a page that shows the model.
void export_page(const Model& model, const PoseSequence& own, ExportArguments options, Session& session,
                 Report& report) {
    const std::string folder_name = options.output;
    OutputFolder folder(path_of(folder_name), path_of(options.input));
    folder.protect(animation_files(path_of(options.poses)));
    WebPage page(folder, look_of(options), options.stream ? WebModel::stream : WebModel::glb);
    options.output = page.model_path();
    options.animation.skin.all_levels = true;
    if (options.stream)
        export_stream(model, own, options, session, report);
    else
        export_model(model, own, options, session, report);
    if (!page.poster_path().empty()) {
        const bool moves = !options.at_rest && (!options.poses.empty() || !own.empty());
        draw_poster(model,
                    moves ? poses_of(options.poses, options.pose_file, model, own, options.input, session)
                          : FrameSource<Pose>(),
                    options.input, page.poster_path(), session);
    }
    page.write(session);
    folder.keep();
    const std::string index = (path_of(folder_name) / "index.html").string();
    report.set("output", folder_name);
    report.add("page", index, "page", index);
}

/// A page in which the bodies of a scene move; of a model or a mesh that falls as in `filigree drop`.
void export_live(const ExportArguments& options, Session& session) {
    if (!options.web) refuse("--live belongs to --web.");
    const std::string given =
        session.first_given({"--poses", "--frame-rate", "--animation", "--rest", "--stream", "--bits", "--as",
                             "--key-rate", "--interpolation", "--influences", "--full-precision", "--compress",
                             "--all-levels", "--no-normals", "--morph-normals", "--level", "--pose-up", "--no-poster"});
    if (!given.empty()) refuse(given + " belongs to pages that play a motion; in a page with --live bodies move.");
    const double start = now_seconds();
    Report report;
    report.set("output", options.output);
    if (lower_extension(path_of(options.input)) == ".toml") {
        export_live_page(require(read_scene(options.input)), options.output, options.input, look_of(options), session,
                         report);
    } else {
        const Session::Content content = session.read_any(session.open(options.input), options.input);
        const auto* model = std::get_if<Model>(&content.value);
        const Mesh& mesh = model ? model->mesh : std::get<Mesh>(content.value);
        export_live_page(default_drop_scene(options.input, mesh), options.output, options.input, look_of(options),
                         session, report);
    }
    const double seconds = now_seconds() - start;
    report.add("seconds", fmt::format("{:.3g}", seconds), "export_seconds", seconds);
    session.print(report);
}

void run(const ExportArguments& options, Session& session) {
    if (options.at_rest && !options.poses.empty()) refuse("--rest leaves the poses out that --poses names.");
    if (options.web && options.animation.compress)
        refuse("--compress is for other programs' viewers; --stream makes the page's model small.");
    if (!options.web)
        if (const std::string given = session.first_given({"--title", "--logo", "--no-poster"}); !given.empty())
            refuse(given + " belongs to --web.");
    if (!session.first_given({"--title"}).empty() && options.title.find_first_not_of(" \t\r\n") == std::string::npos)
        refuse("--title: is empty; leave it out for the file's name.");
    if (options.stream && !options.web) refuse("--stream belongs to --web; 'filigree pack' writes a stream alone.");
    if (options.live) return export_live(options, session);
    if (!options.web) {
        check_animation_path(options.output);
        check_not_input(options.output, {options.input, options.poses});
    }
    const FileReader file = session.open(options.input);
    Report report;
    report.set("output", options.output);
    const double start = now_seconds();
    if (options.web && !is_model_file(file)) {
        export_glb_page(options, require(file.read_all()), session, report);
    } else {
        const Session::Content content = session.read_any(file, options.input);
        const auto* model = std::get_if<Model>(&content.value);
        if (options.web)
            export_page(*model, content.poses, options, session, report);
        else if (model)
            export_model(*model, content.poses, options, session, report);
        else
            convert_animation(std::get<Mesh>(content.value), options, session, report);
    }
    const double seconds = now_seconds() - start;
    report.add("seconds", fmt::format("{:.3g}", seconds), "export_seconds", seconds);
    session.print(report);
}

} // namespace

Command export_command() {
    const auto options = std::make_shared<ExportArguments>();
    return {
        .name = "export",
        .text = "Write a model for other programs, moving or at rest",
        .options =
            OptionList{
                Option("file", options->input,
                       "Model, or a mesh that moves (animated glTF, or with --poses); with --live a scene")
                    .is_read()
                    .required(),
                output_option(options->output,
                              "GLB (a skin, or levels at rest), .pc2, .mdd, .usda, a folder (NAME/) or NAME_####.ply"),
                Option("--poses", options->poses,
                       "Motion of the driver (or of the mesh): .pc2, .mdd, numbered meshes, an animated glTF, a model "
                       "(default: the poses in the file)")
                    .is_read()} +
            pose_file_options(options->pose_file) +
            OptionList{
                Option("--rest", options->at_rest, "Write the levels at rest, even if the model has poses"),
                Option("--web", options->web,
                       "Write a folder with a page that shows the model, or a GLB as it is, in a browser; it needs no "
                       "network"),
                Option(
                    "--stream", options->stream,
                    "With --web: pack the model, coarse to fine; the page shows and moves it from its first bytes on"),
                Option("--live", options->live,
                       "With --web: write a page in which the bodies of a scene (.toml) move and can be pulled; a "
                       "model or a mesh falls as in 'filigree drop' (docs/live.md)"),
                Option("--title", options->title, "With --web: heading of the page (default: the file's name)"),
                Option("--logo", options->logo, "With --web: SVG or PNG beside the heading").is_read(),
                Option("--no-poster", options->no_poster,
                       "With --web: no poster.jpg, the picture that is shown while the page loads"),
                Option("--bits", options->bits, "With --stream: bits of a position, along the longest side of the box")
                    .between(10, 16)
                    .with_default()} +
            animation_options(options->animation) + restore_options(options->restore),
        .examples = "  filigree export bounce.fil -o bounce.glb\n"
                    "  filigree export bounce.fil -o bounce.glb --key-rate 30 --interpolation cubic\n"
                    "  filigree export scan.fil --poses driver.pc2 -o scan.pc2\n"
                    "  filigree export scan.fil -o levels.glb\n"
                    "  filigree export bounce.fil -o page/ --web --title \"Spring catalogue\" --logo mark.svg\n"
                    "  filigree export ice.glb -o page/ --web\n"
                    "  filigree export bounce.fil -o page/ --web --stream\n"
                    "  filigree export scene.toml -o page/ --web --live",
        .run = [options](Session& session) { run(*options, session); }};
}

} // namespace filigree::cli
