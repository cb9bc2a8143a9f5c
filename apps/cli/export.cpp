#include "animation_output.h"
#include "restore_options.h"
#include "stage.h"
#include "web_page.h"

#include "filigree/io/gltf_export.h"

#include <filesystem>

namespace filigree::cli {

namespace {

namespace fs = std::filesystem;

struct Options {
    std::string input, output, poses;
    PoseFileOptions pose_file;
    bool at_rest = false, web = false;
    RestoreOptions restore;
    AnimationOutput animation;
    std::vector<std::string> moving; ///< options given that a model at rest has no use for
};

[[noreturn]] void refuse(ErrorCode code, const std::string& sentence) { throw Failure{{code, sentence}}; }

/// Levels at rest, one beside the other.
void export_levels(const Model& model, const Options& options, Session& session, Table& table, Json& json) {
    if (const AnimationFormat format = require(animation_format(options.output)); format != AnimationFormat::glb)
        refuse(ErrorCode::unsuitable,
               options.input + (options.at_rest ? ": a" : ": has no poses, and a") +
                   " model at rest goes to .glb, or with --web to a folder with a page; 'filigree simulate' makes "
                   "poses, and --poses takes another program's.");
    if (!options.moving.empty())
        refuse(ErrorCode::usage, options.moving.front() + " belongs to a model that moves, and " + options.input +
                                     " is exported at rest; 'filigree level' writes one level of it.");
    session.begin_writing(options.output);
    for (const std::string& warning :
         require(write_levels_glb(model, options.output, options.input, session.context())))
        session.warn(warning);
    const auto bytes = fs::file_size(options.output);
    table.row("levels", fmt::format("{}, as MSFT_lod", model.finest_level() + 1));
    table.row("bytes", with_commas(bytes));
    json["vertices"] = model.mesh.vertex_count();
    json["levels"] = model.finest_level() + 1;
    json["bytes"] = bytes;
}

/// A moving file of another program, frame by frame, as another format.
void convert_animation(const Mesh& rest, const Options& options, Session& session, Table& table, Json& json) {
    const bool may_move =
        !options.poses.empty() || lower_ending(options.input) == ".glb" || lower_ending(options.input) == ".gltf";
    if (!may_move)
        refuse(ErrorCode::unsuitable, options.input + ": is a mesh that does not move; --poses FILE moves it, and "
                                                      "'filigree strip' makes a model of it.");
    const MeshAnimation animation = require(open_animation(options.poses.empty() ? options.input : options.poses, rest,
                                                           options.pose_file, session.context()));
    check_animation_options(options.animation, {options.output});
    write_animation_output(animation, options.animation, options.output, options.input, session, table, json);
}

void export_model(const Model& model, const PoseSequence& own, const Options& options, Session& session, Table& table,
                  Json& json) {
    const bool moves = !options.at_rest && (!options.poses.empty() || !own.empty());
    if (!moves) return export_levels(model, options, session, table, json);
    const PoseStream poses = poses_of(options.poses, options.pose_file, model, own, options.input, session);
    if (!options.web) check_animation_options(options.animation, {options.output});
    write_animation_output(model, poses, options.restore, options.animation, options.output, options.input, session,
                           table, json);
}

/// A folder with a page that shows the model.
void export_page(const Model& model, const PoseSequence& own, Options options, Session& session, Table& table,
                 Json& json) {
    const std::string folder_name = options.output;
    OutputFolder folder(folder_name, options.input);
    folder.protect(animation_files(options.poses));
    WebPage page(folder, fs::path(options.input).stem().string());
    options.output = page.model_path();
    options.animation.skin.all_levels = true;
    if (model.code() == DetailCode::reference) options.animation.as_morph = true;
    export_model(model, own, options, session, table, json);
    page.write(session);
    folder.keep();
    table.row("page", (fs::path(folder_name) / "index.html").string());
    json["output"] = folder_name;
    json["page"] = (fs::path(folder_name) / "index.html").string();
}

void run(const Options& options, Session& session) {
    if (options.at_rest && !options.poses.empty())
        refuse(ErrorCode::usage, "--rest leaves the poses out that --poses names.");
    if (!options.web) {
        check_animation_path(options.output);
        check_not_input(options.output, {options.input, options.poses});
    }
    const Session::Content content = session.read_any(options.input);
    Table table;
    Json json = {{"output", options.output}};
    const double start = now_seconds();
    const auto* model = std::get_if<Model>(&content.value);
    if (options.web && !model)
        refuse(ErrorCode::unsuitable,
               options.input + ": is a mesh, and the page shows a model; 'filigree strip' makes one.");
    if (options.web)
        export_page(*model, content.poses, options, session, table, json);
    else if (model)
        export_model(*model, content.poses, options, session, table, json);
    else
        convert_animation(std::get<Mesh>(content.value), options, session, table, json);
    const double seconds = now_seconds() - start;
    table.row("seconds", fmt::format("{:.3g}", seconds));
    json["export_seconds"] = seconds;
    session.print(table.text(), json);
}

} // namespace

void add_export(CLI::App& app, Session& session) {
    auto options = std::make_shared<Options>();
    CLI::App* command = app.add_subcommand("export", "Write a model, moving or at rest, for other programs");
    command->add_option("file", options->input, "Model, or a mesh that moves (animated glTF, or with --poses)")
        ->required();
    command
        ->add_option("-o,--output", options->output,
                     "GLB (a skin, or levels at rest), .pc2, .mdd, .usda, a folder (NAME/) or NAME_####.ply")
        ->required();
    command->add_option("--poses", options->poses,
                        "What moves the driver (or the mesh): .pc2, .mdd, numbered meshes, an animated glTF, a model; "
                        "unset: the file's own poses");
    add_pose_file_options(*command, options->pose_file);
    command->add_flag("--rest", options->at_rest, "The levels at rest, though the model has poses");
    command->add_flag("--web", options->web, "A folder that shows the model in a browser, without a network");
    add_animation_options(*command, options->animation);
    add_restore_options(*command, options->restore);
    session.add_common_options(*command,
                               "  filigree export bounce.fil -o bounce.glb\n"
                               "  filigree export bounce.fil -o bounce.glb --key-rate 30 --interpolation cubic\n"
                               "  filigree export scan.fil --poses driver.pc2 -o scan.pc2\n"
                               "  filigree export scan.fil -o levels.glb\n"
                               "  filigree export bounce.fil -o page/ --web");
    command->callback([options, command, &session] {
        session.begin();
        for (const char* name :
             {"--as", "--key-rate", "--interpolation", "--influences", "--full-precision", "--no-normals",
              "--morph-normals", "--law", "--level", "--thin-shell", "--frame-rate", "--animation"})
            if (command->count(name) > 0) options->moving.emplace_back(name);
        run(*options, session);
    });
}

} // namespace filigree::cli
