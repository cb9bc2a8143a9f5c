// Velocity Verlet: kick, drift, kick. The stable step follows from the squared frequencies that are found with the
// forces.
#include "filigree/core/math.h"
#include "filigree/core/parallel_for.h"
#include "filigree/physics/contact/contact_law.h"
#include "filigree/physics/rigid/rigid_body.h"
#include "filigree/physics/rigid/rigid_state.h"
#include "filigree/physics/step/simulation_state.h"
#include "filigree/physics/step/stiff_hits.h"
#include "filigree/physics/step/stopwatch.h"
#include "filigree/physics/step/vibration.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace filigree {

namespace {

constexpr std::size_t kExplicitStepsGrain = 2048;
constexpr std::size_t kAwakeGrain = 16, kElasticGrain = 4; // bodies
constexpr double kSafety = 0.9;      ///< part of the stable step that is used: it changes while a step is made
constexpr double kLeastSubsteps = 2; ///< a frame; with one, large motions gain energy
constexpr double kNoLimit = std::numeric_limits<double>::infinity();
constexpr double kBarelyLonger = 1.01;    ///< times the stable step: still stable, as kSafety has it
constexpr double kShortestOpening = 0.25; ///< of the stable step: cracks that open faster are followed less well
/// Large vibrations that steps hardly follow draw energy from them: tiny bodies in free flight took in a hundred times
/// what they had (HardStarts.ANoisyBodyGainsNoEnergy). A little internal damping takes it away again. Accelerations
/// tell: in vibrations that steps follow well they change little in a substep.
constexpr float kCalm = 0.05f;       ///< that change, as a speed, in parts of the speed of waves ...
constexpr float kNoisy = 0.15f;      ///< ... from which on damping is full
constexpr float kNoisyDelay = 0.05f; ///< substeps
/// A few crushed cells are little of a large body; forces change there as fast as steps follow.
constexpr float kCrushedDelay = 0.5f; ///< substeps, where a cell is flat (InternalDamping::kDampedBelow)
/// Clay that is thrown at the ground would throw bits off, but for damping of waves of a few spacings [von Neumann
/// 1950].
constexpr float kFlowingDelay = 0.25f; ///< of the time that a wave takes across a spacing
constexpr float kRubbingDelay = 0.25f; ///< substeps: of what slides along something (calm_rubbing): short waves
constexpr float kLightDelay = 0.5f;    ///< substeps: of light corners, which would swing for ever ...
constexpr float kFreeWay = 0.05f;      ///< spacings a substep: ... as far as they move faster
constexpr double kMostDeforming = 0.5; ///< spacings a substep, between particles of one body
constexpr double kStifferDamped = 2;   ///< times the squared frequency at rest: what is stiffer is damped for less time
constexpr double kUsualSubsteps = 256; ///< a frame: what the first forces of a frame take for the step before
constexpr double kSlowHit = 0.02, kSlowHitSubsteps = 2; ///< m/s, and of gravity: what comes slower does not bounce

/// m/s: velocities less the body's rigid motion.
Vectors deforming_velocities(const BodyState& body, const RunContext& context) {
    const RigidState rigid = rigid_state(body);
    const Vec3f drifting = (rigid.linear / rigid.mass).cast<float>();
    const Vec3f turning = rigid.angular_velocity_of(rigid.angular).cast<float>(), centre = rigid.centre.cast<float>();
    Vectors relative(body.positions.size());
    parallel_for(context, relative.size(), kExplicitStepsGrain, [&](std::size_t begin, std::size_t end) {
        const auto along_axis = [&](float* to, const std::vector<float>& velocities, int axis) {
            const int u = (axis + 1) % 3, w = (axis + 2) % 3;
            const float *v = velocities.data(), *along_u = (body.positions.*kVectorAxes[u]).data(),
                        *along_w = (body.positions.*kVectorAxes[w]).data();
            for (std::size_t i = begin; i < end; ++i)
                to[i] = v[i] - drifting[axis] -
                        (turning[u] * (along_w[i] - centre[w]) - turning[w] * (along_u[i] - centre[u]));
        };
        along_axis(relative.x.data(), body.velocities.x, 0);
        along_axis(relative.y.data(), body.velocities.y, 1);
        along_axis(relative.z.data(), body.velocities.z, 2);
    });
    return relative;
}

/// Whether light corners move more than a part of a spacing in a substep beside the heaviest corners of their cells.
bool light_corners_swing(const BodyState& body, float dt) {
    const float most = kFreeWay * float(body.body->spacing()) / dt;
    return std::ranges::any_of(body.light_corners, [&](const BodyState::LightCorner& light) {
        return (body.velocities[light.particle] - body.velocities[light.neighbour]).squaredNorm() > most * most;
    });
}

/// The same for light corners alone: of what they move in a substep beside the heaviest corner of their cells, all that
/// is more than a part of a spacing.
void damp_light_corners(const BodyState& body, float dt, Vectors& ahead) {
    const float free_way = kFreeWay * float(body.body->spacing());
    for (const auto& [particle, neighbour] : body.light_corners) {
        const bool is_free = body.inverse_mass[particle] * body.body->mass[particle] > 0.99f; // neither pinned nor tied
        const Vec3f way = dt * (body.velocities[particle] - body.velocities[neighbour]);
        const float length = way.norm();
        if (is_free && length > free_way) ahead.add(particle, kLightDelay * (1 - free_way / length) * way);
    }
}

/// m/s^2: how much accelerations have changed since forces were `before`, of the particles beside each other, root mean
/// square by mass. `before` becomes the forces now.
float change_of_acceleration(const BodyState& body, Vectors& before, const RunContext& context) {
    constexpr std::size_t kAtOnce = 8; // so that the compiler uses vectors
    struct Sums {
        float mass[kAtOnce] = {}, x[kAtOnce] = {}, y[kAtOnce] = {}, z[kAtOnce] = {}, squares[kAtOnce] = {};
    };
    const std::size_t count = body.inverse_mass.size();
    std::vector<Sums> sums((count + kExplicitStepsGrain - 1) / kExplicitStepsGrain);
    parallel_for(context, count, kExplicitStepsGrain, [&](std::size_t begin, std::size_t end) {
        Sums sum; // not in place: the compiler would have to expect it among the particles
        const auto& [fx, fy, fz] = body.forces;
        const auto& [gx, gy, gz] = before;
        const auto add = [&, m = body.body->mass.data(), w = body.inverse_mass.data()](std::size_t i, std::size_t k) {
            const float ax = (fx[i] - gx[i]) * w[i], ay = (fy[i] - gy[i]) * w[i], az = (fz[i] - gz[i]) * w[i];
            sum.mass[k] += m[i];
            sum.x[k] += m[i] * ax;
            sum.y[k] += m[i] * ay;
            sum.z[k] += m[i] * az;
            sum.squares[k] += m[i] * (ax * ax + ay * ay + az * az);
        };
        const std::size_t whole = end - (end - begin) % kAtOnce;
        for (std::size_t i = begin; i < whole; i += kAtOnce)
            for (std::size_t k = 0; k < kAtOnce; ++k) add(i + k, k);
        for (std::size_t i = whole; i < end; ++i) add(i, 0);
        sums[begin / kExplicitStepsGrain] = sum;
    });
    before = body.forces;
    const auto all = [&](const float(Sums::*parts)[kAtOnce]) {
        float total = 0;
        for (const Sums& sum : sums) total = std::accumulate(sum.*parts, sum.*parts + kAtOnce, total);
        return total;
    };
    const float mass = all(&Sums::mass);
    const float mean = Vec3f(all(&Sums::x), all(&Sums::y), all(&Sums::z)).squaredNorm() / mass;
    return std::sqrt(std::max(0.0f, all(&Sums::squares) - mean) / mass);
}

/// s, longest that is stable; 0 where no step is. With a = squared_frequency, b = damping_rate: a dt^2 / 4 + b dt / 2
/// is 1 then.
double stable_step(double squared_frequency, double damping_rate) {
    const double step = kSafety * 4 / (damping_rate + std::sqrt(damping_rate * damping_rate + 4 * squared_frequency));
    return std::isfinite(squared_frequency) ? step : 0;
}

/// s, in which no two particles of the body move further than a part of the spacing beside each other: forces follow
/// larger steps in no way, however stable they are near rest.
double deforming_step(const BodyState& body) {
    const auto spread = [](const std::vector<float>& v, std::size_t count) {
        float least = v[0], most = v[0];
        for (std::size_t i = 1; i < count; ++i) {
            least = v[i] < least ? v[i] : least;
            most = v[i] > most ? v[i] : most;
        }
        return double(most - least);
    };
    const Vectors& v = body.velocities;
    const double speed = Vec3d(spread(v.x, v.size()), spread(v.y, v.size()), spread(v.z, v.size())).norm();
    return speed > 0 ? kMostDeforming * body.body->spacing() / speed : kNoLimit;
}

class ExplicitSteps {
public:
    ExplicitSteps(SimulationState& state, double from, double until, FrameReport& report, const RunContext& context)
        : state_(state), bodies_(state.bodies), report_(report), context_(context), now_(from), until_(until),
          calmed_(from), meets_anything_(!state.world.obstacles.empty() || state.options.contacts_within_bodies ||
                                         (state.options.contacts_between_bodies && state.bodies.size() > 1)),
          has_soft_(std::ranges::any_of(state.bodies, [](const BodyState& b) { return !b.is_absent && !b.rigid; })),
          rigid_contacts_(state.rigid_contacts) {}

