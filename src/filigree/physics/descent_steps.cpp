// Implicit Euler, solved by vertex block descent [Chen 2024]. Contacts are found where a substep begins: the blocks of
// its sweeps follow the particles from there.
#include "filigree/physics/rigid_state.h"
#include "filigree/physics/simulation_state.h"
#include "filigree/physics/stopwatch.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

constexpr float kWildStretch = 3; ///< a body stretched further is not predicted: sweeps begin where it is

/// Implicit Euler takes angular momentum away however well it is solved; a body that nothing touches gets it back.
void restore_momentum(BodyState& body, const RigidState& before, const Vec3d& gravity, float dt) {
    const RigidState after = rigid_state(body);
    const double t = double(dt), kept = std::exp(-t * body.body->material.damping);
    const Vec3d linear = (before.linear + t * before.mass * gravity) * kept;
    const Vec3d centre = before.centre + t / before.mass * before.linear + 0.5 * t * t * gravity;
    const Vec3d shift = (linear - after.linear) / after.mass;
    const Vec3d turn = after.angular_velocity_of(before.angular * kept - after.angular);
    const double size = std::sqrt(after.inertia.trace() / after.mass);
    const double rounding = 1e-7 * std::max(centre.norm(), size);
    if ((centre - after.centre).norm() + t * (shift.norm() + size * turn.norm()) < rounding) return;
    for (std::size_t i = 0; i < body.positions.size(); ++i) {
        const Vec3d arm = body.positions[i].cast<double>() - after.centre;
        body.velocities.add(i, (shift + turn.cross(arm)).cast<float>());
        body.positions.add(i, (centre - after.centre).cast<float>());
    }
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
        state_.contacts.begin_anew();
        state_.contacts.search(bodies_, now_, 0, std::clamp(way, 0.25f * spacing, 8 * spacing),
                               std::clamp(way, 0.25f * spacing, 0.75f * spacing), context_);
        for (std::size_t b = 0; b < bodies_.size(); ++b)
            blocks_.push_back(state_.contacts.blocks(bodies_, b, now_, dt_, [&](Contacts::Blocks& blocks) {
                for (const Grip& grip : state_.external.grips())
                    if (grip.pulls(b, now_)) blocks.add_pull(grip.region, 0, grip.target(now_), grip.stiffness);
            }));
    }

    /// How wild the start is; what no step can take is repaired.
    void find_elastic_state() {
        {
            const Stopwatch watch(report_.elastic_seconds);
            for (BodyState& body : bodies_)
                elastic_.push_back(body.elasticity->forces(body.positions, body.forces, context_));
        }
        repair_start(state_, elastic_, report_, context_);
    }

    /// Where inertia and outer forces carry the particles, and where sweeps begin.
    void predict() {
        const Stopwatch watch(report_.other_seconds);
        const std::vector<Vectors> regions = state_.external.region_accelerations(bodies_, now_);
        for (std::size_t b = 0; b < bodies_.size(); ++b) {
            BodyState& body = bodies_[b];
            const std::size_t count = body.positions.size();
            before_.push_back(rigid_state(body));
            start_.push_back(body.positions);
            Vectors& target = target_.emplace_back(count);
            std::vector<float>& inertia = inertia_.emplace_back(count);
            const bool wild = !(elastic_[b].least_volume_ratio > 0) || !(elastic_[b].most_stretch < kWildStretch);
            const bool falls = !body.is_held && !state_.contacts.is_touched(b);
            for (std::size_t i = 0; i < count; ++i) {
                Vec3f acceleration = state_.world.gravity.cast<float>() + regions[b][i];
                if (state_.external.has_wind()) acceleration += state_.external.wind_acceleration(body, b, i);
                const Vec3f coasted = body.positions[i] + dt_ * body.velocities[i];
                inertia[i] = body.body->mass[i] / (dt_ * dt_);
                target.set(i, coasted + dt_ * dt_ * acceleration);
                if (!wild && !body.fixed[i]) body.positions.set(i, falls ? target[i] : coasted);
            }
        }
        move_pins(state_, now_, dt_);
    }

    bool solve() {
        for (unsigned iteration = 0; iteration < state_.options.descent_iterations; ++iteration) {
            if (context_.is_cancelled()) return false;
            const Stopwatch watch(report_.elastic_seconds);
            for (std::size_t b = 0; b < bodies_.size(); ++b) {
                BodyState& body = bodies_[b];
                blocks_[b].update_places(body.positions);
                body.elasticity->sweep(
                    body.positions, {target_[b], inertia_[b], body.fixed, blocks_[b].touched(), &blocks_[b]}, context_);
            }
        }
        return true;
    }

    void finish() {
        {
            const Stopwatch watch(report_.contact_seconds);
            const ContactReport touching = state_.contacts.update_anchors(bodies_, now_);
            report_.contacts = touching.contacts;
            report_.deepest_contact = std::max(report_.deepest_contact, double(touching.deepest));
        }
        const Stopwatch watch(report_.other_seconds);
        for (std::size_t b = 0; b < bodies_.size(); ++b) update_velocities(b);
        state_.contacts.push_out(bodies_, now_);
        finish_substep(state_, dt_, context_);
        ++report_.substeps;
    }

    void update_velocities(std::size_t b) {
        BodyState& body = bodies_[b];
        const float kept = std::exp(-dt_ * float(body.body->material.damping));
        for (std::size_t i = 0; i < body.positions.size(); ++i)
            if (!body.fixed[i]) body.velocities.set(i, (body.positions[i] - start_[b][i]) / dt_ * kept);
        if (!body.is_held && !state_.contacts.is_touched(b) && !state_.external.pull(b, now_))
            restore_momentum(body, before_[b], state_.world.gravity, dt_);
        report_.least_volume_ratio = std::min(report_.least_volume_ratio, elastic_[b].least_volume_ratio);
        report_.most_stretch = std::max(report_.most_stretch, elastic_[b].most_stretch);
    }

    SimulationState& state_;
    std::vector<BodyState>& bodies_;
    FrameReport& report_;
    const RunContext& context_;
    const double now_; // s
    const float dt_;

    // Of each body.
    std::vector<Contacts::Blocks> blocks_;
    std::vector<ElasticReport> elastic_;
    std::vector<RigidState> before_;
    std::vector<Vectors> start_, target_;
    std::vector<std::vector<float>> inertia_; ///< m / dt^2
};

} // namespace

void step_by_descent(SimulationState& state, double from, double until, FrameReport& report,
                     const RunContext& context) {
    const unsigned steps =
        std::max(1u, unsigned(std::lround(state.options.descent_substeps * (until - from) / state.frame_seconds())));
    const double step = (until - from) / steps;
    for (unsigned s = 0; s < steps && !context.is_cancelled(); ++s) {
        const double now = s + 1 == steps ? until : from + (s + 1) * step;
        if (!DescentStep(state, now, float(step), report, context).run()) return;
    }
}

} // namespace filigree
