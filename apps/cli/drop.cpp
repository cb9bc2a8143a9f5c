// A mesh falls: the scene for it is written here, and simulated as any other.
#include "drop.h"

#include "commands.h"
#include "draft.h"
#include "drawing.h"
#include "live_page.h"
#include "pictures.h"
#include "simulate.h"

#include "filigree/io/system/file.h"
#include "filigree/physics/material.h"
#include "filigree/scene/dropped_body.h"

#include <filesystem>
#include <numbers>

#include <fmt/format.h>

namespace filigree::cli {

namespace {

namespace fs = std::filesystem;

struct DropArguments {
    SimulateArguments run;
    std::string mesh, material = "rubber", scene, page;
    double size = 1, tilt = 0, duration = 3;
    std::optional<double> height = {}, young_modulus = {};
    std::optional<std::size_t> pieces = {};
    std::size_t particles = 4000;
    ObstacleChoice obstacle = ObstacleChoice::none;
    std::optional<UpAxis> up = {};
};

constexpr std::size_t kPieces = 40; // of a material that breaks

std::string quoted(const std::string& text) {
    std::string result = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') result += '\\';
        result += c;
    }
    return result + '"';
}

std::string spelled(const Vec3d& v) {
    const auto number = [](double x) { return fmt::format("{:.6g}", std::abs(x) < 1e-12 ? 0 : x); };
    return fmt::format("[{}, {}, {}]", number(v.x()), number(v.y()), number(v.z()));
}

const NamedMaterial* material_called(const std::string& name) {
    const std::span<const NamedMaterial> all = named_materials();
    const auto found = std::ranges::find(all, name, &NamedMaterial::name);
    return found == all.end() ? nullptr : &*found;
}

/// The scene as the text of a file, for people to change.
class DropScene {
public:
    /// mesh_name: as a scene in its folder names the mesh.
    DropScene(const DropArguments& options, const Mesh& mesh, const std::string& mesh_name)
        : options_(options), mesh_name_(mesh_name), up_axis_(up_of(options.up, mesh, options.mesh)),
          up_(Vec3d::Unit(static_cast<int>(up_axis_))) {
        const Box box = bounds(mesh);
        const double longest = box.size().maxCoeff();
        if (!(longest > 0))
            refuse(ErrorCode::unsuitable, options.mesh + ": all of its points lie at one place, and a body needs a "
                                                         "volume.");
        // The body turns about the middle of its box.
        const Vec3d middle = box.centre();
        const Eigen::AngleAxisd turn(options.tilt * std::numbers::pi / 180, tilt_axis());
        Box turned;
        for (const Vec3f& p : mesh.positions) turned.extend(middle + turn * (p.cast<double>() - middle));
        DropOptions drop;
        drop.size = options.size;
        drop.drop = options.height.value_or(0.5 * options.size);
        drop.obstacle = options.obstacle;
        const double scale = options.size / longest;
        world_ = world_of_drop(drop, turned, scale, up_);
        // The ground goes to height 0, the body above the origin.
        const Obstacle& ground = world_.obstacles.back();
        shift_ = -std::get<HalfSpace>(ground.shape).point;
        const Vec3d at = scale * middle;
        shift_ -= at - at.dot(up_) * up_;
        centre_ = at + shift_;
    }

    std::string text() const {
        const NamedMaterial& material = *material_called(options_.material);
        std::string text = fmt::format("# Written by filigree drop; docs/scenes.md has all keys.\n\n[simulation]\n"
                                       "duration = {}{}\n\n[world]\ngravity = {}{}\n\n",
                                       options_.duration, "  # s", spelled(world_.gravity), "  # m/s^2");
        text += fmt::format("[[body]]\nname = \"body\"\nmesh = {}\nsize = {}  # m, its longest side\n"
                            "material = \"{}\"\nparticles = {}\ncentre = {}\n",
                            quoted(mesh_name_), options_.size, options_.material, options_.particles, spelled(centre_));
        if (options_.tilt != 0)
            text += fmt::format("rotate = {{ axis = {}, degrees = {} }}\n", spelled(tilt_axis()), options_.tilt);
        if (options_.young_modulus) text += fmt::format("young_modulus = {}  # Pa\n", *options_.young_modulus);
        if (const std::size_t pieces = options_.pieces.value_or(material.strength > 0 ? kPieces : 0); pieces > 0)
            text += fmt::format("\n[[fracture]]\npieces = {}\n", pieces);
        for (const Obstacle& obstacle : world_.obstacles) text += '\n' + spelled_obstacle(obstacle);
        if (up_axis_ != UpAxis::y) text += fmt::format("\n[picture]\nup = \"{}\"\n", "xyz"[int(up_axis_)]);
        return text;
    }

private:
    /// Level, and along no side of the box: an edge or a corner comes first.
    Vec3d tilt_axis() const {
        const Vec3d side = Vec3d::Unit(up_axis_ == UpAxis::x ? 1 : 0), front = side.cross(up_);
        return (2 * side + front).normalized();
    }

