// Parts of a substep.
#include "filigree/core/random.h"
#include "filigree/physics/rigid/rigid_body.h"
#include "filigree/physics/step/lost_particles.h"
#include "filigree/physics/step/simulation_state.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace filigree {

namespace {

/// Largest |F| / sqrt(3) of a cell at a frame's start: a body with more is scaled down to kStretchAfter. Uniaxial
/// stretch reaches it at 10 times the length.
constexpr float kMostStretch = 6, kStretchAfter = 2;
constexpr double kReveals = 8; ///< a frame: how often points of new cracks begin to touch others

void shake(BodyState& body, std::uint64_t seed) {
    const auto shift = [&](std::size_t number) {
        return float((random_unit(seed, number) - 0.5) * 2e-3 * body.body->spacing());
    };
    for (std::size_t i = 0; i < body.positions.size(); ++i)
        if (!body.fixed[i]) body.positions.add(i, {shift(3 * i), shift(3 * i + 1), shift(3 * i + 2)});
}

/// Returns how many particles were moved.
std::size_t scale_down(BodyState& body, float factor) {
    const std::size_t count = body.positions.size();
    Vec3d mean = Vec3d::Zero();
    std::size_t finite = 0;
    for (std::size_t i = 0; i < count; ++i) {
        if (!body.positions[i].allFinite()) continue;
        mean += body.positions[i].cast<double>();
        ++finite;
    }
    mean /= double(std::max<std::size_t>(finite, 1));
    std::size_t moved = 0;
    for (std::size_t i = 0; i < count; ++i) {
        if (body.fixed[i]) continue;
        const Vec3f from_mean = body.positions[i] - mean.cast<float>();
        const Vec3f scaled = from_mean.allFinite() ? Vec3f(factor * from_mean) : Vec3f::Zero();
        body.positions.set(i, mean.cast<float>() + scaled);
        body.velocities.set(i, Vec3f::Zero());
        ++moved;
    }
    return moved;
}

/// From the deepest of a body's surface points straight to the surface of an obstacle.
Vec3f way_out(const BodyState& body, std::size_t obstacle, const ObstaclePoses& poses) {
    DistanceField::Sample deepest{0, Vec3f::Zero()};
    for (std::size_t s = 0; s < body.surface.size(); ++s) {
        const auto found = poses.distance_to(obstacle, embedded_point(body.surface, s, body.positions));
        if (found.distance < deepest.distance) deepest = found;
    }
    return -deepest.distance * deepest.normal;
}

} // namespace

void note_deformation(FrameReport& report, std::size_t body, const ElasticReport& met) {
    report.most_stretch = std::max(report.most_stretch, met.most_stretch);
    if (!(met.least_volume_ratio < report.least_volume_ratio)) return;
    report.least_volume_ratio = met.least_volume_ratio;
    report.most_crushed = body;
}

const BodyState& SimulationState::body_of(std::size_t actor) const {
    static const BodyState nothing = free_slot();
    return has(actor) ? bodies[slot_of[actor]] : nothing;
}

const Cracks* SimulationState::cracks_of(std::size_t slot) const {
    const auto found = std::ranges::find(cracks, slot, &Cracks::whole);
    return found == cracks.end() ? nullptr : &*found;
}

float least_spacing(std::span<const BodyState> bodies) {
    float spacing = std::numeric_limits<float>::max();
    for (const BodyState& body : bodies) spacing = std::min(spacing, float(body.body->spacing()));
    return spacing;
}

void move_pins(SimulationState& state, double now, float dt, bool on_grid) {
    for (std::size_t p = 0; p < state.world.pins.size(); ++p) {
        const Pin& pin = state.world.pins[p];
        if (state.bodies[pin.body].is_on_grid != on_grid) continue;
        const Eigen::Isometry3d motion = pin.motion.at(now);
        const MotionRate rate = rate_of(pin.motion, now);
        for (std::size_t k = 0; k < pin.particles.size(); ++k) {
            const Vec3d from = state.pinned_from[p][k].cast<double>(), place = motion * from;
            const Vec3d velocity = dt > 0 ? rate.at(place) : Vec3d(Vec3d::Zero());
            each_copy(std::span(state.bodies), pin.body, pin.particles[k],
                      [&](BodyState& body, std::size_t, Index particle) {
                          body.positions.set(particle, place.cast<float>());
                          body.velocities.set(particle, velocity.cast<float>());
                      });
        }
    }
}

