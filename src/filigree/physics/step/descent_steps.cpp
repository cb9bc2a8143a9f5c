// Implicit Euler, solved by vertex block descent [Chen 2024]. Contacts are found where a substep begins: the blocks of
// its sweeps follow the particles from there.
#include "filigree/physics/rigid/rigid_body.h"
#include "filigree/physics/rigid/rigid_state.h"
#include "filigree/physics/step/simulation_state.h"
#include "filigree/physics/step/stopwatch.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

constexpr float kWildStretch = 3; ///< a body stretched further is not predicted: sweeps begin where it is

/// How a body at rest in itself would have moved in dt: the rotation about its centre.
struct Turn {
    Vec3d centre = Vec3d::Zero();
    Mat3d rotation = Mat3d::Identity();
    Vec3f of(const Vec3f& point) const { return (centre + rotation * (point.cast<double>() - centre)).cast<float>(); }
};

Turn turn_in(const RigidState& state, double dt) {
    const Vec3d angle = dt * state.angular_velocity_of(state.angular);
    Turn turn{state.centre, Mat3d::Identity()};
    if (const double length = angle.norm(); length > 0)
        turn.rotation = Eigen::AngleAxisd(length, angle / length).toRotationMatrix();
    return turn;
}

/// m/s, of the fastest particle.
float most_particle_speed(std::span<const BodyState> bodies) {
    float squared = 0;
    for (const BodyState& body : bodies) {
        constexpr std::size_t kAtOnce = 16; // so that the compiler uses vectors; what follows the last particle is 0
        float most[kAtOnce] = {};
        const Vectors& v = body.velocities;
        for (std::size_t i = 0; i < v.size(); i += kAtOnce)
            for (std::size_t k = 0; k < kAtOnce; ++k) {
                const float here = v.x[i + k] * v.x[i + k] + v.y[i + k] * v.y[i + k] + v.z[i + k] * v.z[i + k];
                most[k] = here > most[k] ? here : most[k];
            }
        squared = std::max(squared, *std::ranges::max_element(most));
    }
    return std::sqrt(squared);
}

/// One substep, from `now` less dt to `now`.
class DescentStep {
public:
    DescentStep(SimulationState& state, double now, float dt, FrameReport& report, const RunContext& context)
        : state_(state), bodies_(state.bodies), report_(report), context_(context), now_(now), dt_(dt) {}

    /// False when cancelled.
    bool run() {
        find_contacts();
        find_elastic_state();
        predict();
        if (!solve()) return false;
        finish();
        return true;
    }

private:
    void find_contacts() {
        const Stopwatch watch(report_.contact_seconds);
        const float speed = most_particle_speed(bodies_) + float(state_.world.gravity.norm()) * dt_;
        const float obstacles = float(obstacle_way(state_.world, bodies_, now_ - double(dt_), now_));
        const float way = 1.5f * speed * dt_ + 1.5f * obstacles, spacing = least_spacing(bodies_);
        met_.emplace(state_.contacts.meetings(
            bodies_,
            {.time = now_, .obstacle_reach = std::clamp(way, 0.25f * spacing, 8 * spacing), .frame = double(dt_)}, dt_,
            context_));
        for (std::size_t b = 0; b < bodies_.size(); ++b) {
            if (bodies_[b].sleeps()) {
                blocks_.emplace_back(); // of what is not swept
                continue;
            }
            blocks_.push_back(state_.contacts.blocks(bodies_, b, *met_, dt_, [&](Contacts::Blocks& blocks) {
                for (const Grip& grip : state_.external.grips())
                    if (grip.pulls(b, now_)) blocks.add_pull(grip.region, 0, grip.target(now_), grip.stiffness);
            }));
        }
    }

    /// How wild the start is; what no step can take is repaired.
    void find_elastic_state() {
        {
            const Stopwatch watch(report_.elastic_seconds);
            for (BodyState& body : bodies_)
                elastic_.push_back(body.is_absent ? ElasticReport{}
                                                  : body.elasticity->forces(body.positions, body.forces, context_));
        }
        repair_start(state_, elastic_, report_, context_);
    }