    double run() {
        if (meets_anything_) state_.contacts.begin_frame(bodies_, context_);
        find_contacts();
        const float first_dt = float(state_.frame_seconds() / kUsualSubsteps);
        find_forces(first_dt);
        if (repair_start(state_, elastic_, report_, context_)) {
            state_.contacts.begin_anew();
            state_.contacts.begin_frame(bodies_, context_);
            find_contacts();
            stable_in_frame_ = kNoLimit;
            vibrations_.clear();
            find_forces(first_dt);
        }
        const auto is_left = [&] { return until_ - now_ > 1e-9 * state_.frame_seconds(); };
        while (is_left()) {
            const double steps = steps_left();
            if (!is_finite_ || context_.is_cancelled()) break;
            const float dt = float((until_ - now_) / steps);
            note_stability(double(dt));
            const double before = now_;
            move(dt, steps <= 1 ? until_ : now_ + double(dt));
            find_contacts();
            find_forces(dt);
            finish(dt);
            follow_hits(bodies_, state_.contacts, double(dt));
            calm(!is_left());
            const Breaks breaks = break_bodies(state_, before, now_, context_);
            if (breaks.contacts) {
                if (meets_anything_) state_.contacts.begin_frame(bodies_, context_);
                find_contacts();
            }
            if (breaks.forces || breaks.contacts) find_forces(dt, true);
        }
        if (meets_anything_) state_.contacts.end_frame(bodies_, context_);
        return is_left() ? now_ : until_;
    }

private:
    /// As many as stability asks for, up to kMostSubsteps in the whole frame: what no step is short enough for takes
    /// those.
    double steps_left() const {
        const double remaining = until_ - now_;
        const double fewest = std::ceil(kLeastSubsteps * remaining / state_.frame_seconds() - 1e-6);
        const double most = std::max(1.0, double(kMostSubsteps) - report_.substeps);
        return std::min(most, std::max(fewest, std::ceil(remaining / stable_step_)));
    }