bool repair_start(SimulationState& state, std::span<const ElasticReport> elastic, FrameReport& report,
                  const RunContext& context) {
    bool repaired = false;
    for (std::size_t b = 0; b < state.bodies.size(); ++b) {
        if (std::abs(elastic[b].least_volume_ratio) < 1e-12f) {
            repaired = true;
            shake(state.bodies[b], context.seed + b);
            state.contacts.was_placed(b);
        }
        if (elastic[b].most_stretch <= kMostStretch) continue;
        repaired = true;
        const float factor = std::isfinite(elastic[b].most_stretch) ? kStretchAfter / elastic[b].most_stretch : 0.0f;
        const std::size_t moved = scale_down(state.bodies[b], factor);
        if (moved > 0) note_lost(state, state.bodies[b], 0);
        report.clamped_particles += moved;
        state.contacts.was_placed(b);
    }
    return repaired;
}

void make_way(SimulationState& state, std::size_t obstacle, double now) {
    constexpr int kPasses = 3; // round the corners of a cuboid
    if (std::holds_alternative<MeshObstacle>(state.world.obstacles[obstacle].shape)) return;
    const ObstaclePoses poses(state.world, now);
    for (std::size_t b = 0; b < state.bodies.size(); ++b) {
        BodyState& body = state.bodies[b];
        if (body.is_absent || body.rigid || state.is_piece(b)) continue; // they have to move alike
        if (std::ranges::any_of(body.fixed, [](std::uint8_t fixed) { return fixed != 0; })) continue;
        for (int pass = 0; pass < kPasses; ++pass) {
            const Vec3f out = way_out(body, obstacle, poses);
            if (out.isZero(0)) break;
            for (std::size_t i = 0; i < body.positions.size(); ++i) body.positions.add(i, out);
            state.contacts.was_moved(b, out.norm());
        }
    }
}

void make_way(SimulationState& state, double before, double now) {
    for (std::size_t o = 0; o < state.world.obstacles.size(); ++o)
        if (jumps_between(state.world.obstacles[o].motion, before, now)) make_way(state, o, now);
}

void push_out(SimulationState& state, double now, const RunContext& context) {
    for (Cracks& cracks : state.cracks) cracks.remember_places(state.bodies);
    state.contacts.push_out(state.bodies, now, context);
    bool any = false;
    for (std::size_t b = 0; b < state.bodies.size(); ++b) {
        BodyState& body = state.bodies[b];
        if (!(body.pushed_way > 0)) continue;
        any = true;
        state.contacts.was_moved(b, std::exchange(body.pushed_way, 0.0f));
        if (body.rigid) fit_pose(body);
    }
    if (!any) return;
    for (const Cracks& cracks : state.cracks) cracks.rejoin(state.bodies);
}

Breaks break_bodies(SimulationState& state, double before, double now, const RunContext& context) {
    Breaks breaks;
    // A search for each substep in which something lets go would take longer than all else.
    const auto part = [&](double time) {
        return std::floor((time - state.time()) / state.frame_seconds() * kReveals + 1e-6);
    };
    for (Cracks& cracks : state.cracks) {
        const bool was_open = cracks.is_open();
        breaks.forces |= cracks.advance(state.bodies, now, context);
        if (part(before) != part(now) || was_open != cracks.is_open())
            breaks.contacts |= cracks.reveal(state.bodies) || was_open != cracks.is_open();
    }
    if (!breaks.contacts) return breaks;
    state.contacts.begin_anew();
    state.rigid_pairs.begin_anew();
    state.external.find_wind(state.bodies, now, state.options.frames_per_second, context);
    return breaks;
}

void finish_substep(SimulationState& state, float dt, const RunContext& context) {
    for (BodyState& body : state.bodies)
        if (!body.is_on_grid && !body.is_absent) body.elasticity->finish_substep(body.positions, dt, context);
}

} // namespace filigree