    /// Where inertia and outer forces carry the particles, and where sweeps begin.
    void predict() {
        const Stopwatch watch(report_.other_seconds);
        const std::vector<Vectors> pushes = state_.external.push_accelerations(bodies_, now_);
        std::vector<std::uint8_t> wild, falls; // of each actor, so that tied pieces begin alike
        wild.assign(state_.actor_count, 0);
        falls.assign(state_.actor_count, 1);
        for (std::size_t b = 0; b < bodies_.size(); ++b) {
            if (bodies_[b].sleeps()) continue;
            if (!(elastic_[b].least_volume_ratio > 0) || !(elastic_[b].most_stretch < kWildStretch))
                wild[bodies_[b].actor] = 1;
            if (bodies_[b].is_held || blocks_[b].holds()) falls[bodies_[b].actor] = 0;
        }
        for (std::size_t b = 0; b < bodies_.size(); ++b) {
            BodyState& body = bodies_[b];
            const std::size_t count = body.sleeps() ? 0 : body.positions.size();
            before_.push_back(body.is_absent ? RigidState{} : rigid_state(body));
            turn_.push_back(turn_in(before_.back(), double(dt_)));
            start_.push_back(body.positions);
            Vectors& target = target_.emplace_back(count);
            std::vector<float>& inertia = inertia_.emplace_back(count);
            for (std::size_t i = 0; i < count; ++i) {
                Vec3f acceleration = state_.world.gravity.cast<float>() + pushes[b][i];
                if (state_.external.has_wind()) acceleration += state_.external.wind_acceleration(body, b, i);
                const Vec3f coasted = body.positions[i] + dt_ * body.velocities[i];
                inertia[i] = body.body->mass[i] / (dt_ * dt_);
                target.set(i, coasted + dt_ * dt_ * acceleration);
                if (!wild[body.actor] && !body.fixed[i]) body.positions.set(i, falls[body.actor] ? target[i] : coasted);
            }
        }
        move_pins(state_, now_, dt_);
    }

    bool solve() {
        for (unsigned iteration = 0; iteration < state_.options.descent_iterations; ++iteration) {
            if (context_.is_cancelled()) return false;
            const Stopwatch watch(report_.elastic_seconds);
            for (std::size_t b = 0; b < bodies_.size(); ++b)
                if (!bodies_[b].sleeps()) sweep(b);
            for (const Cracks& cracks : state_.cracks)
                if (cracks.is_open()) sweep_cracks(cracks);
        }
        return true;
    }

    /// Whether a body rests on or slides along something as a whole, so that its load and friction have to balance its
    /// weight: eight sweeps alone leave a block 6 to 16 % more friction than there is.
    bool is_carried(std::size_t b) const {
        const BodyState& body = bodies_[b];
        return !body.rigid && blocks_[b].holds() && !(elastic_[b].most_stretch > kWildStretch) &&
               std::ranges::none_of(stays(b), [](std::uint8_t stays) { return stays != 0; });
    }

    /// Internal damping has elastic forces as they are at y = x + tau v, v less the turning (Kelvin-Voigt to first
    /// order, as in explicit steps). With x0 where the particles would be without other motion, s = tau / dt and so
    /// x = (y + s x0) / (1 + s), a sweep moves y instead, towards (1 + s) target - s x0 by inertia / (1 + s).
    void sweep(std::size_t b) {
        BodyState& body = bodies_[b];
        const float s = damping(body);
        const auto terms = [&](const Vectors& target, std::span<const float> inertia) {
            return Descent{target, inertia, stays(b), blocks_[b].touched(), &blocks_[b]};
        };
        if (is_carried(b)) {
            blocks_[b].update_places(bodies_, body.positions, 1);
            move_as_one(body.positions, body.body->mass, terms(target_[b], inertia_[b]));
        }
        if (!(s > 0)) {
            blocks_[b].update_places(bodies_, body.positions, 1);
            body.elasticity->sweep(body.positions, terms(target_[b], inertia_[b]), context_);
            return;
        }
        const std::size_t count = body.positions.size();
        Vectors ahead = positions_ahead_of(b, s), target(count);
        std::vector<float> inertia(count);
        for (std::size_t i = 0; i < count; ++i) {
            target.set(i, (1 + s) * target_[b][i] - s * turn_[b].of(start_[b][i]));
            inertia[i] = inertia_[b][i] / (1 + s);
        }
        blocks_[b].update_places(bodies_, ahead, 1 / (1 + s));
        body.elasticity->sweep(ahead, terms(target, inertia), context_);
        const std::span<const std::uint8_t> stay = stays(b);
        for (std::size_t i = 0; i < count; ++i)
            if (!stay[i]) body.positions.set(i, (ahead[i] + s * turn_[b].of(start_[b][i])) / (1 + s));
    }