    std::string spelled_obstacle(const Obstacle& obstacle) const {
        std::string text = "[[obstacle]]\n";
        if (const auto* ground = std::get_if<HalfSpace>(&obstacle.shape))
            text += fmt::format("shape = \"ground\"\nnormal = {}\n", spelled(ground->normal));
        if (const auto* ball = std::get_if<Ball>(&obstacle.shape))
            text += fmt::format("shape = \"ball\"\ncentre = {}\nradius = {:.6g}\n", spelled(ball->centre + shift_),
                                ball->radius);
        if (const auto* box = std::get_if<Cuboid>(&obstacle.shape)) {
            text += fmt::format("shape = \"box\"\ncentre = {}\nsize = {}\n", spelled(box->centre + shift_),
                                spelled(box->size));
            if (const Vec3d turn = obstacle.motion.angle.constant; turn.norm() > 0)
                text += fmt::format("turn = {}  # degrees\npivot = {}\n", spelled(turn * 180 / std::numbers::pi),
                                    spelled(obstacle.motion.centre + shift_));
        }
        return text + fmt::format("friction = {}\nrestitution = {}\n", obstacle.friction, obstacle.restitution);
    }

    const DropArguments& options_;
    std::string mesh_name_;
    UpAxis up_axis_;
    Vec3d up_, centre_ = Vec3d::Zero(), shift_ = Vec3d::Zero();
    World world_;
};

void check(const DropArguments& options) {
    if (options.run.outputs.empty() && options.scene.empty() && options.page.empty())
        refuse("Say where the motion goes: -o OUT.glb, -o FILM.mp4, -o OUT.fil or -o OUT.pc2; or where the scene goes: "
               "--scene SCENE.toml; or a page in which it moves: --page FOLDER.");
    if (!material_called(options.material)) {
        std::vector<std::string_view> names;
        for (const NamedMaterial& named : named_materials()) names.push_back(named.name);
        refuse(fmt::format("--material: there is no material '{}'; there are {}.", options.material,
                           fmt::join(names, ", ")));
    }
    if (options.pieces.value_or(0) > 0 && material_called(options.material)->material.model != MaterialModel::fem)
        refuse(ErrorCode::unsuitable,
               fmt::format("--pieces: {} does not break; glass, plaster and brittle-stone do.", options.material));
    check_folder_of(options.scene);
    if (!options.page.empty() && !options.run.outputs.empty())
        refuse("--page and -o are two jobs, as the page simulates by itself; run the command once for each.");
}

void run(const DropArguments& options, Session& session) {
    check(options);
    fs::path mesh_path = path_of(options.mesh);
    if (!options.scene.empty()) // a scene names its meshes from its own folder
        mesh_path = fs::absolute(mesh_path).lexically_relative(fs::absolute(path_of(options.scene)).parent_path());
    const std::string text = DropScene(options, session.read_mesh(options.mesh), mesh_path.generic_string()).text();
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
    DropArguments options;
    options.mesh = path;
    return require(parse_scene(DropScene(options, mesh, path_of(path).generic_string()).text(), "scene of drop"));
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
                    Option("--material", options->material,
                           "Material; 'filigree simulate --keys' lists them: rubber, soft-rubber, jelly, foam, glass, "
                           "plaster, stone, clay, ...")
                        .with_default()
                        .named("NAME"),
                    Option("--size", options->size, "Longest side of the mesh, m").above_zero().with_default(),
                    Option("--height", options->height,
                           "Height of the lowest point above what it falls onto, m (default: half of the size)")
                        .between(0.0, 1e6),
                    choice<ObstacleChoice>("--obstacle", options->obstacle,
                                           {{"none", ObstacleChoice::none},
                                            {"ball", ObstacleChoice::ball},
                                            {"step", ObstacleChoice::step},
                                            {"slope", ObstacleChoice::slope}},
                                           "What it meets above the ground (default: none)"),
                    Option("--tilt", options->tilt, "Rotation at the start about a level axis, degrees")
                        .between(-360.0, 360.0)
                        .with_default(),
                    found_up_option(options->up),
                    Option("--young-modulus", options->young_modulus, "Stiffness, Pa (default: the material's)")
                        .above_zero(),
                    Option("--pieces", options->pieces,
                           "Pieces that it breaks into (default: 40 of glass, plaster and brittle-stone; else 0)")
                        .between(0, 100000),
                    Option("--particles", options->particles, "Approximate number of particles")
                        .whole_from(8)
                        .with_default(),
                    Option("--duration", options->duration, "Length, s").above_zero().with_default(),
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
