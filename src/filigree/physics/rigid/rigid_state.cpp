#include "filigree/physics/rigid/rigid_state.h"

#include "filigree/core/dense_solve.h"

namespace filigree {

Vec3d RigidState::angular_velocity_of(const Vec3d& momentum) const {
    return solve_semidefinite(Mat3d(inertia + 1e-12 * inertia.trace() * Mat3d::Identity()), momentum);
}

namespace {

/// Sums over particles in so many parts, so that the compiler uses vectors.
struct Sum {
    static constexpr std::size_t kParts = 8;
    double parts[kParts] = {};
    double all() const {
        double sum = 0;
        for (const double part : parts) sum += part;
        return sum;
    }
};

} // namespace

/// Moments about the first particle, then about the centre.
RigidState rigid_state(const BodyState& body) {
    const float* const mass = body.body->mass.data();
    const auto& [x, y, z] = body.positions;
    const auto& [vx, vy, vz] = body.velocities;
    const double x0 = double(x[0]), y0 = double(y[0]), z0 = double(z[0]);
    Sum m, mx, my, mz, mvx, mvy, mvz, lx, ly, lz, xx, yy, zz, xy, xz, yz;
    const auto add = [&](std::size_t i, std::size_t k) {
        const double w = double(mass[i]);
        const double px = double(x[i]) - x0, py = double(y[i]) - y0, pz = double(z[i]) - z0;
        const double ux = w * double(vx[i]), uy = w * double(vy[i]), uz = w * double(vz[i]);
        const double wx = w * px, wy = w * py, wz = w * pz;
        m.parts[k] += w;
        mx.parts[k] += wx;
        my.parts[k] += wy;
        mz.parts[k] += wz;
        mvx.parts[k] += ux;
        mvy.parts[k] += uy;
        mvz.parts[k] += uz;
        lx.parts[k] += py * uz - pz * uy;
        ly.parts[k] += pz * ux - px * uz;
        lz.parts[k] += px * uy - py * ux;
        xx.parts[k] += wx * px;
        yy.parts[k] += wy * py;
        zz.parts[k] += wz * pz;
        xy.parts[k] += wx * py;
        xz.parts[k] += wx * pz;
        yz.parts[k] += wy * pz;
    };
    const std::size_t count = body.body->mass.size(), whole = count - count % Sum::kParts;
    for (std::size_t i = 0; i < whole; i += Sum::kParts)
        for (std::size_t k = 0; k < Sum::kParts; ++k) add(i + k, k);
    for (std::size_t i = whole; i < count; ++i) add(i, 0);

    RigidState state;
    state.mass = m.all();
    state.linear = {mvx.all(), mvy.all(), mvz.all()};
    const Vec3d arm = Vec3d(mx.all(), my.all(), mz.all()) / state.mass;
    state.centre = Vec3d(x0, y0, z0) + arm;
    state.angular = Vec3d(lx.all(), ly.all(), lz.all()) - arm.cross(state.linear);
    Mat3d moment;
    moment << xx.all(), xy.all(), xz.all(), xy.all(), yy.all(), yz.all(), xz.all(), yz.all(), zz.all();
    moment -= state.mass * arm * arm.transpose();
    state.inertia = moment.trace() * Mat3d::Identity() - moment;
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
