// A world that changes while it runs: stones are thrown in, hits are heard, a plate sweeps them off, what fell is
// removed.
#include <filigree/mesh/shapes.h>
#include <filigree/physics/named_materials.h>
#include <filigree/physics/simulation.h>

#include <algorithm>
#include <cstdio>
#include <set>

using namespace filigree;

namespace {

Obstacle box(const Vec3d& centre, const Vec3d& size) {
    Obstacle made;
    made.shape = Cuboid{centre, size};
    made.friction = 0.4;
    return made;
}

std::shared_ptr<const Body> body_of(const Mesh& mesh, std::string_view material, double size, std::size_t particles,
                                    const RunContext& context) {
    BodyOptions options;
    options.size = size;
    options.cells.count = particles;
    const NamedMaterial& named = *std::ranges::find(named_materials(), material, &NamedMaterial::name);
    return std::make_shared<const Body>(make_body(mesh, named.material, options, context).value());
}

double highest(const Vectors& positions) { return double(*std::ranges::max_element(positions.y)); }

} // namespace

int main() {
    const RunContext context;
    const auto target = body_of(make_wavy_sphere({.resolution = 12}), "jelly", 0.3, 400, context);
    const auto stone = body_of(make_wavy_cube({.resolution = 12}), "stone", 0.12, 64, context);
    constexpr std::size_t kPlate = 1;

    World world;
    world.obstacles = {box({0, -0.05, 0}, {2, 0.1, 1}), box({-1.3, 0.1, 0}, {0.1, 0.2, 1})};
    Actor stands;
    stands.body = target;
    stands.placement.translation() = Vec3d(0.5, 0.17, 0);
    Simulation simulation = Simulation::create(world, {stands}, {}, context).value();

    std::set<std::size_t> stones;
    std::size_t hits = 0, lost = 0;
    for (int frame = 0; frame < 300; ++frame) {
        if (frame % 25 == 0 && frame < 150) {
            Actor thrown;
            thrown.body = stone;
            thrown.placement.translation() = Vec3d(-0.4, 0.25, 0.01 * (frame % 3));
            thrown.velocity = Vec3d(3.5, 0.5, 0);
            stones.insert(simulation.add_body(thrown, context).value());
        }
        if (frame >= 150) { // where the plate shall be at the end of the frame
            Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
            pose.translation().x() = std::min(2.5, 0.02 * (frame - 149));
            simulation.move_obstacle(kPlate, pose).value();
        }
        simulation.advance(context).value();
        for (const ContactEvent& event : simulation.contact_events()) {
            if (event.kind != ContactKind::began || !event.other || event.body != 0 || event.speed < 0.5) continue;
            ++hits;
            std::printf("frame %d: stone %zu hits at %.1f m/s, %.2f N s\n", frame, *event.other, event.speed,
                        event.impulse);
        }
        std::erase_if(stones, [&](std::size_t number) {
            if (highest(simulation.positions(number)) > -0.5) return false;
            simulation.remove_body(number).value();
            ++lost;
            return true;
        });
    }
    const std::optional<WorldHit> below = simulation.cast_ray({0, 1, 0}, {0, -1, 0});
    std::printf("%zu hits, %zu stones swept off; below the middle is %s\n", hits, lost,
                below && below->obstacle ? "the table" : "a body");
    return hits >= 3 && lost >= 3 && below ? 0 : 1;
}
