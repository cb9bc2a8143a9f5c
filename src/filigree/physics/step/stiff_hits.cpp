#include "filigree/physics/step/stiff_hits.h"

#include "filigree/physics/step/vibration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace filigree {

namespace {

constexpr double kStiffWaves = 250;  ///< m/s: rubber 60, glass that breaks 120, stone 650, wood 1,500
constexpr double kLongestHit = 4;    ///< of a body's slowest vibrations
constexpr double kSlowestHit = 0.02; ///< m/s
constexpr double kMostTaken = 0.9;   ///< of vibrations, by a bounce

/// Two things that part, or one that leaves an obstacle.
struct Parting {
    BodyState* body;
    BodyState* other; ///< null: an obstacle
    Vec3d normal, place;
    double approach, leaving; ///< m/s, along the normal
    double gives;             ///< 1/kg
};

double gives_at(const RigidState& state, const Vec3d& place, const Vec3d& normal) {
    const Vec3d turning = state.angular_velocity_of((place - state.centre).cross(normal));
    return 1 / state.mass + normal.dot(turning.cross(place - state.centre));
}

void push(BodyState& body, const Vec3d& place, const Vec3d& impulse) {
    const RigidState state = rigid_state(body);
    const Vec3d velocity = impulse / state.mass;
    const Vec3d spin = state.angular_velocity_of((place - state.centre).cross(impulse));
    for (std::size_t i = 0; i < body.positions.size(); ++i)
        body.velocities.add(i, (velocity + spin.cross(body.positions[i].cast<double>() - state.centre)).cast<float>());
}

Vec3d came_with(const BodyHit& hit, const Vec3d& place) { return hit.velocity + hit.spin.cross(place - hit.centre); }

Parting parting_of(BodyState& body, BodyState* other) {
    const BodyLoad& load = body.hit.pushed;
    const Vec3d normal = load.normal.normalized(), place = load.place / load.force,
                wall = load.other_velocity / load.force;
    const RigidState state = rigid_state(body);
    Parting parting{&body, other, normal, place, 0, 0, gives_at(state, place, normal)};
    Vec3d came = came_with(body.hit, place), leaves = MotionOf(state).at(place);
    if (other) {
        const RigidState others = rigid_state(*other);
        came -= came_with(other->hit, place);
        leaves -= MotionOf(others).at(place);
        parting.gives += gives_at(others, place, normal);
    } else {
        came -= wall;
        leaves -= wall;
    }
    parting.approach = -came.dot(normal);
    parting.leaving = leaves.dot(normal);
    return parting;
}

void scale_vibrations(const Parting& parting, double factor) {
    scale_vibration(*parting.body, factor);
    if (parting.other) scale_vibration(*parting.other, factor);
}

/// Whether they now part as fast as they should: more comes as vibration swings on, so that it may be asked again.
bool bounce(const Parting& parting, double restitution) {
    if (!(parting.approach > kSlowestHit)) return true;
    const double left = parting.leaving, gives = parting.gives;
    const double wanted = (restitution * parting.approach - left) / gives;
    double impulse = wanted;
    if (wanted > 0) {
        const double has = vibration_energy(*parting.body) + (parting.other ? vibration_energy(*parting.other) : 0);
        impulse = std::min(wanted, (std::sqrt(left * left + 2 * gives * kMostTaken * has) - left) / gives);
        const double taken = impulse * left + 0.5 * gives * impulse * impulse;
        if (!(impulse > 0) || !(taken < has)) return false;
        scale_vibrations(parting, std::sqrt(1 - std::max(0.0, taken) / has));
    } else {
        scale_vibrations(parting, restitution);
    }
    push(*parting.body, parting.place, impulse * parting.normal);
    if (parting.other) push(*parting.other, parting.place, -impulse * parting.normal);
    return impulse == wanted;
}

void begin_hit(BodyState& body) {
    const MotionOf motion(rigid_state(body));
    body.hit = {0, {}, motion.centre, motion.velocity, motion.spin};
}

bool was_a_hit(const BodyState& body) {
    const double longest = kLongestHit * 2 * std::numbers::pi / lowest_frequency(*body.body);
    return body.hit.pushed.force > 0 && body.hit.seconds < longest &&
           std::ranges::none_of(body.fixed, [](std::uint8_t fixed) { return fixed != 0; });
}

/// Of a body whose hit has ended: itself, and the body that it parts from, or none where it parts from an obstacle.
/// Both none (bodies.size()): it was no single hit.
std::array<std::size_t, 2> partners(std::span<const BodyState> bodies, std::span<const std::size_t> ended,
                                    std::size_t b) {
    const std::size_t none = bodies.size();
    const double by = bodies[b].hit.pushed.other;
    if (!was_a_hit(bodies[b])) return {none, none};
    if (by == BodyLoad::kObstacle) return {b, none};
    if (by < 0) return {none, none};
    const auto other = std::size_t(by);
    const bool both = std::ranges::binary_search(ended, other) && bodies[other].hit.pushed.other == double(b);
    return both && was_a_hit(bodies[other]) ? std::array{b, other} : std::array{none, none};
}

} // namespace

bool is_stiff(const Material& material) {
    return material.model != MaterialModel::rigid && material.model != MaterialModel::mpm && !material.is_plastic() &&
           pressure_wave_speed(material) > kStiffWaves;
}

void follow_hits(std::span<BodyState> bodies, const Contacts& contacts, double dt) {
    std::vector<std::size_t> ended;
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        BodyState& body = bodies[b];
        if (!body.is_stiff || body.sleeps()) continue;
        const BodyLoad& load = contacts.load(b);
        if (load.force > 0) {
            if (body.hit.seconds < 0) begin_hit(body);
            body.hit.pushed.add(load, dt);
            body.hit.seconds += dt;
        } else if (body.hit.seconds >= 0 && load.other == BodyLoad::kNothing) {
            ended.push_back(b);
        }
    }
    std::vector<std::size_t> done;
    for (const std::size_t b : ended) {
        const auto [first, second] = partners(bodies, ended, b);
        if (second < first) continue; // told by the other
        BodyState* const other = second < bodies.size() ? &bodies[second] : nullptr;
        const BodyLoad& load = bodies[b].hit.pushed;
        if (first == bodies.size() || bounce(parting_of(bodies[b], other), load.restitution / load.force)) {
            done.push_back(b);
            if (other) done.push_back(second);
        }
    }
    for (const std::size_t b : ended) bodies[b].hit.seconds += dt; // it waits for more
    for (const std::size_t b : done) bodies[b].hit = {};
}

} // namespace filigree
