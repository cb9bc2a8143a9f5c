#include "filigree/physics/obstacle_motion.h"

#include <algorithm>

namespace filigree {

namespace {

constexpr double kStep = 1e-4; ///< s, of the difference that velocities are taken from

/// How far a value goes between two times, along its keys.
double way_of(const Keyed<Vec3d>& keyed, double from, double until) {
    double way = 0;
    for (std::size_t k = 1; k < keyed.times.size(); ++k) {
        const double begin = keyed.times[k - 1], end = keyed.times[k];
        if (end <= from || begin > until) continue;
        const double length = (keyed.values[k] - keyed.values[k - 1]).norm();
        const bool is_jump = end == begin;
        way += is_jump ? length : length * (std::min(end, until) - std::max(begin, from)) / (end - begin);
    }
    return way;
}

double furthest_from(const Vec3d& point, std::span<const BodyState> bodies) {
    double squared = 0;
    for (const BodyState& body : bodies)
        for (std::size_t i = 0; i < body.positions.size() && !body.is_absent; ++i)
            squared = std::max(squared, (body.positions[i].cast<double>() - point).squaredNorm());
    return std::sqrt(squared);
}

} // namespace

ObstaclePoses::ObstaclePoses(const World& world, double time) : world_(world) {
    for (const Obstacle& obstacle : world.obstacles) {
        const bool moves = obstacle.motion.moves();
        Motion& motion = motions_.emplace_back();
        motion.now = obstacle.motion.at(time);
        motion.before = obstacle.motion.at(moves ? time - kStep : time);
        motion.after = obstacle.motion.at(moves ? time + kStep : time);
        motion.moves = moves;
        const auto* ground = std::get_if<HalfSpace>(&obstacle.shape);
        motion.is_half_space = ground != nullptr;
        motion.point = ground ? Vec3d(motion.now * ground->point) : Vec3d::Zero();
        motion.normal = ground ? Vec3d(motion.now.linear() * ground->normal.normalized()) : Vec3d::Zero();
    }
}

Vec3f ObstaclePoses::to_own_axes(std::size_t obstacle, const Vec3f& point) const {
    const Eigen::Isometry3d& now = motions_[obstacle].now;
    return (now.linear().transpose() * (point.cast<double>() - now.translation())).cast<float>();
}

Vec3f ObstaclePoses::to_world(std::size_t obstacle, const Vec3f& own) const {
    return (motions_[obstacle].now * own.cast<double>()).cast<float>();
}

Vec3f ObstaclePoses::velocity(std::size_t obstacle, const Vec3f& point) const {
    const Motion& motion = motions_[obstacle];
    if (!motion.moves) return Vec3f::Zero();
    const Vec3d own = motion.now.linear().transpose() * (point.cast<double>() - motion.now.translation());
    return ((motion.after * own - motion.before * own) / (2 * kStep)).cast<float>();
}

double obstacle_way(const World& world, std::span<const BodyState> bodies, double from, double until) {
    double most = 0;
    for (const Obstacle& obstacle : world.obstacles) {
        const RigidMotion& motion = obstacle.motion;
        if (!motion.moves()) continue;
        const double moved = way_of(motion.move, from, until), turned = way_of(motion.angle, from, until);
        // A turn by an angle vector that changes by v turns by no more than |v|.
        const double arm = turned > 0 ? furthest_from(motion.centre + motion.move.at(from), bodies) + moved : 0;
        most = std::max(most, moved + turned * arm);
    }
    return most;
}

} // namespace filigree
