#include "filigree/physics/step/set_motion.h"

#include "filigree/core/math.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace filigree {

namespace {

constexpr double kEver = 1 << 20; ///< s, a power of two: rates stay as they are, to the last digit

Mat3d turn_by(const Vec3d& angle) {
    const double radians = angle.norm();
    return radians > 0 ? math::matrix(Eigen::AngleAxisd(radians, angle / radians)) : Mat3d(Mat3d::Identity());
}

/// Axis times radians of a turn; with whole turns added until it is as near as can be to what is expected.
Vec3d angle_of(const Mat3d& turn, const Vec3d& expected) {
    const Vec3d rest = [&] {
        const Eigen::AngleAxisd more = math::angle_axis(turn * turn_by(expected).transpose());
        return Vec3d(more.angle() * more.axis());
    }();
    if (!(rest.norm() > 1e-12)) return expected;
    const Eigen::AngleAxisd whole = math::angle_axis(turn);
    const double turns = std::round((expected.dot(whole.axis()) - whole.angle()) / (2 * std::numbers::pi));
    return (whole.angle() + 2 * std::numbers::pi * turns) * whole.axis();
}

} // namespace

Eigen::Isometry3d moved_on(const Eigen::Isometry3d& pose, const Vec3d& pivot, const Vec3d& velocity, const Vec3d& spin,
                           double seconds) {
    Eigen::Isometry3d moved = Eigen::Isometry3d::Identity();
    moved.linear() = turn_by(seconds * spin) * pose.linear();
    moved.translation() = pose * pivot + seconds * velocity - moved.linear() * pivot;
    return moved;
}

SetMotion set_motion(const Obstacle& obstacle, std::size_t number, const Course& course, double begin, double reached) {
    const Vec3d pivot = pivot_of(obstacle);
    SetMotion set{.obstacle = number, .begin = begin, .reached = reached};
    std::ranges::copy_n(course.from.matrix().topRows<3>().eval().data(), 12, set.pose.begin());
    set.move = course.to * pivot - course.from * pivot;
    set.angle = angle_of(course.to.linear() * course.from.linear().transpose(), (reached - begin) * course.turning);
    set.velocity = course.velocity;
    set.spin = course.spin;
    return set;
}

RigidMotion motion_of(const SetMotion& set, const Obstacle& obstacle) {
    RigidMotion motion;
    motion.start.matrix().topRows<3>() = Eigen::Map<const Eigen::Matrix<double, 3, 4>>(set.pose.data());
    motion.centre = motion.start * pivot_of(obstacle);
    const auto keys = [&](const Vec3d& first, const Vec3d& rate) -> Keyed<Vec3d> {
        if (first.isZero(0) && rate.isZero(0)) return {{}, {}, Vec3d::Zero()};
        if (rate.isZero(0)) return {{set.begin, set.reached}, {Vec3d::Zero(), first}, Vec3d::Zero()};
        return {{set.begin, set.reached, set.reached + kEver}, {Vec3d::Zero(), first, first + kEver * rate}, first};
    };
    motion.move = keys(set.move, set.velocity);
    motion.angle = keys(set.angle, set.spin);
    return motion;
}

bool is_sound(const SetMotion& set, std::size_t obstacles) {
    const Eigen::Map<const Eigen::Matrix<double, 3, 4>> pose(set.pose.data());
    const Mat3d turn = pose.leftCols<3>();
    const bool is_turn = (turn.transpose() * turn - Mat3d::Identity()).norm() < 1e-6;
    return set.obstacle < obstacles && is_turn && pose.allFinite() && std::isfinite(set.begin) &&
           std::isfinite(set.reached) && set.begin < set.reached && set.move.allFinite() && set.angle.allFinite() &&
           set.velocity.allFinite() && set.spin.allFinite();
}

} // namespace filigree
