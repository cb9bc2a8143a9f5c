// A mesh falls: the scene for it is written here, and simulated as any other.
#include "drop.h"

#include "commands.h"
#include "draft.h"
#include "drawing.h"
#include "live_page.h"
#include "pictures.h"
#include "simulate.h"

#include "filigree/io/system/file.h"
#include "filigree/scene/drop_scene.h"

#include <filesystem>

namespace filigree::cli {

namespace {

namespace fs = std::filesystem;

struct DropArguments {
    SimulateArguments run;
    std::string mesh, scene, page;
    DropSceneOptions drop;
};

void check(const DropArguments& options) {
    if (options.run.outputs.empty() && options.scene.empty() && options.page.empty())
        refuse("Say where the motion goes: -o OUT.glb, -o FILM.mp4, -o OUT.fil or -o OUT.pc2; or where the scene goes: "
               "--scene SCENE.toml; or a page in which it moves: --page FOLDER.");
    check_folder_of(options.scene);
    if (!options.page.empty() && !options.run.outputs.empty())
        refuse("--page and -o are two jobs, as the page simulates by itself; run the command once for each.");
}

void run(const DropArguments& options, Session& session) {
    check(options);
    fs::path mesh_path = path_of(options.mesh);
    if (!options.scene.empty()) // a scene names its meshes from its own folder
        mesh_path = fs::absolute(mesh_path).lexically_relative(fs::absolute(path_of(options.scene)).parent_path());
    const std::string text =
        require(drop_scene(session.read_mesh(options.mesh), mesh_path.generic_string(), options.drop));
    const std::string name = options.scene.empty() ? "scene of drop" : options.scene;
    SceneFile scene = require(parse_scene(text, name));
    if (!options.scene.empty()) {
        session.begin_writing(options.scene);
        require(write_file(path_of(options.scene), text));
    }
    if (!options.run.outputs.empty()) return run_scene(std::move(scene), options.run, session);
    Report report;
    if (!options.scene.empty()) report.add("scene", options.scene, "scene", options.scene);
    if (!options.page.empty())
        export_live_page(scene, options.page, options.mesh, {path_of(options.mesh).stem().string(), "", false}, session,
                         report);
    session.print(report);
}

} // namespace

SceneFile default_drop_scene(const std::string& path, const Mesh& mesh) {
    const std::string text = require(drop_scene(mesh, path_of(path).generic_string(), {}));
    return require(parse_scene(text, "scene of drop"));
}

Command drop_command() {
    const auto options = std::make_shared<DropArguments>();
    return {.name = "drop",
            .text = "Let a mesh fall as a soft, stiff or brittle body, without a scene file",
            .options =
                OptionList{
                    Option("mesh", options->mesh, "Mesh file").required().is_read(),
                    Option("-o,--output", options->run.outputs,
                           "Output: the detailed mesh in motion (.glb, .pc2, .mdd, .usda), a film (.mp4, .gif, "
                           "NAME_%04d.png), a model with its poses (.fil), or a folder of meshes (NAME/). May come "
                           "several times")
                        .one_at_a_time(),
                    Option("--material", options->drop.material,
                           "Material; 'filigree simulate --keys' lists them: rubber, soft-rubber, jelly, foam, glass, "
                           "plaster, stone, clay, ...")
                        .with_default()
                        .named("NAME"),
                    Option("--size", options->drop.size, "Longest side of the mesh, m").above_zero().with_default(),
                    Option("--height", options->drop.height,
                           "Height of the lowest point above what it falls onto, m (default: half of the size)")
                        .between(0.0, 1e6),
                    choice<ObstacleChoice>("--obstacle", options->drop.obstacle,
                                           {{"none", ObstacleChoice::none},
                                            {"ball", ObstacleChoice::ball},
                                            {"step", ObstacleChoice::step},
                                            {"slope", ObstacleChoice::slope}},
                                           "What it meets above the ground (default: none)"),
                    Option("--tilt", options->drop.tilt, "Rotation at the start about a level axis, degrees")
                        .between(-360.0, 360.0)
                        .with_default(),
                    found_up_option(options->drop.up),
                    Option("--young-modulus", options->drop.young_modulus, "Stiffness, Pa (default: the material's)")
                        .above_zero(),
                    Option("--pieces", options->drop.pieces,
                           "Pieces that it breaks into (default: 40 of glass, plaster and brittle-stone; else 0)")
                        .between(0, 100000),
                    Option("--particles", options->drop.particles, "Approximate number of particles")
                        .whole_from(8)
                        .with_default(),
                    Option("--duration", options->drop.duration, "Length, s").above_zero().with_default(),
                    Option("--draft", options->run.draft, kDraftHelp),
                    Option("--scene", options->scene,
                           "Write the scene as a file too, to change it and run it with 'filigree simulate'")
                        .is_written(),
                    Option("--page", options->page,
                           "Write a folder with a page in which it falls, and can be pulled (docs/live.md)")
                        .is_written()} +
                animation_options(options->run.animation),
            .examples = "  filigree drop scan.ply -o bounce.glb --material soft-rubber --size 1\n"
                        "  filigree drop vase.obj -o vase.mp4 --material glass --size 0.3 --height 1 --tilt 25\n"
                        "  filigree drop scan.ply --scene scan.toml --obstacle slope\n"
                        "  filigree drop scan.ply --page page/ --material jelly",
            .run = [options](Session& session) { run(*options, session); }};
}

} // namespace filigree::cli
