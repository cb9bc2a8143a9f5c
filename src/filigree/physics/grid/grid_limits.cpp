#include "filigree/physics/grid/grid_limits.h"

#include "filigree/physics/contact/obstacle_surface.h"

#include <algorithm>
#include <array>
#include <cstdio>

namespace filigree {

namespace {

/// m: the second of the three sides, by length. Of a mesh, of its box.
double second_side(const Vec3d& size) {
    std::array sides = {size.x(), size.y(), size.z()};
    std::ranges::sort(sides);
    return sides[1];
}
double width_of(const HalfSpace&) { return std::numeric_limits<double>::infinity(); }
double width_of(const Ball& ball) { return 2 * ball.radius; }
double width_of(const Cuboid& box) { return second_side(box.size); }
double width_of(const MeshObstacle& mesh) {
    if (mesh.surface) return second_side(mesh.surface->box().size());
    return mesh.field ? second_side(mesh.field->box().size()) : std::numeric_limits<double>::infinity();
}

bool is_of_mpm(const Actor& actor) { return actor.body->material.model == MaterialModel::mpm; }

} // namespace

std::string SlenderObstacle::sentence(const std::string& obstacle_name) const {
    std::array<char, 240> text;
    std::snprintf(
        text.data(), text.size(),
        " is %.3g m wide, less than the %.3g m between particles of mpm: their matter goes around it as if it "
        "were not there; take more particles or a wider obstacle",
        width, spacing);
    return obstacle_name + text.data();
}

std::vector<SlenderObstacle> find_slender_obstacles(const World& world, std::span<const Actor> actors) {
    double spacing = 0;
    for (const Actor& actor : actors)
        if (is_of_mpm(actor)) spacing = std::max(spacing, actor.body->spacing());
    std::vector<SlenderObstacle> slender;
    for (std::size_t o = 0; o < world.obstacles.size(); ++o) {
        const double width =
            std::visit([](const auto& of_kind) { return width_of(of_kind); }, world.obstacles[o].shape);
        if (width < spacing) slender.push_back({o, width, spacing});
    }
    return slender;
}

std::string why_models_do_not_meet(std::span<const Actor> actors) {
    const auto on_grid = std::size_t(std::ranges::count_if(actors, is_of_mpm));
    if (on_grid == 0 || on_grid == actors.size()) return "";
    return "bodies of the model mpm touch obstacles and each other, and pass through bodies of other models";
}

} // namespace filigree
