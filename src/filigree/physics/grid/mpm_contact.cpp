#include "filigree/physics/grid/mpm_contact.h"

#include "filigree/core/parallel_for.h"
#include "filigree/core/smoothstep.h"
#include "filigree/physics/grid/mpm_barriers.h"

#include <algorithm>
#include <cmath>

namespace filigree::mpm {

namespace {

constexpr double kGrownTogether = 0.25f; ///< share of matter that has melted, from which on bodies are one
/// Where bodies were driven into each other there is more matter than has room, and normals lean anyhow: they are one,
/// so that they do not pass.
constexpr double kCrowded = 1.25, kStuck = 1.75; ///< times the mass of a full node
constexpr float kLeastMass = 1e-7f;              ///< of the heavier body's at a node: less of another is not felt

/// Mass of a body at a node of the grid, on both sides of walls.
float mass_at(const Grid& grid, const std::array<int, 3>& node, std::uint32_t body) {
    float mass = 0;
    for (const std::uint32_t side : {body & ~kBehind, body | kBehind}) {
        if (side & kBehind && !grid.has_behind()) continue;
        const std::size_t index = grid.node_index(node, side);
        if (index != Grid::kNoNode) mass += grid.node(index).motion[3];
    }
    return mass;
}

std::array<int, 3> node_of(const BlockPlace& place, int n) {
    return {place.x * kBlockSide + n % kBlockSide, place.y * kBlockSide + n / kBlockSide % kBlockSide,
            place.z * kBlockSide + n / (kBlockSide * kBlockSide)};
}

Vec3f mass_gradient(const Grid& grid, const std::array<int, 3>& node, std::uint32_t body) {
    Vec3f gradient;
    for (int axis = 0; axis < 3; ++axis) {
        std::array<int, 3> before = node, after = node;
        --before[axis];
        ++after[axis];
        gradient[axis] = mass_at(grid, after, body) - mass_at(grid, before, body);
    }
    return gradient;
}

} // namespace

NodeContacts::NodeContacts(const Grid& grid, const World& world, const Barriers& barriers, const PairLaws& laws,
                           std::span<const std::size_t> actors, std::span<const float> full_mass,
                           const RunContext& context)
    : world_(world), barriers_(barriers), laws_(laws), actors_(actors), full_mass_(full_mass) {
    for (std::uint32_t b = 0; b < grid.block_count(); ++b) {
        const BlockPlace& here = grid.place(b);
        const BlockPlace* before = b > 0 ? &grid.place(b - 1) : nullptr;
        if (!before || before->x != here.x || before->y != here.y || before->z != here.z ||
            (before->body ^ here.body) & kBehind)
            first_block_.push_back(b);
        blocks_.push_back(b);
    }
    first_block_.push_back(std::uint32_t(blocks_.size()));
    normals_.resize(place_count());
    parallel_for(context, place_count(), 8, [&](std::size_t begin, std::size_t end) {
        for (std::size_t place = begin; place < end; ++place) {
            const std::span<const std::uint32_t> here = blocks(place);
            if (here.size() < 2) continue;
            for (int n = 0; n < kBlockNodes; ++n) {
                std::size_t with_mass = 0;
                for (const std::uint32_t block : here) with_mass += grid.nodes(block)[n].motion[3] > 0;
                if (with_mass < 2) continue;
                // Of a flat face mass falls faster than at an edge, whose direction would push things aside.
                Vec3f steepest = Vec3f::Zero();
                std::uint32_t whose = here.front();
                for (const std::uint32_t block : here) {
                    const Vec3f gradient = mass_gradient(grid, node_of(grid.place(block), n), grid.place(block).body);
                    if (!(gradient.squaredNorm() > steepest.squaredNorm())) continue;
                    steepest = gradient;
                    whose = block;
                }
                const Vec3f outward = -steepest.stableNormalized();
                for (const std::uint32_t block : here) normals_[place].push_back(block == whose ? outward : -outward);
            }
        }
    });
}

float NodeContacts::act(Grid& grid, const ObstaclePoses& poses, const RunContext& context) const {
    std::vector<float> approach(place_count());
    parallel_for(context, place_count(), 8, [&](std::size_t begin, std::size_t end) {
        for (std::size_t place = begin; place < end; ++place) {
            approach[place] = meet_bodies(grid, place);
            meet_obstacles(grid, place, poses);
        }
    });
    return approach.empty() ? 0 : *std::ranges::max_element(approach);
}

float NodeContacts::meet_bodies(Grid& grid, std::size_t place) const {
    const std::span<const std::uint32_t> here = blocks(place);
    if (here.size() < 2) return 0;
    std::size_t next = 0;
    float approach = 0;
    for (int n = 0; n < kBlockNodes; ++n) {
        float mass = 0, melted = 0, heaviest = 0, fullness = 0;
        std::size_t with_mass = 0;
        Vec3f momentum = Vec3f::Zero();
        for (const std::uint32_t block : here) {
            const Node& node = grid.nodes(block)[n];
            const float m = node.motion[3];
            if (!(m > 0)) continue;
            ++with_mass;
            mass += m;
            fullness += m / full_mass_[grid.place(block).body & ~kBehind];
            heaviest = std::max(heaviest, m);
            melted += m * node.matter[2];
            momentum += m * velocity_of(node);
        }
        if (with_mass < 2) continue;
        const Vec3f common = momentum / mass;
        const auto one = float(std::max(smoothstep(0, kGrownTogether, double(melted / mass)),
                                        smoothstep(kCrowded, kStuck, double(fullness))));
        for (std::size_t k = 0; k < here.size(); ++k) {
            Node& node = grid.nodes(here[k])[n];
            const Vec3f& normal = normals_[place][next + k];
            if (!(node.motion[3] > 0)) continue;
            Vec3f own = velocity_of(node);
            const bool meets = heaviest * kLeastMass < mass - node.motion[3] && !normal.isZero();
            if (meets) approach = std::max(approach, (own - common).dot(normal));
            if (meets) own = common + after_contact(own - common, -normal, friction_of(grid, here, k, n));
            set_velocity(node, own + one * (common - own));
        }
        next += here.size();
    }
    return approach;
}

std::size_t NodeContacts::actor_of(const Grid& grid, std::uint32_t block) const {
    return actors_[grid.place(block).body & ~kBehind];
}

/// Between a body and those it meets at a node: the mean of its pairs', by the others' mass there.
float NodeContacts::friction_of(const Grid& grid, std::span<const std::uint32_t> here, std::size_t k, int node) const {
    double sum = 0, mass = 0;
    for (std::size_t other = 0; other < here.size(); ++other) {
        const auto m = double(grid.nodes(here[other])[node].motion[3]);
        if (other == k || !(m > 0)) continue;
        sum += m * laws_.of(actor_of(grid, here[k]), actor_of(grid, here[other])).friction;
        mass += m;
    }
    return mass > 0 ? float(sum / mass) : 0.0f;
}

void NodeContacts::meet_obstacles(Grid& grid, std::size_t place, const ObstaclePoses& poses) const {
    const std::span<const std::uint32_t> here = blocks(place);
    const float h = grid.spacing();
    const BlockPlace& at = grid.place(here.front());
    const Vec3f middle = h * (Vec3f(float(at.x), float(at.y), float(at.z)) * kBlockSide + Vec3f::Constant(1.5f));
    for (std::size_t o = 0; o < world_.obstacles.size(); ++o) {
        if (barriers_.has(o)) continue;
        const Obstacle& obstacle = world_.obstacles[o];
        const float reach = 1.5f * std::sqrt(3.0f) * h;
        if (!(poses.distance_to(o, middle).distance < reach)) continue;
        for (int n = 0; n < kBlockNodes; ++n) {
            const std::array<int, 3> node = node_of(at, n);
            const Vec3f point = h * Vec3f(float(node[0]), float(node[1]), float(node[2]));
            const DistanceField::Sample sample = poses.distance_to(o, point);
            if (!(sample.distance < 0)) continue;
            const Vec3f moving = poses.velocity(o, point);
            for (const std::uint32_t block : here) {
                Node& value = grid.nodes(block)[n];
                if (!(value.motion[3] > 0)) continue;
                set_velocity(value, moving + after_contact(velocity_of(value) - moving, sample.normal,
                                                           float(obstacle.friction)));
            }
        }
    }
}

HeatExchange::HeatExchange(const World& world, double time, float dt, float grid_spacing,
                           std::span<const Particle> particles)
    : world_(world), dt_(dt), grid_spacing_(grid_spacing) {
    const double middle = time - 0.5 * double(dt); // of the step: what rises from key to key is met on average
    air_temperature_ = float(world.air_temperature.at(middle));
    for (const Obstacle& obstacle : world.obstacles)
        obstacle_temperature_.push_back(float(obstacle.temperature.at(middle)));
    for (const HeatSource& source : world.heat_sources) add_source(source, middle, particles);
}

bool HeatExchange::acts_in(const World& world) {
    return world.air_heat_transfer > 0 || !world.heat_sources.empty() ||
           std::ranges::any_of(world.obstacles, [](const Obstacle& obstacle) { return obstacle.heat_transfer > 0; });
}

void HeatExchange::add_source(const HeatSource& source, double time, std::span<const Particle> particles) {
    const double watts = source.power.at(time);
    if (watts == 0) return;
    const Vec3f centre = (source.ball.centre + source.move.at(time)).cast<float>();
    const auto radius = float(source.ball.radius);
    for (const float reach : {radius, radius + 0.5f * grid_spacing_}) {
        double mass = 0;
        for (const Particle& p : particles)
            if ((Vec3f(p.x[0], p.x[1], p.x[2]) - centre).squaredNorm() < reach * reach) mass += double(p.mass);
        if (!(mass > 0)) continue;
        sources_.push_back({centre, reach * reach, float(watts * world_.heat_pace / mass)});
        return;
    }
}

/// Of a mesh that is a room, from its walls.
float HeatExchange::distance_from(std::size_t obstacle, const Vec3f& point, const ObstaclePoses& poses) const {
    const float distance = poses.distance_to(obstacle, point).distance;
    return std::holds_alternative<MeshObstacle>(world_.obstacles[obstacle].shape) ? std::abs(distance) : distance;
}

void HeatExchange::go_to(const BlockPlace& place, const ObstaclePoses& poses, std::vector<std::size_t>& near) const {
    // Particles whose stencils begin in the block were within two cells of its middle along each axis, and have gone on
    // for less than one since.
    const float h = grid_spacing_, reach = (2 + 2 * std::sqrt(3.0f)) * h;
    const Vec3f middle = h * (Vec3f(float(place.x), float(place.y), float(place.z)) * kBlockSide +
                              Vec3f::Constant(0.5f * kBlockSide + 0.5f));
    near.clear();
    for (std::size_t o = 0; o < world_.obstacles.size(); ++o)
        if (world_.obstacles[o].heat_transfer > 0 && distance_from(o, middle, poses) < reach) near.push_back(o);
}

void HeatExchange::act(Particle& p, const Matter& matter, float emptiness, float surface, const ObstaclePoses& poses,
                       std::span<const std::size_t> near) const {
    const Vec3f point(p.x[0], p.x[1], p.x[2]);
    const float volume = p.volume * p.volume_ratio(), area = surface * emptiness * volume;
    const float temperature = matter.temperature(p.enthalpy()), heat_capacity = p.mass * matter.specific_heat();
    // Never beyond what is around it.
    const auto exchange = [&](float around, double transfer, float over) {
        const float share = std::min(1.0f, float(transfer * world_.heat_pace) * over * dt_ / heat_capacity);
        p.add_heat(share * matter.specific_heat() * (around - temperature));
    };
    p.add_heat(matter.specific_heat() * matter.heating() * dt_ * std::min(1.0f, emptiness * grid_spacing_));
    if (world_.air_heat_transfer > 0) exchange(air_temperature_, world_.air_heat_transfer, area);
    for (const std::size_t o : near) {
        const Obstacle& obstacle = world_.obstacles[o];
        if (!(distance_from(o, point, poses) < grid_spacing_)) continue;
        exchange(obstacle_temperature_[o], obstacle.heat_transfer, volume / grid_spacing_);
    }
    for (const Source& source : sources_)
        if ((point - source.centre).squaredNorm() < source.squared_radius) p.add_heat(source.watts_a_kilogram * dt_);
}

} // namespace filigree::mpm
