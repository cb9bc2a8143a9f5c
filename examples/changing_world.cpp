// A world that changes while it runs: stones are thrown in, hits are heard, a plate sweeps them off, what fell is
// removed.
#include <filigree/mesh.h>
#include <filigree/physics/material.h>
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

/// Those within so many metres of the lowest one.
std::vector<Index> lowest_particles(const Body& body, float height) {
    float least = body.rest[0].y();
    for (Index i = 0; i < body.particle_count(); ++i) least = std::min(least, body.rest[i].y());
    std::vector<Index> found;
    for (Index i = 0; i < body.particle_count(); ++i)
        if (body.rest[i].y() < least + height) found.push_back(i);
    return found;
}

bool is_below(const Vectors& positions, float height) {
    for (std::size_t i = 0; i < positions.size(); ++i)
        if (positions[i].y() > height) return false;
    return true;
}

} // namespace

int main() {
    const RunContext context;
    const auto target = body_of(make_wavy_sphere({.resolution = 12}), "jelly", 0.3, 400, context);
    const auto stone = body_of(make_wavy_cube({.resolution = 12}), "stone", 0.12, 64, context);
    constexpr std::size_t kPlate = 1;

    World world;
    world.obstacles = {box({0, -0.05, 0}, {2, 0.1, 1}), box({-0.3, 0.15, -0.8}, {1.1, 0.25, 0.1})};
    world.pins.push_back({0, lowest_particles(*target, 0.05f), {}});
    Actor stands;
    stands.body = target;
    stands.placement.translation() = Vec3d(0.6, 0.17, 0);
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
            pose.translation().z() = std::min(1.5, 0.015 * (frame - 149));
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
            if (!is_below(simulation.positions(number), -0.5f)) return false;
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