    float damping(const BodyState& body) const {
        return body.rigid ? 0.0f : float(body.body->material.internal_damping) / dt_;
    }
    Vectors positions_ahead_of(std::size_t b, float s) const {
        const Vectors& positions = bodies_[b].positions;
        Vectors ahead(positions.size());
        for (std::size_t i = 0; i < positions.size(); ++i)
            ahead.set(i, (1 + s) * positions[i] - s * turn_[b].of(start_[b][i]));
        return ahead;
    }
    /// What sweeps of the body leave where it is: pins, and of a piece what is tied to others.
    std::span<const std::uint8_t> stays(std::size_t b) const {
        if (b < state_.actor_count) return bodies_[b].fixed;
        const Cracks& cracks = *state_.cracks_of(bodies_[b].actor);
        return cracks.left_out(Index(b - cracks.first_piece()));
    }

    /// What the pieces' own sweeps left out.
    void sweep_cracks(const Cracks& cracks) {
        const std::size_t first = cracks.first_piece(), count = cracks.body().pieces.size();
        std::vector<Cracks::PieceSweep> pieces;
        std::vector<Vectors> ahead(count);
        for (std::size_t k = 0; k < count; ++k) {
            const std::size_t b = first + k;
            const float s = damping(bodies_[b]);
            if (s > 0) ahead[k] = positions_ahead_of(b, s);
            Vectors& swept = s > 0 ? ahead[k] : bodies_[b].positions;
            blocks_[b].update_places(bodies_, swept, 1 / (1 + s));
            pieces.push_back(
                {&bodies_[b].positions, &swept, 1 + s, &target_[b], inertia_[b], &blocks_[b], blocks_[b].touched()});
        }
        cracks.sweep(pieces, bodies_, context_);
    }

    void finish() {
        {
            const Stopwatch watch(report_.contact_seconds);
            const ContactReport touching = state_.contacts.update_anchors(bodies_, start_, now_);
            report_.contacts = touching.contacts;
            report_.deepest_contact = std::max(report_.deepest_contact, double(touching.deepest));
            report_.deepest_in_matter = std::max(report_.deepest_in_matter, double(touching.deepest_in_matter));
        }
        const Stopwatch watch(report_.other_seconds);
        for (std::size_t b = 0; b < bodies_.size(); ++b)
            if (!bodies_[b].sleeps()) update_velocities(b);
        restore_momentum();
        for (BodyState& body : bodies_)
            if (body.rigid && !body.sleeps()) fit_pose(body);
        push_out(state_, now_, context_);
        finish_substep(state_, dt_, context_);
        break_bodies(state_, now_ - double(dt_), now_, context_);
        ++report_.substeps;
    }

    void update_velocities(std::size_t b) {
        BodyState& body = bodies_[b];
        const float kept = std::exp(-dt_ * float(body.body->material.damping));
        for (std::size_t i = 0; i < body.positions.size(); ++i)
            if (!body.fixed[i]) body.velocities.set(i, (body.positions[i] - start_[b][i]) / dt_ * kept);
        note_deformation(report_, b, elastic_[b]);
    }

