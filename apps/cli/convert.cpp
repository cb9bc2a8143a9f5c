#include "animation_output.h"
#include "commands.h"
#include "moving_input.h"

#include "filigree/blend/pose_mesh.h"
#include "filigree/io/gltf/gltf.h"
#include "filigree/io/system/extension.h"
#include "filigree/io/system/numbered_name.h"

#include <filesystem>

#include <fmt/format.h>

namespace filigree::cli {

namespace {

namespace fs = std::filesystem;

struct ConvertArguments {
    MovingFiles files;
    std::string output;
    std::size_t frame = 0; ///< from 1; 0: not given
    AnimationOutput animation;
};

bool is_one_of(const std::string& path, std::initializer_list<std::string_view> extensions) {
    return std::ranges::find(extensions, lower_extension(path_of(path))) != extensions.end();
}

/// Whether the output is one mesh: its name has the ending of a mesh format, and no number.
bool is_mesh_output(const std::string& path) {
    std::error_code ignored;
    return !path.ends_with('/') && !fs::is_directory(path_of(path), ignored) && !numbered_name(path_of(path)) &&
           mesh_format(path_of(path)).ok();
}

/// Whether a file holds a motion. A model may be at rest, and so may a glTF.
bool moves(const ConvertArguments& options, Session& session) {
    const std::string& input = options.files.input;
    std::error_code ignored;
    if (fs::is_directory(path_of(input), ignored) || numbered_name(path_of(input)) ||
        is_one_of(input, {".pc2", ".mdd", ".abc"}) || is_usd(path_of(input)))
        return true;
    if (is_one_of(input, {".fil"})) {
        PoseSequence poses;
        session.read_model(input, &poses);
        return !poses.empty();
    }
    if (!is_one_of(input, {".glb", ".gltf"})) return false;
    return !require(GltfScene::read(path_of(input), session.context())).animations().empty();
}

/// One mesh: at rest, or the frame that --frame names.
void write_one_mesh(const ConvertArguments& options, bool moving, Session& session, Report& report) {
    const std::string& input = options.files.input;
    Mesh mesh;
    const bool has_rest = is_one_of(input, {".fil", ".glb", ".gltf"}) || !moving;
    if (options.frame > 0 || !has_rest) {
        MovingInput opened;
        open_moving_input(options.files, session, opened);
        const std::size_t frame = std::max<std::size_t>(options.frame, 1);
        if (frame > opened.animation.frames)
            refuse(fmt::format("--frame {}: {} has the frames 1 to {}.", frame, input, opened.animation.frames));
        mesh = opened.rest;
        require(opened.animation.positions(frame - 1, mesh.positions));
        mesh.normals = {}; // of the mesh at rest
        report.add("frame", fmt::format("{} of {}", frame, opened.animation.frames), "frame", frame);
    } else if (is_one_of(input, {".fil"})) {
        const Model model = session.read_model(input);
        mesh = level_mesh(model, model.finest_level());
    } else {
        mesh = session.read_mesh(input);
    }
    session.write_mesh(mesh, options.output, options.files.mesh.empty() ? input : options.files.mesh);
    report.set("output", options.output);
    report_mesh_written(mesh, options.output, report);
}

/// A mesh stays a mesh, a motion a motion.
void run(const ConvertArguments& options, Session& session) {
    const std::string& input = options.files.input;
    if (is_one_of(options.output, {".fil"}))
        refuse(ErrorCode::unsupported,
               options.output + ": 'filigree strip' makes a model of a mesh, and 'filigree fit' of a motion.");
    const bool mesh_alone = is_mesh_output(options.output) && !is_one_of(options.output, {".glb"});
    if (!mesh_alone) {
        check_animation_path(options.output);
        check_not_input(options.output, {input, options.files.mesh});
    }
    const bool moving = moves(options, session);
    if (options.frame > 0 && !moving) refuse("--frame belongs to a file that moves, and " + input + " does not.");
    Report report;
    if (mesh_alone || options.frame > 0 || (!moving && is_mesh_output(options.output))) {
        if (!is_mesh_output(options.output))
            refuse(options.output + ": --frame writes one mesh; end it in .obj, .ply, .stl, .off or .glb.");
        write_one_mesh(options, moving, session, report);
        if (moving && options.frame == 0)
            session.warn({fmt::format("{} moves, and {} holds {}; --frame N writes another frame, and .pc2, .mdd, "
                                      ".usda, .glb or NAME_####.ply all of them",
                                      input, options.output,
                                      is_one_of(input, {".fil", ".glb", ".gltf"}) ? "it at rest" : "its first frame")});
    } else {
        if (!moving)
            refuse(ErrorCode::unsuitable, input + ": does not move, and " + options.output +
                                              " is for motions; end it in .obj, .ply, .stl, .off or .glb.");
        MovingInput opened;
        open_moving_input(options.files, session, opened);
        check_animation_options({options.output}, session);
        const std::string& materials = options.files.mesh.empty() ? input : options.files.mesh;
        if (opened.model)
            write_animation_output(*opened.model, frames_of(opened.poses), {}, options.animation, options.output,
                                   materials, session, report);
        else
            write_animation_output(opened.animation, options.animation, options.output, materials, session, report);
    }
    session.print(report);
}

} // namespace

Command convert_command() {
    const auto options = std::make_shared<ConvertArguments>();
    return {
        .name = "convert",
        .text = "Write a mesh or an animation in another format, and say what the format cannot hold",
        .options =
            OptionList{
                Option("input", options->files.input,
                       "Mesh (.obj, .ply, .stl, .off, .glb, .gltf), animation (.pc2, .mdd, an animated glTF, "
                       ".usda, NAME_####.ply, a folder of numbered meshes) or model (.fil)")
                    .is_read()
                    .required(),
                Option("output", options->output,
                       "Mesh (.obj, .ply, .stl, .off, .glb), or animation (.glb, .pc2, .mdd, .usda, NAME_####.ply, "
                       "NAME/)")
                    .is_written()
                    .required(),
                Option("--mesh", options->files.mesh, "Mesh that the animation moves, at rest; .pc2 and .mdd need it")
                    .is_read(),
                Option("--frame", options->frame, "Write this frame alone, as a mesh, from 1").whole_from(1)} +
            pose_file_options(options->files.options) + animation_options(options->animation),
        .examples = "  filigree convert scan.stl scan.ply\n"
                    "  filigree convert cloth.pc2 cloth.glb --mesh cloth.obj\n"
                    "  filigree convert walk.glb frames_####.obj\n"
                    "  filigree convert walk.glb pose.obj --frame 12",
        .run = [options](Session& session) { run(*options, session); }};
}

} // namespace filigree::cli
