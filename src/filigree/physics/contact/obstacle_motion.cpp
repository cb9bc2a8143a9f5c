#include "filigree/physics/contact/obstacle_motion.h"

#include "filigree/core/math.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

constexpr double kSameTime = 1e-9; ///< s: frames end on keys, but for rounding

/// Change in a second, along the keys.
Vec3d rate_of(const Keyed<Vec3d>& keyed, double time) {
    const std::vector<double>& times = keyed.times;
    const auto segment = [&](std::size_t end) -> Vec3d {
        return (keyed.values[end] - keyed.values[end - 1]) / (times[end] - times[end - 1]);
    };
    for (std::size_t k = 1; k < times.size(); ++k)
        if (times[k] == times[k - 1] && std::abs(times[k] - time) < kSameTime) return Vec3d::Zero();
    for (std::size_t k = 1; k < times.size(); ++k) {
        if (times[k] == times[k - 1] || times[k] + kSameTime < time) continue;
        return time < times[k - 1] - kSameTime ? Vec3d(Vec3d::Zero()) : segment(k);
    }
    return Vec3d::Zero();
}

/// rad/s of a turn by `angle` (axis times radians) that changes by `rate` in a second.
Vec3d spin_of(const Vec3d& angle, const Vec3d& rate) {
    const double radians = angle.norm();
    if (radians < 1e-6) return rate + 0.5 * angle.cross(rate);
    const Vec3d axis = angle / radians;
    const double along = math::sin(radians) / radians, across = (1 - math::cos(radians)) / radians;
    return along * rate + (1 - along) * axis.dot(rate) * axis + across * axis.cross(rate);
}

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

bool has_jump(const Keyed<Vec3d>& keyed, double from, double until) {
    for (std::size_t k = 1; k < keyed.times.size(); ++k)
        if (keyed.times[k] == keyed.times[k - 1] && keyed.times[k] > from && keyed.times[k] <= until &&
            keyed.values[k] != keyed.values[k - 1])
            return true;
    return false;
}

double furthest_from(const Vec3d& point, std::span<const BodyState> bodies) {
    double squared = 0;
    for (const BodyState& body : bodies)
        for (std::size_t i = 0; i < body.positions.size() && !body.is_absent; ++i)
            squared = std::max(squared, (body.positions[i].cast<double>() - point).squaredNorm());
    return std::sqrt(squared);
}

} // namespace

MotionRate rate_of(const RigidMotion& motion, double time) {
    return {motion.centre + motion.move.at(time), rate_of(motion.move, time),
            spin_of(motion.angle.at(time), rate_of(motion.angle, time))};
}

bool jumps_between(const RigidMotion& motion, double from, double until) {
    return has_jump(motion.move, from, until) || has_jump(motion.angle, from, until);
}

ObstaclePoses::ObstaclePoses(const World& world, double time) : world_(world) {
    for (const Obstacle& obstacle : world.obstacles) {
        const bool moves = obstacle.motion.moves();
        Motion& motion = motions_.emplace_back();
        motion.now = obstacle.motion.at(time);
        if (moves) motion.rate = rate_of(obstacle.motion, time);
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
    return motion.moves ? Vec3f(motion.rate.at(point.cast<double>()).cast<float>()) : Vec3f(Vec3f::Zero());
}

double obstacle_way(const RigidMotion& motion, std::span<const BodyState> bodies, double from, double until) {
    if (!motion.moves()) return 0;
    const double moved = way_of(motion.move, from, until), turned = way_of(motion.angle, from, until);
    // A turn by an angle vector that changes by v turns by no more than |v|.
    const double arm = turned > 0 ? furthest_from(motion.centre + motion.move.at(from), bodies) + moved : 0;
    return moved + turned * arm;
}

double obstacle_way(const World& world, std::span<const BodyState> bodies, double from, double until) {
    double most = 0;
    for (const Obstacle& obstacle : world.obstacles)
        most = std::max(most, obstacle_way(obstacle.motion, bodies, from, until));
    return most;
}

} // namespace filigree