    /// Implicit Euler takes angular momentum away however well it is solved, and sweeps that are not solved let two
    /// bodies push each other unequally. Bodies that touch nothing but each other get it back, as if they were one.
    void restore_momentum() {
        DisjointSets sets(bodies_.size());
        std::vector<std::uint8_t> is_held(bodies_.size(), 0); // then of each group, at its root
        state_.contacts.join_touching(sets, is_held);
        for (const Cracks& cracks : state_.cracks) join_parts(cracks, sets);
        for (Index b = 0; b < bodies_.size(); ++b) {
            const BodyState& body = bodies_[b];
            if (is_held[b] || body.is_held || body.sleeps() || state_.external.pull(b, now_) ||
                state_.external.push(body.actor))
                is_held[sets.root(b)] = 1;
        }
        std::vector<Index> roots(bodies_.size());
        for (Index b = 0; b < bodies_.size(); ++b) roots[b] = sets.root(b);
        const IndexLists groups = corners_at_vertices(roots, bodies_.size());
        for (Index root = 0; root < bodies_.size(); ++root)
            if (groups[root].size() > 0 && !is_held[root]) restore_momentum_of(groups[root]);
    }

    void restore_momentum_of(std::span<const Index> group) {
        RigidState before, after, kept;
        for (const Index b : group) {
            RigidState state = before_[b];
            before = together(before, state);
            const double part = std::exp(-double(dt_) * bodies_[b].body->material.damping);
            state.linear = (state.linear + double(dt_) * state.mass * state_.world.gravity) * part;
            state.angular *= part;
            kept = together(kept, state);
            after = together(after, rigid_state(bodies_[b]));
        }
        give_back(group, before, kept, after);
    }

    /// Pieces that hang together are in one group.
    static void join_parts(const Cracks& cracks, DisjointSets& groups) {
        if (!cracks.is_open()) return;
        const std::vector<Index> parts = cracks.parts();
        for (std::size_t k = 0; k < parts.size(); ++k)
            groups.join(Index(cracks.first_piece() + k), Index(cracks.first_piece() + parts[k]));
    }

    void give_back(std::span<const Index> group, const RigidState& before, const RigidState& kept,
                   const RigidState& after) {
        const double t = double(dt_);
        const Vec3d& gravity = state_.world.gravity;
        const Vec3d centre = before.centre + t / before.mass * before.linear + 0.5 * t * t * gravity;
        const Vec3d shift = (kept.linear - after.linear) / after.mass;
        const Vec3d turn = after.angular_velocity_of(kept.angular - after.angular);
        const double size = std::sqrt(after.inertia.trace() / after.mass);
        const double rounding = 1e-7 * std::max(centre.norm(), size);
        if ((centre - after.centre).norm() + t * (shift.norm() + size * turn.norm()) < rounding) return;
        for (const Index b : group) {
            BodyState& body = bodies_[b];
            for (std::size_t i = 0; i < body.positions.size(); ++i) {
                const Vec3d arm = body.positions[i].cast<double>() - after.centre;
                body.velocities.add(i, (shift + turn.cross(arm)).cast<float>());
                body.positions.add(i, (centre - after.centre).cast<float>());
            }
        }
    }

    SimulationState& state_;
    std::vector<BodyState>& bodies_;
    FrameReport& report_;
    const RunContext& context_;
    const double now_; // s
    const float dt_;

    std::optional<Contacts::Meetings> met_;

    // Of each body.
    std::vector<Contacts::Blocks> blocks_;
    std::vector<ElasticReport> elastic_;
    std::vector<RigidState> before_;
    std::vector<Turn> turn_;
    std::vector<Vectors> start_, target_;
    std::vector<std::vector<float>> inertia_; ///< m / dt^2
};

} // namespace

void step_by_descent(SimulationState& state, double from, double until, FrameReport& report,
                     const RunContext& context) {
    for (double now = from; now < until && !context.is_cancelled();) {
        const double longest = state.descent_step(state.contacts.longest_step_from(state.bodies, until - now, context));
        const double steps = std::max(1.0, std::ceil((until - now) / longest - 1e-6));
        const double next = steps == 1 ? until : now + (until - now) / steps;
        if (!DescentStep(state, next, float(next - now), report, context).run()) return;
        now = next;
    }
    state.contacts.begin_anew(); // ways were not counted
}

} // namespace filigree
