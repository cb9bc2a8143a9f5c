// How an obstacle goes on that was set while a simulation runs. Private to the layer.
#pragma once

#include "filigree/physics/world.h"

#include <array>

namespace filigree {

/// From `begin` on an obstacle goes from where it stands, to `reached` evenly, and from there on at a constant pace.
/// Saved as it is.
struct SetMotion {
    std::uint64_t obstacle = 0;
    std::array<double, 12> pose = {};                     ///< at `begin`, from its own axes, column by column
    double begin = 0, reached = 0;                        ///< s
    Vec3d move = Vec3d::Zero(), angle = Vec3d::Zero();    ///< until `reached`: of its pivot, m; axis times radians
    Vec3d velocity = Vec3d::Zero(), spin = Vec3d::Zero(); ///< afterwards, m/s and rad/s
};

/// What a SetMotion is made of.
struct Course {
    Eigen::Isometry3d from = Eigen::Isometry3d::Identity(); ///< where it stands at `begin`
    Eigen::Isometry3d to = Eigen::Isometry3d::Identity();   ///< where it is at `reached`
    Vec3d velocity = Vec3d::Zero(), spin = Vec3d::Zero();   ///< afterwards
    Vec3d turning = Vec3d::Zero();                          ///< rad/s about, in between: of turns that are the same ...
};                                                          ///< ... the one is meant that is the nearest to it
SetMotion set_motion(const Obstacle& obstacle, std::size_t number, const Course& course, double begin, double reached);
/// As the world has it.
RigidMotion motion_of(const SetMotion& set, const Obstacle& obstacle);
/// Where something stands a while later that moves its pivot so, and turns about it.
Eigen::Isometry3d moved_on(const Eigen::Isometry3d& pose, const Vec3d& pivot, const Vec3d& velocity, const Vec3d& spin,
                           double seconds);
bool is_sound(const SetMotion& set, std::size_t obstacles);

} // namespace filigree
