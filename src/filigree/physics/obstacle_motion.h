// How obstacles stand and move at a moment. Private to the layer.
#pragma once

#include "filigree/physics/body_state.h"
#include "filigree/physics/world.h"

namespace filigree {

/// How obstacles stand at a moment, and how fast their matter moves.
class ObstaclePoses {
public:
    ObstaclePoses(const World& world, double time);

    const Eigen::Isometry3d& at(std::size_t obstacle) const { return motions_[obstacle].now; }
    Vec3f to_own_axes(std::size_t obstacle, const Vec3f& point) const;
    Vec3f to_world(std::size_t obstacle, const Vec3f& own) const;
    /// m/s, of the obstacle's matter at a point of the world.
    Vec3f velocity(std::size_t obstacle, const Vec3f& point) const;

private:
    struct Motion {
        Eigen::Isometry3d now, before, after;
        bool moves;
    };
    std::vector<Motion> motions_;
};

/// Bound on the way, in m, that the matter of a moving obstacle goes between two times, near where the bodies are now.
/// Along the keys: an obstacle that goes and returns has gone its way twice. Cost O(keys), and O(particles) where an
/// obstacle turns.
double obstacle_way(const World& world, std::span<const BodyState> bodies, double from, double until);

} // namespace filigree