    void note_stability(double dt) {
        if (!(dt > kBarelyLonger * stable_of_bodies_)) return;
        ++report_.unstable_substeps;
        report_.unstable_body = bodies_[shortest_body_].actor;
    }

    /// Particles of rigid bodies as their poses have them after the last kick.
    void place_rigid() {
        for (BodyState& body : bodies_)
            if (body.rigid && !body.sleeps()) place_particles(body);
    }

    /// The first half of the kick, and the drift.
    void move(float dt, double until) {
        const Stopwatch watch(report_.other_seconds);
        for (BodyState& body : bodies_) {
            body.step_seconds = dt;
            body.most_push = kMostPush * dt * float(pressure_wave_speed(body.body->material));
        }
        each_elastic([&](BodyState& body, std::size_t b) {
            if (vibrations_[b].elastic.size() > 0) debts_[b].begin(body, vibrations_[b].elastic, context_);
        });
        kick(0.5f * dt, false);
        pull_to_targets(state_, now_, dt, context_);
        move_rigid(double(dt));
        drift(dt);
        const double before = std::exchange(now_, until);
        move_pins(state_, now_, dt);
        hold_on_targets(state_, now_);
        make_way(state_, before, now_);
        if (meets_anything_) state_.contacts.travel(bodies_, dt, before, now_, context_);
    }

