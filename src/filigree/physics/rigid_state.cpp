#include "filigree/physics/rigid_state.h"

#include <Eigen/Cholesky>

namespace filigree {

Vec3d RigidState::angular_velocity_of(const Vec3d& momentum) const {
    return (inertia + 1e-12 * inertia.trace() * Mat3d::Identity()).ldlt().solve(momentum);
}

RigidState rigid_state(const BodyState& body) {
    RigidState state;
    const std::vector<float>& mass = body.body->mass;
    for (std::size_t i = 0; i < mass.size(); ++i) {
        const double m = double(mass[i]);
        state.mass += m;
        state.centre += m * body.positions[i].cast<double>();
        state.linear += m * body.velocities[i].cast<double>();
    }
    state.centre /= state.mass;
    for (std::size_t i = 0; i < mass.size(); ++i) {
        const double m = double(mass[i]);
        const Vec3d r = body.positions[i].cast<double>() - state.centre;
        state.angular += m * r.cross(body.velocities[i].cast<double>());
        state.inertia += m * (r.squaredNorm() * Mat3d::Identity() - r * r.transpose());
    }
    return state;
}

RigidState together(const RigidState& a, const RigidState& b) {
    RigidState both;
    both.mass = a.mass + b.mass;
    if (!(both.mass > 0)) return both;
    both.centre = (a.mass * a.centre + b.mass * b.centre) / both.mass;
    both.linear = a.linear + b.linear;
    for (const RigidState& part : {a, b}) {
        const Vec3d arm = part.centre - both.centre;
        both.angular += part.angular + arm.cross(part.linear);
        both.inertia += part.inertia + part.mass * (arm.squaredNorm() * Mat3d::Identity() - arm * arm.transpose());
    }
    return both;
}

} // namespace filigree
