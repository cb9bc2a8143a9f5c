// How obstacles stand and move at a moment. Private to the layer.
#pragma once

#include "filigree/physics/body/body_state.h"
#include "filigree/physics/world.h"

namespace filigree {

/// How a RigidMotion goes on at a moment.
struct MotionRate {
    Vec3d centre = Vec3d::Zero();   ///< m, where a point of its turn's axis is now
    Vec3d velocity = Vec3d::Zero(); ///< m/s, of that point
    Vec3d spin = Vec3d::Zero();     ///< rad/s
    Vec3d at(const Vec3d& point) const { return velocity + spin.cross(point - centre); } ///< m/s
};
/// By the keys' segment that `time` lies in, or that ends there: what has no length, a jump, has no speed.
MotionRate rate_of(const RigidMotion& motion, double time);

/// Whether keys jump after `from`, up to `until`.
bool jumps_between(const RigidMotion& motion, double from, double until);

/// How obstacles stand at a moment, and how fast their matter moves.
class ObstaclePoses {
public:
    ObstaclePoses(const World& world, double time); ///< world: outlives this

    const Eigen::Isometry3d& at(std::size_t obstacle) const { return motions_[obstacle].now; }
    /// As filigree::distance_to; of half-spaces in a few steps.
    DistanceField::Sample distance_to(std::size_t obstacle, const Vec3f& point) const {
        const Motion& motion = motions_[obstacle];
        if (!motion.is_half_space) return filigree::distance_to(world_.obstacles[obstacle], motion.now, point);
        return {float(motion.normal.dot(point.cast<double>() - motion.point)), motion.normal.cast<float>()};
    }
    Vec3f to_own_axes(std::size_t obstacle, const Vec3f& point) const;
    Vec3f to_world(std::size_t obstacle, const Vec3f& own) const;
    /// m/s, of the obstacle's matter at a point of the world.
    Vec3f velocity(std::size_t obstacle, const Vec3f& point) const;

private:
    struct Motion {
        Eigen::Isometry3d now;
        MotionRate rate;
        bool moves, is_half_space;
        Vec3d point, normal; ///< of a half-space's plane, in the world
    };
    const World& world_;
    std::vector<Motion> motions_;
};

/// Bound on the way, in m, that the matter of a moving obstacle goes between two times, near where the bodies are now.
/// Along the keys: an obstacle that goes and returns has gone its way twice. Cost O(keys), and O(particles) where an
/// obstacle turns.
double obstacle_way(const World& world, std::span<const BodyState> bodies, double from, double until);
double obstacle_way(const RigidMotion& motion, std::span<const BodyState> bodies, double from, double until);

} // namespace filigree
