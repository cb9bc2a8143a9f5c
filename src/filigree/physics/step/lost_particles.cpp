#include "filigree/physics/step/lost_particles.h"

#include "filigree/core/dense_solve.h"
#include "filigree/physics/rigid/rigid_body.h"
#include "filigree/physics/rigid/rigid_state.h"

#include <algorithm>
#include <tuple>

namespace filigree {

namespace {

constexpr std::size_t kFewest = 4; ///< particles that tell how a body is turned

/// How a body stands and moves as a whole.
struct WholeMotion {
    Vec3d rest_centre = Vec3d::Zero(), centre = Vec3d::Zero(); ///< m
    Mat3d turn = Mat3d::Identity();                            ///< from rest
    Vec3d velocity = Vec3d::Zero(), spin = Vec3d::Zero();      ///< m/s, rad/s

    Vec3d place(const Vec3d& rest) const { return centre + turn * (rest - rest_centre); }
    Vec3d velocity_at(const Vec3d& place) const { return velocity + spin.cross(place - centre); }
};

/// Of the particles that are not lost, by mass.
WholeMotion motion_of(const BodyState& body, const Vectors& rest, std::span<const std::uint8_t> is_lost) {
    WholeMotion motion;
    double mass = 0;
    std::size_t count = 0;
    const auto each = [&](const auto& visit) {
        for (std::size_t i = 0; i < is_lost.size(); ++i)
            if (!is_lost[i])
                visit(double(body.body->mass[i]), rest[i].cast<double>(), body.positions[i].cast<double>(),
                      body.velocities[i].cast<double>());
    };
    each([&](double m, const Vec3d& from, const Vec3d& to, const Vec3d& velocity) {
        motion.rest_centre += m * from;
        motion.centre += m * to;
        motion.velocity += m * velocity;
        mass += m;
        ++count;
    });
    motion.turn = body.placement.linear();
    if (!(mass > 0)) {
        motion.centre = body.placement.translation();
        return motion;
    }
    motion.rest_centre /= mass;
    motion.centre /= mass;
    motion.velocity /= mass;
    RigidState rigid;
    Mat3d moment = Mat3d::Zero();
    each([&](double m, const Vec3d& from, const Vec3d& to, const Vec3d& velocity) {
        const Vec3d arm = to - motion.centre;
        moment += m * arm * (from - motion.rest_centre).transpose();
        rigid.angular += m * arm.cross(velocity - motion.velocity);
        rigid.inertia += m * (arm.squaredNorm() * Mat3d::Identity() - arm * arm.transpose());
    });
    if (count < kFewest) return motion;
    if (const Mat3d turn = nearest_rotation(moment); turn.allFinite()) motion.turn = turn;
    if (const Vec3d spin = rigid.angular_velocity_of(rigid.angular); spin.allFinite()) motion.spin = spin;
    return motion;
}

} // namespace

std::size_t hold_lost_particles(SimulationState& state, BodyState& body) {
    if (body.is_absent && !body.is_on_grid) return 0;
    std::vector<std::uint8_t> is_lost(body.positions.size());
    std::size_t lost = 0;
    for (std::size_t i = 0; i < is_lost.size(); ++i) {
        is_lost[i] = !(body.positions[i].allFinite() && body.velocities[i].allFinite());
        lost += is_lost[i];
    }
    if (lost > 0) {
        const Vectors& rest = body.body->rest;
        const WholeMotion motion = motion_of(body, rest, is_lost);
        for (std::size_t i = 0; i < is_lost.size(); ++i) {
            if (!is_lost[i]) continue;
            if (!body.positions[i].allFinite())
                body.positions.set(i, motion.place(rest[i].cast<double>()).cast<float>());
            body.velocities.set(i, motion.velocity_at(body.positions[i].cast<double>()).cast<float>());
        }
        note_lost(state, body, std::size_t(std::ranges::find(is_lost, 1) - is_lost.begin()));
        if (body.rigid) fit_pose(body);
    }
    return body.is_on_grid ? state.grid->repair(body.actor, body.positions, body.velocities, is_lost) : lost;
}

void note_lost(SimulationState& state, const BodyState& body, std::size_t particle) {
    if (!state.first_lost) state.first_lost = {body.actor, body.positions[particle]};
}

void tell_first_lost(SimulationState& state, FrameReport& report) {
    if (state.first_lost) std::tie(report.clamped_body, report.clamped_at) = *state.first_lost;
    state.first_lost.reset();
}

std::size_t hold_lost_particles(SimulationState& state) {
    std::size_t held = 0;
    for (BodyState& body : state.bodies) held += hold_lost_particles(state, body);
    return held;
}

} // namespace filigree