    /// Rigid bodies take all of gravity at once and half of the kick by other forces, then impulses at what they touch,
    /// and move with what comes of it. In free flight they move as gravity has them to the last digit.
    void move_rigid(double dt) {
        wake_met(dt);
        const Vec3d& gravity = state_.world.gravity;
        rigid_contacts_.prepare(bodies_, gravity, context_);
        each_awake_rigid([&](BodyState& body, std::size_t b) {
            kick_rigid(body, rigid_loads_[b], Vec3d::Zero(), 0.5 * dt,
                       math::exp(-dt * body.mean_damping * body.body->material.damping));
            kick_rigid(body, {}, gravity, dt, 1); // undamped: what lies has its whole weight
        });
        rigid_contacts_.solve(bodies_, dt, context_);
        each_awake_rigid([&](BodyState& body, std::size_t b) {
            drift_rigid(body, dt);
            if (!rigid_contacts_.pushes(b)) body.rigid->centre -= 0.5 * dt * dt * gravity;
        });
        rigid_contacts_.finish(bodies_, dt, kSlowHit + kSlowHitSubsteps * dt * gravity.norm(), context_);
        state_.contacts.events().push(rigid_contacts_.points());
        place_rigid();
    }

    /// Sleepers wake that something is about to touch.
    void wake_met(double dt) {
        bool woke = false;
        for (const ContactPoint& point : rigid_contacts_.points()) {
            if (point.other == kNoIndex || bodies_[point.body].sleeps() == bodies_[point.other].sleeps()) continue;
            const bool first = bodies_[point.body].sleeps();
            const Index sleeper = first ? point.body : point.other, comes = first ? point.other : point.body;
            const float speed = state_.contacts.speed(comes);
            if (double(point.separation) > dt * double(speed)) continue;
            wake(bodies_[sleeper]);
            rigid_loads_[sleeper] = {};
            woke = true;
        }
        if (woke) state_.contacts.list_work(bodies_);
    }

    void find_contacts() {
        if (!meets_anything_) return;
        const Stopwatch watch(report_.contact_seconds);
        const double frame = state_.frame_seconds(), longest = frame / kLeastSubsteps;
        const double step = stable_step_ > 0 ? std::min(longest, stable_step_) : longest;
        state_.contacts.search(bodies_, {.time = now_, .frame = frame, .step = step}, context_);
    }

