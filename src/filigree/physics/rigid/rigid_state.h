// The rigid part of a body's motion. Private to the layer.
#pragma once

#include "filigree/physics/body/body_state.h"

namespace filigree {

struct RigidState {
    double mass = 0;                                                               ///< kg
    Vec3d centre = Vec3d::Zero(), linear = Vec3d::Zero(), angular = Vec3d::Zero(); ///< angular: about the centre
    Mat3d inertia = Mat3d::Zero();                                                 ///< kg m^2, about the centre

    /// The angular velocity that has this angular momentum, 1/s.
    Vec3d angular_velocity_of(const Vec3d& momentum) const;
};

RigidState rigid_state(const BodyState& body);
/// Of both as one body.
RigidState together(const RigidState& a, const RigidState& b);

} // namespace filigree
