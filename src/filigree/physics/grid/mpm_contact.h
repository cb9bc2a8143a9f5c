// What the nodes of the material point method meet: obstacles, and matter of other bodies; and what warms particles.
// Private to the layer.
#pragma once

#include "filigree/physics/contact/obstacle_motion.h"
#include "filigree/physics/contact/pair_laws.h"
#include "filigree/physics/grid/mpm_grid.h"

namespace filigree::mpm {

class Barriers;

/// What is left of a velocity relative to something with this outward normal, by Coulomb's law. inward: m/s.
inline Vec3f after_contact(const Vec3f& relative, const Vec3f& normal, float friction) {
    const float inward = -relative.dot(normal);
    if (!(inward > 0)) return relative;
    const Vec3f along = relative + inward * normal;
    const float speed = along.norm();
    return speed > 0 ? Vec3f(along * std::max(0.0f, 1 - friction * inward / speed)) : along;
}

/// Bodies that are cold slide on each other, by Coulomb's law, and part again; where there is matter that has melted
/// they are one.
class NodeContacts {
public:
    /// Before nodes have velocities: looks at masses alone. actors: of each body of the grid.
    /// barriers: obstacles that nodes do not meet. full_mass: of each body, kg at a node amid its matter at rest.
    NodeContacts(const Grid& grid, const World& world, const Barriers& barriers, const PairLaws& laws,
                 std::span<const std::size_t> actors, std::span<const float> full_mass, const RunContext& context);

    /// Places of blocks, each with the blocks of all bodies there; what is behind walls is another place.
    std::size_t place_count() const { return first_block_.size() - 1; }
    std::span<const std::uint32_t> blocks(std::size_t place) const {
        return std::span(blocks_).subspan(first_block_[place], first_block_[place + 1] - first_block_[place]);
    }
    /// Changes the nodes' velocities. Returns how fast bodies came towards each other at any node, m/s.
    float act(Grid& grid, const ObstaclePoses& poses, const RunContext& context) const;

private:
    float meet_bodies(Grid& grid, std::size_t place) const;
    float friction_of(const Grid& grid, std::span<const std::uint32_t> here, std::size_t k, int node) const;
    void meet_obstacles(Grid& grid, std::size_t place, const ObstaclePoses& poses) const;

    std::size_t actor_of(const Grid& grid, std::uint32_t block) const;

    const World& world_;
    const Barriers& barriers_;
    const PairLaws& laws_;
    std::span<const std::size_t> actors_;
    std::span<const float> full_mass_;
    std::vector<std::uint32_t> blocks_, first_block_;
    std::vector<std::vector<Vec3f>> normals_; ///< of each place: of nodes with several bodies, one a body; outward
};

/// Heat that comes and goes over the matter's surface, and from sources.
class HeatExchange {
public:
    /// time: of the step's end. A ball that lies between particles warms those that are a particle's spacing around it.
    HeatExchange(const World& world, double time, float dt, float grid_spacing, std::span<const Particle> particles);

    /// emptiness: size of the gradient of the share of space that is full, 1/m; times `surface` it is the area in a
    /// unit of volume. near: as go_to has it. Before the particle moves: sources share their power out by where it is.
    void act(Particle& particle, const Matter& matter, float emptiness, float surface, const ObstaclePoses& poses,
             std::span<const std::size_t> near) const;
    /// Whether heat comes to bodies from outside at all.
    static bool acts_in(const World& world);
    /// Which obstacles may warm or cool particles of a block at `place`: all but those that are far.
    void go_to(const BlockPlace& place, const ObstaclePoses& poses, std::vector<std::size_t>& near) const;

private:
    float distance_from(std::size_t obstacle, const Vec3f& point, const ObstaclePoses& poses) const;
    void add_source(const HeatSource& source, double time, std::span<const Particle> particles);

    const World& world_;
    float dt_, grid_spacing_, air_temperature_;
    std::vector<float> obstacle_temperature_; ///< K; of those that exchange heat
    struct Source {
        Vec3f centre;
        float squared_radius, watts_a_kilogram;
    };
    std::vector<Source> sources_;
};

} // namespace filigree::mpm