    /// All forces at the present positions, and the step that is stable there.
    void find_forces(float dt, bool is_again = false) {
        find_elastic_forces(dt, is_again);
        if (meets_anything_) {
            const Stopwatch watch(report_.contact_seconds);
            const double longest = std::min(state_.frame_seconds() / kLeastSubsteps, double(kLongestRigidStep));
            if (state_.rigid_pairs.search(bodies_, longest, context_)) state_.contacts.list_work(bodies_);
        }
        {
            const Stopwatch watch(report_.contact_seconds);
            const ContactReport touching = state_.contacts.add_forces(bodies_, now_, dt, rigid_contacts_, context_);
            report_.contacts = touching.contacts;
            report_.deepest_contact = std::max(report_.deepest_contact, double(touching.deepest));
            const RigidPairs::Report rigid = state_.rigid_pairs.add_points(bodies_, rigid_contacts_, context_);
            for (const auto& [body, way] : rigid_contacts_.move_out_of_obstacles(bodies_))
                state_.contacts.was_moved(body, way);
            report_.contacts += rigid.contacts;
            report_.deepest_in_matter =
                std::max({report_.deepest_in_matter, double(touching.deepest_in_matter), double(rigid.deepest)});
        }
        const Stopwatch watch(report_.other_seconds);
        state_.external.add_forces(bodies_, now_, context_);
        stable_step_ = state_.contacts.longest_step();
        std::vector<double> frequencies(bodies_.size()); // squared
        for (std::size_t b = 0; b < bodies_.size(); ++b) {
            BodyState& body = bodies_[b];
            if (body.sleeps()) continue;
            double& squared_frequency = frequencies[b];
            // A rigid body's stands for the penalties of soft ones.
            squared_frequency = body.rigid && !has_soft_ ? 0 : double(elastic_[b].squared_frequency);
            if (!body.rigid)
                squared_frequency += state_.contacts.added_frequency(b) * double(body.rest_squared_frequency);
            squared_frequency = state_.external.add_pulls(body, b, now_, squared_frequency);
        }
        double opening_step = kNoLimit;
        for (const Cracks& cracks : state_.cracks) {
            const Cracks::Pace pace = cracks.add_forces(bodies_, context_);
            for (std::size_t piece = 0; piece < cracks.body().pieces.size(); ++piece)
                frequencies[cracks.first_piece() + piece] += double(pace.squared_frequency);
            opening_step = std::min(opening_step, double(pace.opening_step));
        }
        rigid_loads_.resize(bodies_.size());
        each_awake([&](const BodyState& body, std::size_t b) {
            if (!body.rigid) return;
            const bool is_loaded = has_soft_ || state_.external.has_wind() || state_.external.acts_on(b, now_);
            rigid_loads_[b] = is_loaded || !state_.cracks.empty() ? rigid_load(body) : RigidLoad{};
        });
        is_finite_ = true;
        stable_of_bodies_ = kNoLimit;
        for (std::size_t b = 0; b < bodies_.size(); ++b) {
            if (bodies_[b].sleeps()) continue;
            is_finite_ &= std::isfinite(frequencies[b]);
            double stable = stable_step(frequencies[b], double(elastic_[b].damping_rate));
            stable_in_frame_ = std::min(stable_in_frame_, stable);
            if (!bodies_[b].rigid) stable = std::min(stable, deforming_step(bodies_[b]));
            if (!(stable < stable_of_bodies_)) continue;
            stable_of_bodies_ = stable;
            shortest_body_ = b;
        }
        stable_step_ = std::min(stable_step_, stable_of_bodies_);
        if (std::ranges::any_of(bodies_, [](const BodyState& body) { return body.rigid && !body.sleeps(); }))
            stable_step_ = std::min({stable_step_, state_.rigid_pairs.longest_step(), double(kLongestRigidStep)});
        stable_step_ = std::min(stable_step_, stable_in_frame_);
        stable_step_ = std::min(stable_step_, std::max(opening_step, kShortestOpening * stable_step_));
    }

    /// s of internal damping, unless more is needed.
    static float usual_delay(const Body& body) {
        const auto asked = float(body.material.internal_damping);
        if (body.material.model != MaterialModel::meshfree || !body.material.is_plastic()) return asked;
        return std::max(asked, kFlowingDelay * float(body.spacing() / pressure_wave_speed(body.material)));
    }

    /// s of internal damping of the whole body.
    float find_delay(std::size_t b, float dt) {
        const BodyState& body = bodies_[b];
        Vibration& vibration = vibrations_[b];
        const float usual = usual_delay(*body.body);
        if (!std::exchange(vibration.has_forces, true)) return usual;
        if (vibration.before.size() == 0) {
            vibration.before = body.forces;
            return usual;
        }
        const float change = dt * change_of_acceleration(body, vibration.before, context_) /
                             float(pressure_wave_speed(body.body->material));
        const float noisy = kNoisyDelay * dt * std::clamp((change - kCalm) / (kNoisy - kCalm), 0.0f, 1.0f);
        const float rubbing = vibration.is_calmed ? kRubbingDelay * dt : 0;
        return std::max({usual, noisy, rubbing});
    }

