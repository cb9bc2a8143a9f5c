#include "filigree/scene/drop_scene.h"

#include "filigree/physics/material.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace filigree {

namespace {

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

class DropScene {
public:
    DropScene(const Mesh& mesh, const std::string& mesh_name, const DropSceneOptions& options,
              const NamedMaterial& material)
        : options_(options), material_(material), mesh_name_(mesh_name),
          up_axis_(options.up.value_or(find_up_axis(mesh, usual_up_axis(mesh_name)))),
          up_(Vec3d::Unit(static_cast<int>(up_axis_))) {
        const Box box = bounds(mesh);
        // The body turns about the middle of its box.
        const Vec3d middle = box.centre();
        const Eigen::AngleAxisd turn(options.tilt * std::numbers::pi / 180, tilt_axis());
        Box turned;
        for (const Vec3f& p : mesh.positions) turned.extend(middle + turn * (p.cast<double>() - middle));
        DropOptions drop;
        drop.size = options.size;
        drop.drop = options.height.value_or(0.5 * options.size);
        drop.obstacle = options.obstacle;
        const double scale = options.size / box.size().maxCoeff();
        world_ = world_of_drop(drop, turned, scale, up_);
        // The ground goes to height 0, the body above the origin.
        const Obstacle& ground = world_.obstacles.back();
        shift_ = -std::get<HalfSpace>(ground.shape).point;
        const Vec3d at = scale * middle;
        shift_ -= at - at.dot(up_) * up_;
        centre_ = at + shift_;
    }

    std::string text() const {
        std::string text = fmt::format("# Written by filigree drop; docs/scenes.md has all keys.\n\n[simulation]\n"
                                       "duration = {}{}\n\n[world]\ngravity = {}{}\n\n",
                                       options_.duration, "  # s", spelled(world_.gravity), "  # m/s^2");
        text += fmt::format("[[body]]\nname = \"body\"\nmesh = {}\nsize = {}  # m, its longest side\n"
                            "material = \"{}\"\nparticles = {}\ncentre = {}\n",
                            quoted(mesh_name_), options_.size, options_.material, options_.particles, spelled(centre_));
        if (options_.tilt != 0)
            text += fmt::format("rotate = {{ axis = {}, degrees = {} }}\n", spelled(tilt_axis()), options_.tilt);
        if (options_.young_modulus) text += fmt::format("young_modulus = {}  # Pa\n", *options_.young_modulus);
        if (const std::size_t pieces = options_.pieces.value_or(material_.strength > 0 ? kPieces : 0); pieces > 0)
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

    const DropSceneOptions& options_;
    const NamedMaterial& material_;
    std::string mesh_name_;
    UpAxis up_axis_;
    Vec3d up_, centre_ = Vec3d::Zero(), shift_ = Vec3d::Zero();
    World world_;
};

} // namespace

Result<std::string> drop_scene(const Mesh& mesh, const std::string& mesh_name, const DropSceneOptions& options) {
    const std::span<const NamedMaterial> all = named_materials();
    const auto material = std::ranges::find(all, options.material, &NamedMaterial::name);
    if (material == all.end()) {
        std::vector<std::string_view> names;
        for (const NamedMaterial& named : all) names.push_back(named.name);
        return Error{ErrorCode::usage, fmt::format("material: there is no material '{}'; there are {}.",
                                                   options.material, fmt::join(names, ", "))};
    }
    if (options.pieces.value_or(0) > 0 && material->material.model != MaterialModel::fem)
        return Error{ErrorCode::unsuitable,
                     fmt::format("pieces: {} does not break; glass, plaster and brittle-stone do.", options.material)};
    if (!(bounds(mesh).size().maxCoeff() > 0))
        return Error{ErrorCode::unsuitable,
                     mesh_name + ": all of its points lie at one place, and a body needs a volume."};
    return DropScene(mesh, mesh_name, options, *material).text();
}

} // namespace filigree
