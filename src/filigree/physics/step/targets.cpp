#include "filigree/physics/step/targets.h"

#include "filigree/core/parallel_for.h"
#include "filigree/physics/step/simulation_state.h"

#include <array>
#include <cmath>
#include <numbers>

namespace filigree {

namespace {

constexpr std::size_t kTargetsGrain = 2048; ///< particles
constexpr std::size_t kBlock = 64;          ///< particles that are worked out at once
constexpr double kLeash = 2;                ///< spacings
constexpr float kJump = 0.25f;              ///< spacings
constexpr float kLeastSquare = 1e-24f;      ///< m^2: what moves less in two frames stands
constexpr float kMostSpeed = 3;             ///< times the mean of a frame: a cubic curve overshoots beyond it
/// Of 1 / substep^2: with a stiffer spring Verlet's steps, which kSafety has near their limit, would be unstable.
constexpr float kStiffest = 0.5f;
constexpr float kLeashDamping = 0.5f; ///< of critical
constexpr float kMostGrowth = 8;      ///< of a rest shape, in any direction

float squared_rate(double hertz) {
    const double rate = 2 * std::numbers::pi * hertz;
    return float(std::min(rate * rate, 1e30));
}

Vec3f no_longer(const Vec3f& v, float most) {
    const float length = v.norm();
    return length > most ? Vec3f(most / length * v) : v;
}
/// Whether all eigenvalues of a symmetric matrix are above 0 [Sylvester].
bool is_positive(const Mat3f& m) {
    return m(0, 0) > 0 && m(0, 0) * m(1, 1) - m(0, 1) * m(1, 0) > 0 && m.determinant() > 0;
}

/// Of a saved state: none, or as many that a cell can have.
bool is_sound(std::span<const RestStretch> stretches, std::size_t count) {
    std::vector<Mat3f> matrices;
    for (const RestStretch& s : stretches) {
        Mat3f& m = matrices.emplace_back();
        m << s[0], s[3], s[4], s[3], s[1], s[5], s[4], s[5], s[2];
    }
    return check_stretches(matrices, count).empty();
}

/// What is left of a vector when so much is taken off its length.
Vec3f beyond(const Vec3f& v, float most) {
    const float length = v.norm();
    return length > most ? Vec3f((1 - most / length) * v) : Vec3f(Vec3f::Zero());
}

} // namespace

Vectors target_velocities(const Vectors& before, const Vectors& now, const Vectors& after, double frames_per_second) {
    Vectors velocities(now.size());
    const auto rate = float(frames_per_second);
    for (std::size_t i = 0; i < now.size(); ++i) {
        const Vec3f come = now[i] - before[i], go = after[i] - now[i];
        const float came = come.squaredNorm(), goes = go.squaredNorm(), both = came + goes;
        if (both > kLeastSquare) velocities.set(i, rate / both * (goes * come + came * go));
    }
    return velocities;
}

std::string check_follow(const Follow& follow, std::size_t count) {
    if (follow.frequency.size() != count)
        return "follow.frequency has " + std::to_string(follow.frequency.size()) + " numbers for " +
               std::to_string(count) + " particles.";
    const auto fits = [&](const std::vector<float>& list) { return list.size() == count || list.size() == 1; };
    const auto misfit = [&](const char* name, const std::vector<float>& list) {
        return "follow." + std::string(name) + " has " + std::to_string(list.size()) + " numbers for " +
               std::to_string(count) + " particles; give one a particle, or one for all.";
    };
    if (!fits(follow.damping)) return misfit("damping", follow.damping);
    if (!follow.leash.empty() && !fits(follow.leash)) return misfit("leash", follow.leash);
    for (std::size_t i = 0; i < count; ++i)
        if (!(follow.frequency[i] >= 0)) return "follow.frequency[" + std::to_string(i) + "] must be 0 or more.";
    for (std::size_t i = 0; i < follow.damping.size(); ++i)
        if (!(follow.damping[i] >= 0 && std::isfinite(follow.damping[i])))
            return "follow.damping[" + std::to_string(i) + "] must be 0 or more, and finite.";
    for (std::size_t i = 0; i < follow.leash.size(); ++i)
        if (!(follow.leash[i] > 0)) return "follow.leash[" + std::to_string(i) + "] must be above 0.";
    if (!(follow.leash_frequency >= 0 && std::isfinite(follow.leash_frequency)))
        return "follow.leash_frequency must be 0 or more, and finite.";
    if (!(follow.most_acceleration > 0)) return "follow.most_acceleration must be above 0.";
    if (follow.contact_gap && !(*follow.contact_gap >= 0 && std::isfinite(*follow.contact_gap)))
        return "follow.contact_gap must be 0 or more, and finite.";
    if (!follow.groups.empty() && follow.groups.size() != count)
        return "follow.groups has " + std::to_string(follow.groups.size()) + " numbers for " + std::to_string(count) +
               " particles.";
    if (follow.groups.empty() && !follow.passing.empty()) return "follow.passing needs follow.groups.";
    return "";
}

std::string check_stretches(std::span<const Mat3f> stretches, std::size_t count) {
    if (stretches.empty()) return "";
    if (stretches.size() != count)
        return "stretches has " + std::to_string(stretches.size()) + " matrices for " + std::to_string(count) +
               " particles.";
    for (std::size_t i = 0; i < count; ++i) {
        const Mat3f& m = stretches[i];
        if (!m.allFinite() || !((m - m.transpose()).norm() <= 1e-4f * m.norm()))
            return "stretches[" + std::to_string(i) + "] must be symmetric and finite.";
        const Mat3f above = m - Mat3f::Identity() / kMostGrowth, below = Mat3f::Identity() * kMostGrowth - m;
        if (!is_positive(above) || !is_positive(below))
            return "stretches[" + std::to_string(i) + "] must shrink and grow by no more than eight times.";
    }
    return "";
}

std::vector<RestStretch> rest_stretches(std::span<const Mat3f> stretches) {
    std::vector<RestStretch> of;
    for (const Mat3f& m : stretches) of.push_back({m(0, 0), m(1, 1), m(2, 2), m(0, 1), m(0, 2), m(1, 2)});
    return of;
}

Targets::Targets(std::size_t actor, Follow follow, const Vectors& positions, const Vectors& velocities, double spacing)
    : leash_pull(squared_rate(follow.leash_frequency)), leash_damping(2 * kLeashDamping * std::sqrt(leash_pull)),
      most_acceleration(float(follow.most_acceleration)), jump(kJump * float(spacing)) {
    memory.actor = actor;
    memory.from = positions;
    memory.from_velocities = velocities;
    leashes = follow.leash.empty() ? std::vector<float>{float(kLeash * spacing)} : std::move(follow.leash);
    leashes.resize(positions.size(), leashes.front());
    dampings = std::move(follow.damping);
    dampings.resize(positions.size(), dampings.front());
    for (Index i = 0; i < follow.frequency.size(); ++i) {
        const bool is_held = std::isinf(follow.frequency[i]);
        if (is_held) held.push_back(i);
        pulls.push_back(is_held ? 0 : squared_rate(double(follow.frequency[i])));
    }
}

void Targets::set(const Vectors& positions, const Vectors& velocities, const Vectors& accelerations,
                  std::vector<RestStretch> stretches) {
    memory.to = positions;
    memory.to_velocities = velocities;
    memory.accelerations = accelerations;
    memory.to_stretches = std::move(stretches);
    memory.is_set = 1;
}

bool Targets::takes(const TargetsMemory& saved) const {
    const std::size_t count = pulls.size(), end = saved.is_set == 1 ? count : 0;
    const std::size_t felt = saved.accelerations.size();
    return saved.actor == memory.actor && saved.is_set <= 1 && saved.from.size() == count &&
           saved.from_velocities.size() == count && saved.to.size() == end && saved.to_velocities.size() == end &&
           (felt == 0 || felt == end) && is_sound(saved.from_stretches, count) && is_sound(saved.to_stretches, end) &&
           is_finite(saved.from) && is_finite(saved.from_velocities) && is_finite(saved.to) &&
           is_finite(saved.to_velocities) && is_finite(saved.accelerations);
}

void Targets::end_frame() {
    memory.from = std::move(memory.to);
    memory.from_velocities = std::move(memory.to_velocities);
    memory.from_stretches = std::move(memory.to_stretches);
    memory.to = memory.to_velocities = memory.accelerations = {};
    memory.to_stretches = {};
    memory.is_set = 0;
}

Vectors Targets::begin_frame(float seconds) {
    if (!memory.is_set) set(memory.from, Vectors(memory.from.size()), {}, memory.from_stretches);
    const std::size_t count = memory.from.size();
    course = {Vectors(count), Vectors(count), memory.accelerations};
    Vectors jumps(count);
    bool jumps_at_all = false, feels = course.felt.size() > 0;
    if (!feels) course.felt = Vectors(count);
    for (std::size_t i = 0; i < count; ++i) {
        const Vec3f way = memory.to[i] - memory.from[i];
        const float most = kMostSpeed * way.norm() / seconds;
        const Vec3f begins = no_longer(memory.from_velocities[i], most),
                    ends = no_longer(memory.to_velocities[i], most);
        const Vec3f left = beyond(way - 0.5f * seconds * (begins + ends), jump);
        if (!left.isZero(0)) {
            jumps_at_all = true;
            jumps.set(i, left);
            memory.from.add(i, left);
        }
        course.from_velocities.set(i, begins);
        course.to_velocities.set(i, ends);
        const Vec3f carried = beyond((ends - begins) / seconds, most_acceleration);
        if (!carried.isZero(0)) {
            feels = true;
            course.felt.add(i, carried);
        }
    }
    if (!feels) course.felt = {};
    return jumps_at_all ? std::move(jumps) : Vectors();
}

Targets::Weights::Weights(float part, float seconds) {
    const float rest = 1 - part;
    from = (1 + 2 * part) * rest * rest;
    to = part * part * (3 - 2 * part);
    from_velocity = seconds * part * rest * rest;
    to_velocity = -seconds * part * part * rest;
    way = 6 * part * rest / seconds;
    from_velocity_rate = rest * (1 - 3 * part);
    to_velocity_rate = part * (3 * part - 2);
}

void release_targets(SimulationState& state, BodyState& body) {
    const auto found = std::ranges::find(state.targets, body.actor, [](const Targets& t) { return t.memory.actor; });
    if (found == state.targets.end()) return;
    body.follows = false;
    body.elasticity->set_crush_share(1);
    body.elasticity->set_rest_stretches({}, {});
    for (const Index i : found->held) {
        body.fixed[i] = 0;
        body.inverse_mass[i] = 1 / body.body->mass[i];
    }
    for (const Pin& pin : state.world.pins) {
        if (pin.body != body.actor) continue;
        for (const Index i : pin.particles) {
            body.fixed[i] = 1;
            body.inverse_mass[i] = 0;
        }
    }
}

void follow_jumps(SimulationState& state) {
    for (Targets& targets : state.targets) {
        const std::size_t slot = state.slot_of[targets.memory.actor];
        BodyState& body = state.bodies[slot];
        const Vectors jumps = targets.begin_frame(float(state.frame_seconds()));
        body.elasticity->set_rest_stretches(targets.memory.from_stretches, targets.memory.to_stretches);
        if (jumps.size() == 0) continue;
        for (std::size_t i = 0; i < jumps.size(); ++i) body.positions.add(i, jumps[i]);
        if (body.corners) body.corners->place(body.positions, body.velocities, RunContext(1));
        state.contacts.was_placed(slot);
        state.contacts.begin_anew();
    }
}

void pull_to_targets(SimulationState& state, double now, float dt, const RunContext& context) {
    const auto seconds = float(state.frame_seconds());
    const Targets::Weights w(state.part_of_frame(now), seconds);
    const float stiffest = kStiffest / (dt * dt);
    for (const Targets& targets : state.targets) {
        BodyState& body = state.body_of(targets.memory.actor);
        const TargetsMemory& m = targets.memory;
        const Targets::Course& course = targets.course;
        const float leash_pull = targets.leash_pull, leash_damping = targets.leash_damping;
        using Block = std::array<float, kBlock>;
        // Where a particle is beside its target, and how it moves beside it.
        const auto beside = [&](std::size_t first, std::size_t count, std::vector<float> Vectors::*axis, Block& away,
                                Block& speed) {
            const float *from = (m.from.*axis).data() + first, *to = (m.to.*axis).data() + first;
            const float *u = (course.from_velocities.*axis).data() + first,
                        *v = (course.to_velocities.*axis).data() + first;
            const float *x = (body.positions.*axis).data() + first, *s = (body.velocities.*axis).data() + first;
            for (std::size_t i = 0; i < count; ++i)
                away[i] = w.from * from[i] + w.to * to[i] + w.from_velocity * u[i] + w.to_velocity * v[i] - x[i];
            for (std::size_t i = 0; i < count; ++i)
                speed[i] = w.way * (to[i] - from[i]) + w.from_velocity_rate * u[i] + w.to_velocity_rate * v[i] - s[i];
        };
        const auto pull_block = [&](std::size_t first, std::size_t count) {
            std::array<Block, 3> away, speed;
            for (int axis = 0; axis < 3; ++axis) beside(first, count, kVectorAxes[axis], away[axis], speed[axis]);
            Block kick, keep; // s of (away / s^2), and the part of the speed that is taken off
            for (std::size_t i = 0; i < count; ++i) {
                const float way =
                    std::sqrt(away[0][i] * away[0][i] + away[1][i] * away[1][i] + away[2][i] * away[2][i]);
                const float tight = std::min(std::max(way / targets.leashes[first + i] - 1, 0.0f), 1.0f);
                const float pull = targets.pulls[first + i] + tight * leash_pull;
                const float damping = targets.dampings[first + i] + std::sqrt(tight) * leash_damping;
                kick[i] = 0.5f * dt * std::min(pull, stiffest);
                const float quarter = std::min(0.25f * dt * damping, 1.0f);
                keep[i] = 2 * quarter / (1 + quarter);
            }
            for (int axis = 0; axis < 3; ++axis) {
                float* v = (body.velocities.*kVectorAxes[axis]).data() + first;
                const Block &a = away[axis], &s = speed[axis];
                for (std::size_t i = 0; i < count; ++i) v[i] += kick[i] * a[i] + keep[i] * s[i];
                if (course.felt.size() == 0) continue;
                const float* felt = (course.felt.*kVectorAxes[axis]).data() + first;
                for (std::size_t i = 0; i < count; ++i) v[i] += 0.5f * dt * felt[i];
            }
        };
        parallel_for(context, targets.pulls.size(), kTargetsGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t first = begin; first < end; first += kBlock)
                pull_block(first, std::min(kBlock, end - first));
        });
    }
}

void hold_on_targets(SimulationState& state, double now) {
    const auto seconds = float(state.frame_seconds());
    const Targets::Weights w(state.part_of_frame(now), seconds);
    for (const Targets& targets : state.targets) {
        BodyState& body = state.body_of(targets.memory.actor);
        const TargetsMemory& m = targets.memory;
        const Targets::Course& course = targets.course;
        body.elasticity->set_part_of_frame(float(state.part_of_frame(now)));
        for (const Index i : targets.held) {
            const Vec3f from = m.from[i], to = m.to[i], u = course.from_velocities[i], v = course.to_velocities[i];
            body.positions.set(i, w.from * from + w.to * to + w.from_velocity * u + w.to_velocity * v);
            body.velocities.set(i, w.way * (to - from) + w.from_velocity_rate * u + w.to_velocity_rate * v);
        }
    }
}

} // namespace filigree