    /// is_again: nothing has moved since the last time.
    void find_elastic_forces(float dt, bool is_again) {
        const Stopwatch watch(report_.elastic_seconds);
        elastic_.resize(bodies_.size());
        vibrations_.resize(bodies_.size());
        debts_.resize(bodies_.size());
        parallel_for(context_, bodies_.size(), kElasticGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t b = begin; b < end; ++b)
                if (!bodies_[b].is_absent) find_elastic_forces_of(b, dt, is_again);
        });
        for (std::size_t b = 0; b < bodies_.size(); ++b)
            if (!bodies_[b].is_absent) note_deformation(report_, b, elastic_[b]);
    }

    void find_elastic_forces_of(std::size_t b, float dt, bool is_again) {
        BodyState& body = bodies_[b];
        if (body.rigid) {
            elastic_[b] = body.elasticity->forces(body.positions, body.forces, context_);
            return;
        }
        float& delay = vibrations_[b].delay;
        if (!(is_again && vibrations_[b].has_forces)) delay = find_delay(b, dt);
        Vectors ahead; // of light corners
        if (light_corners_swing(body, dt)) damp_light_corners(body, dt, ahead = body.positions);
        const Vectors& positions = ahead.size() > 0 ? ahead : body.positions;
        if (delay > 0 || elastic_[b].least_volume_ratio < InternalDamping::kDampedBelow) {
            const InternalDamping damping{deforming_velocities(body, context_), delay, kCrushedDelay * dt,
                                          float(kStifferDamped) * body.rest_squared_frequency, elastic_[b]};
            elastic_[b] = body.elasticity->damped_forces(positions, damping, body.forces, context_);
        } else {
            elastic_[b] = body.elasticity->forces(positions, body.forces, context_);
        }
        if (debts_[b].has_begun()) debts_[b].moved(body, body.forces);
        const float ratio = elastic_[b].least_volume_ratio; // what is inside out has to move to come back
        const bool is_crushed = ratio > 0 && ratio < InternalDamping::kDampedBelow && !body.follows;
        vibrations_[b].elastic = is_crushed ? body.forces : Vectors();
    }

    /// The second half of the kick, and what follows a substep.
    void finish(float dt) {
        {
            const Stopwatch watch(report_.contact_seconds);
            if (state_.contacts.is_too_deep())
                each_elastic([&](BodyState& body, std::size_t b) {
                    if (state_.contacts.touches(b) && !debts_[b].has_begun() && !body.follows)
                        debts_[b].before_push(body, context_);
                });
            push_out(state_, now_, context_);
            state_.contacts.events().keep_forces();
        }
        const Stopwatch watch(report_.other_seconds);
        pull_to_targets(state_, now_, dt, context_);
        kick(0.5f * dt, true);
        each_elastic([&](BodyState& body, std::size_t b) {
            if (debts_[b].has_begun()) debts_[b].end(body, context_);
        });
        each_awake_rigid([&](BodyState& body, std::size_t b) {
            if (rigid_loads_[b].force.isZero(0) && rigid_loads_[b].torque.isZero(0)) return;
            kick_rigid(body, rigid_loads_[b], Vec3d::Zero(), 0.5 * double(dt), 1);
            place_particles(body);
        });
        move_pins(state_, now_, dt);
        hold_on_targets(state_, now_);
        finish_substep(state_, dt, context_);
        ++report_.substeps;
    }

    template <class Visit>
    void each_awake(const Visit& visit) { ///< on all threads
        parallel_for(context_, bodies_.size(), kAwakeGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t b = begin; b < end; ++b)
                if (!bodies_[b].sleeps()) visit(bodies_[b], b);
        });
    }

    /// Every few substeps: more often would cost more, and change nothing.
    void calm(bool is_last) {
        constexpr unsigned kEvery = 8;
        if (!is_last && report_.substeps % kEvery != 0) return;
        const double seconds = now_ - calmed_;
        calmed_ = now_;
        each_elastic([&](BodyState& body, std::size_t b) {
            vibrations_[b].is_calmed = calm_rubbing(body, state_.contacts.touches(b), state_.contacts.rubs(b), seconds);
        });
    }

    /// But for pieces of what breaks, whose copies have to move alike.
    template <class Visit>
    void each_elastic(const Visit& visit) {
        for (std::size_t b = 0; b < bodies_.size(); ++b)
            if (!bodies_[b].rigid && !bodies_[b].sleeps() && !state_.is_piece(b)) visit(bodies_[b], b);
    }

    template <class Visit>
    void each_awake_rigid(const Visit& visit) {
        for (std::size_t b = 0; b < bodies_.size(); ++b)
            if (bodies_[b].rigid && !bodies_[b].sleeps()) visit(bodies_[b], b);
    }

    /// Pinned particles too: move_pins sets them right. Rigid bodies have their own.
    void kick(float dt, bool damp) {
        const Vec3f gravity = state_.world.gravity.cast<float>();
        each_awake([&](BodyState& body, std::size_t) {
            const double kept = damp ? math::exp(-2 * double(dt) * body.body->material.damping) : 1;
            if (body.rigid) return;
            parallel_for(context_, body.positions.size(), kExplicitStepsGrain, [&](std::size_t begin, std::size_t end) {
                const float* inverse_mass = body.inverse_mass.data();
                const auto kick_axis = [&](std::vector<float>& velocities, const std::vector<float>& forces, float g) {
                    float* v = velocities.data();
                    const float* f = forces.data();
                    const auto left = float(kept);
                    for (std::size_t i = begin; i < end; ++i) v[i] = (v[i] + dt * (f[i] * inverse_mass[i] + g)) * left;
                };
                kick_axis(body.velocities.x, body.forces.x, gravity.x());
                kick_axis(body.velocities.y, body.forces.y, gravity.y());
                kick_axis(body.velocities.z, body.forces.z, gravity.z());
                if (damp && !body.damping.empty()) damp_beside(body, dt, begin, end);
            });
        });
    }

    /// What the damping of particles [begin, end) differs by from the material's.
    static void damp_beside(BodyState& body, float dt, std::size_t begin, std::size_t end) {
        const double rate = -2 * double(dt) * body.body->material.damping;
        for (std::size_t i = begin; i < end; ++i) {
            const auto left = float(math::exp(rate * double(body.damping[i] - 1)));
            body.velocities.x[i] *= left;
            body.velocities.y[i] *= left;
            body.velocities.z[i] *= left;
        }
    }

    void drift(float dt) {
        each_awake([&](BodyState& body, std::size_t) {
            if (body.rigid) return;
            parallel_for(context_, body.positions.size(), kExplicitStepsGrain, [&](std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i) body.positions.x[i] += dt * body.velocities.x[i];
                for (std::size_t i = begin; i < end; ++i) body.positions.y[i] += dt * body.velocities.y[i];
                for (std::size_t i = begin; i < end; ++i) body.positions.z[i] += dt * body.velocities.z[i];
            });
        });
    }

    SimulationState& state_;
    std::vector<BodyState>& bodies_;
    FrameReport& report_;
    const RunContext& context_;
    double now_, until_;        // s
    double calmed_;             ///< s: until when what rubs has been calmed
    const bool meets_anything_; // obstacles, other bodies or parts of the same
    const bool has_soft_;       ///< bodies that are not rigid
    std::vector<ElasticReport> elastic_;
    struct Vibration {           ///< of a body
        bool has_forces = false; ///< of this frame; those before it are not known after a restore
        bool is_calmed = false;  ///< it rubs
        Vectors before;          ///< N, the forces of the substep before; empty: not known
        Vectors elastic;         ///< N, those of elasticity alone, where cells are crushed; else empty
        float delay = 0;         ///< s of internal damping
    };
    std::vector<Vibration> vibrations_;
    std::vector<EnergyDebt> debts_;      ///< of each body, in this frame
    std::vector<RigidLoad> rigid_loads_; ///< of each body, by find_forces
    RigidContacts& rigid_contacts_;      ///< the same
    double stable_step_ = 0;             // s
    double stable_of_bodies_ = kNoLimit; ///< s, by what the bodies are themselves ...
    std::size_t shortest_body_ = 0;      ///< ... and the one that asks for it
    bool is_finite_ = true;              ///< the forces found last
    /// s: the shortest step that any body's vibrations have asked for in this frame. Steps that become longer again as
    /// these swing give them energy.
    double stable_in_frame_ = kNoLimit;
};

} // namespace

double step_explicitly(SimulationState& state, double from, double until, FrameReport& report,
                       const RunContext& context) {
    return ExplicitSteps(state, from, until, report, context).run();
}

} // namespace filigree
