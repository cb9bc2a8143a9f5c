#include "filigree/physics/simulation.h"

#include "filigree/core/parallel_for.h"
#include "filigree/core/random.h"
#include "filigree/physics/byte_stream.h"
#include "filigree/physics/contact.h"

#include <Eigen/SVD>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>

namespace filigree {

namespace {

constexpr std::size_t kGrain = 2048;
constexpr double kSafety = 0.9;            ///< part of the stable step that is used: it changes while a step is made
constexpr double kLeastSubsteps = 2;       ///< a frame; with one, large motions gain energy
constexpr float kMostStretch = 10;         ///< a body stretched further starts scaled down ...
constexpr float kStretchAfter = 3;         ///< ... to this
constexpr float kHandRate = 0.25f;         ///< share of the elastic rate that a hand may add
constexpr unsigned kExplicitLimit = 20000; ///< substeps a frame, whatever was asked for
constexpr float kBallRadius = 0.4f;        ///< spacings

class Stopwatch {
public:
    explicit Stopwatch(double& seconds) : seconds_(seconds) {}
    ~Stopwatch() { seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }
    Stopwatch(const Stopwatch&) = delete;
    Stopwatch& operator=(const Stopwatch&) = delete;

private:
    double& seconds_;
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// A hand and the particles it holds: those near its point, by mass, so that nothing is plucked out of the surface.
struct Grip {
    Hand hand;
    Embedding region;
    Vec3f offset = Vec3f::Zero();               ///< from the region's middle to the point, when it was seized
    float stiffness = 0, damping = 0, rate = 0; ///< N/m, N s/m, 1/s^2
};

/// Points that outside asked to be carried along.
struct Attachment {
    std::size_t body;
    std::vector<Vec3f> points;    ///< of the body at rest
    Embedding embedding;          ///< of the points where they were when neighbourhoods were last renewed
    std::vector<Mat3f> gradients; ///< gathered until then; empty: never renewed
};

struct RigidState {
    double mass = 0;
    Vec3d centre = Vec3d::Zero(), linear = Vec3d::Zero(), angular = Vec3d::Zero(); ///< angular: about the centre
    Mat3d inertia = Mat3d::Zero();

    /// Angular velocity, 1/s.
    Vec3d turning() const { return (inertia + 1e-12 * inertia.trace() * Mat3d::Identity()).ldlt().solve(angular); }
};

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

bool is_finite(const Vectors& values) {
    float sum = 0; // one NaN or infinity makes the sum so
    for (std::size_t i = 0; i < values.size(); ++i) sum += 0 * values.x[i] + 0 * values.y[i] + 0 * values.z[i];
    return sum == 0;
}

/// Balls that touch the skin from inside.
Embedding embed_balls(const BodyState& state, const RunContext& context) {
    const Body& body = *state.body;
    std::vector<Vec3f> points = body.skin.points.rest;
    for (std::size_t s = 0; s < points.size(); ++s) points[s] -= state.ball_radius * body.skin.normals[s];
    return body.material.model == MaterialModel::meshfree ? embed(points, body.rest, body.spacing(), context)
                                                          : embed_in_cells(points, body.cells, context);
}

/// A gradient with its stretches within [1 / 4, 4]: what flows is sheared without end, its detail is not.
Mat3f bounded_stretch(const Mat3f& gradient) {
    if (!gradient.allFinite()) return Mat3f::Identity();
    const Eigen::JacobiSVD<Mat3f> svd(gradient, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const Vec3f& stretch = svd.singularValues();
    if (stretch.maxCoeff() <= 4 && stretch.minCoeff() >= 0.25f) return gradient;
    return svd.matrixU() * stretch.cwiseMax(0.25f).cwiseMin(4).asDiagonal() * svd.matrixV().transpose();
}

Error usage(std::string sentence) { return {ErrorCode::usage, std::move(sentence)}; }

constexpr std::uint64_t kStateMagic = 0x31455441'54534c46; // "FLSTATE1"

} // namespace

struct Simulation::Content {
    Content(World the_world, std::size_t body_count, const StepOptions& the_options)
        : world(std::move(the_world)), options(the_options),
          contacts(world, body_count, the_options.contacts_between_bodies), is_held(body_count, 0) {}

    World world;
    StepOptions options;
    std::vector<BodyState> bodies;
    Contacts contacts;
    std::vector<Grip> grips;
    std::vector<Attachment> attachments;
    std::vector<std::vector<Vec3f>> pinned_from; ///< of each pin: where its particles were at the start
    std::vector<std::uint8_t> is_held;           ///< bodies with pins, forces or wind: not left to themselves
    std::vector<Vectors> wind_forces;            ///< N; empty without wind
    std::size_t frame = 0;

    double frame_seconds() const { return 1 / options.frames_per_second; }
    double time() const { return double(frame) * frame_seconds(); }

    // One evaluation of everything that acts.
    struct Acting {
        double step = std::numeric_limits<double>::infinity(); ///< s, longest stable; 0 where no step is
        std::vector<ElasticReport> elastic;                    ///< of each body
    };
    Acting evaluate(double now, float travelled, float dt, FrameReport& report, const RunContext& context);
    void blow(double now, const RunContext& context);
    Vec3f region_acceleration(const RegionForce& force, double now) const;
    float least_spacing() const;
    float most_speed(double now) const;
    Grip grip(const Hand& hand, const RunContext& context) const;
    bool is_pulled(std::size_t body, double now) const;

    void kick(float dt, bool damp, const RunContext& context);
    void drift(float dt, const RunContext& context);
    void move_pins(double now, float dt);
    void finish_substep(float dt, const RunContext& context);
    void renew(BodyState& body, std::size_t index, const RunContext& context);
    void embed_at_rest(std::size_t body, const RunContext& context);

    bool tame(std::span<const ElasticReport> elastic, FrameReport& report, const RunContext& context);
    double explicit_part(double from, double until, FrameReport& report, const RunContext& context);
    void descent_part(double from, double until, FrameReport& report, const RunContext& context);
    void restore_momentum(BodyState& body, const RigidState& before, float dt) const;

    void attached(const Attachment& attachment, std::span<Vec3f> points, std::span<Mat3f> gradients,
                  const RunContext& context) const;
    std::string save() const;
    Status restore(std::string_view bytes);
};

Simulation::Simulation(std::unique_ptr<Content> content) : content_(std::move(content)) {}
Simulation::Simulation(Simulation&&) noexcept = default;
Simulation& Simulation::operator=(Simulation&&) noexcept = default;
Simulation::~Simulation() = default;

Result<Simulation> Simulation::create(World world, std::vector<Actor> actors, const StepOptions& options,
                                      const RunContext& context) {
    if (actors.empty()) return usage("A simulation needs at least one body.");
    if (!(options.frames_per_second > 0 && std::isfinite(options.frames_per_second)))
        return usage("The number of frames a second must be above 0.");
    if (options.most_substeps == 0 || options.descent_substeps == 0 || options.descent_iterations == 0)
        return usage("Substeps and iterations are counted from 1.");
    for (const Obstacle& obstacle : world.obstacles)
        if (!(obstacle.stiffness > 0 && obstacle.stiffness <= 1))
            return usage("An obstacle's stiffness is above 0, to 1.");
    const auto check_body = [&](std::size_t body, std::span<const Index> particles, const char* what) -> std::string {
        if (body >= actors.size()) return std::string(what) + " belongs to a body that is not there.";
        for (const Index particle : particles)
            if (particle >= actors[body].body->particle_count())
                return std::string(what) + " names a particle that is not there.";
        return "";
    };
    for (const Pin& pin : world.pins)
        if (std::string wrong = check_body(pin.body, pin.particles, "A pin"); !wrong.empty()) return usage(wrong);
    for (const RegionForce& force : world.forces)
        if (std::string wrong = check_body(force.body, force.particles, "A force"); !wrong.empty()) return usage(wrong);
    for (const Hand& hand : world.hands)
        if (std::string wrong = check_body(hand.body, {}, "A hand"); !wrong.empty()) return usage(wrong);

    auto content = std::make_unique<Content>(std::move(world), actors.size(), options);
    for (std::size_t b = 0; b < actors.size(); ++b) {
        const Actor& actor = actors[b];
        BodyState& state = content->bodies.emplace_back();
        state.body = actor.body;
        const Body& body = *actor.body;
        const std::size_t count = body.particle_count();
        if (count == 0) return usage("A body without particles cannot be simulated.");
        state.elasticity = make_elasticity(body, context);
        state.forces = Vectors(count);
        state.rest_rate = state.elasticity->forces(body.rest, state.forces, context).rate;
        state.positions = state.velocities = Vectors(count);
        for (std::size_t i = 0; i < count; ++i)
            state.positions.set(i, (actor.placement * body.rest[i].cast<double>()).cast<float>());
        const Vec3d centre = rigid_state(state).centre;
        for (std::size_t i = 0; i < count; ++i)
            state.velocities.set(
                i, (actor.velocity + actor.spin.cross(state.positions[i].cast<double>() - centre)).cast<float>());
        state.fixed.assign(count, 0);
        state.inverse_mass.resize(count);
        for (std::size_t i = 0; i < count; ++i) state.inverse_mass[i] = 1 / body.mass[i];

        state.skin = body.skin.points;
        state.skin_stiffness = skin_stiffness(body, state.skin, state.rest_rate);
        state.ball_radius = kBallRadius * float(body.spacing());
        if (actors.size() > 1) state.balls = embed_balls(state, context);
    }
    for (const Pin& pin : content->world.pins) {
        BodyState& body = content->bodies[pin.body];
        std::vector<Vec3f>& from = content->pinned_from.emplace_back();
        for (const Index particle : pin.particles) {
            body.fixed[particle] = 1;
            body.inverse_mass[particle] = 0;
            from.push_back(body.positions[particle]);
        }
        content->is_held[pin.body] = 1;
    }
    for (const RegionForce& force : content->world.forces) content->is_held[force.body] = 1;
    const bool has_wind = content->world.air_density > 0;
    if (has_wind)
        for (std::size_t b = 0; b < actors.size(); ++b) {
            content->wind_forces.emplace_back(content->bodies[b].positions.size());
            content->is_held[b] = 1;
        }
    for (const Hand& hand : content->world.hands) content->grips.push_back(content->grip(hand, context));
    content->move_pins(0, 0);
    return Simulation(std::move(content));
}

Grip Simulation::Content::grip(const Hand& hand, const RunContext& context) const {
    const BodyState& body = bodies[hand.body];
    const Vectors& reference = body.elasticity->reference();
    const float radius = 4 * float(body.body->spacing());
    Grip grip{hand, {}, Vec3f::Zero(), 0, 0, 0};
    grip.region.rest = {hand.point};
    double mass = 0, region_mass = 0;
    std::size_t nearest = 0;
    for (std::size_t i = 0; i < reference.size(); ++i) {
        if ((reference[i] - hand.point).squaredNorm() < (reference[nearest] - hand.point).squaredNorm()) nearest = i;
        const float part = 1 - (reference[i] - hand.point).squaredNorm() / (radius * radius);
        if (!(part > 0)) continue;
        grip.region.particles.push_back(Index(i));
        grip.region.weights.push_back(part * body.body->mass[i]);
        mass += double(grip.region.weights.back());
        region_mass += double(part) * double(part) * double(body.body->mass[i]);
    }
    if (grip.region.particles.empty()) {
        grip.region.particles = {Index(nearest)};
        grip.region.weights = {body.body->mass[nearest]};
        mass = region_mass = double(body.body->mass[nearest]);
    }
    for (float& weight : grip.region.weights) weight /= float(mass);
    grip.region.offsets = {0, Index(grip.region.particles.size())};
    std::vector<Mat3f> gradients(reference.size());
    body.elasticity->gradients(body.positions, gradients, context);
    Mat3f gradient = Mat3f::Zero();
    for (std::size_t k = 0; k < grip.region.particles.size(); ++k)
        gradient += grip.region.weights[k] * gradients[grip.region.particles[k]];
    grip.offset = gradient * (hand.point - embedded_point(grip.region, 0, reference));
    // A pull of k gives particle i the rate k w_i / m_i, at most k / (sum of weighted masses).
    const double stiffest = double(kHandRate) * double(body.rest_rate) * mass;
    grip.stiffness = float(hand.stiffness > 0 ? std::min(hand.stiffness, stiffest) : stiffest / 8);
    grip.damping = std::sqrt(grip.stiffness * float(mass * mass / region_mass));
    grip.rate = kHandRate * body.rest_rate;
    return grip;
}

bool Simulation::Content::is_pulled(std::size_t body, double now) const {
    return std::ranges::any_of(grips, [&](const Grip& grip) {
        return grip.hand.body == body && grip.hand.from <= now && now < grip.hand.until;
    });
}

Simulation::Content::Acting Simulation::Content::evaluate(double now, float travelled, float dt, FrameReport& report,
                                                          const RunContext& context) {
    Acting acting;
    acting.elastic.resize(bodies.size());
    std::vector<ElasticReport>& elastic = acting.elastic;
    {
        const Stopwatch watch(report.elastic_seconds);
        for (std::size_t b = 0; b < bodies.size(); ++b) {
            BodyState& body = bodies[b];
            const float delay = float(body.body->material.internal_damping);
            if (delay > 0) { // f(x + tau v) = f(x) - tau K v: Kelvin-Voigt, to first order; of v less its rigid part
                const RigidState rigid = rigid_state(body);
                const Vec3f drifting = (rigid.linear / rigid.mass).cast<float>();
                const Vec3f turning = rigid.turning().cast<float>(), centre = rigid.centre.cast<float>();
                Vectors ahead = body.positions;
                parallel_for(context, ahead.size(), kGrain, [&](std::size_t begin, std::size_t end) {
                    for (std::size_t i = begin; i < end; ++i)
                        ahead.add(i,
                                  delay * (body.velocities[i] - drifting - turning.cross(body.positions[i] - centre)));
                });
                elastic[b] = body.elasticity->forces(ahead, body.forces, context);
            } else {
                elastic[b] = body.elasticity->forces(body.positions, body.forces, context);
            }
            report.least_volume_ratio = std::min(report.least_volume_ratio, elastic[b].least_volume_ratio);
            report.most_stretch = std::max(report.most_stretch, elastic[b].most_stretch);
        }
    }
    {
        const Stopwatch watch(report.contact_seconds);
        const ContactReport touching = contacts.add_forces(bodies, now, travelled, dt, context);
        report.contacts = touching.contacts;
        report.deepest_contact = std::max(report.deepest_contact, double(touching.deepest));
    }
    const Stopwatch watch(report.other_seconds);
    for (const RegionForce& force : world.forces) {
        BodyState& body = bodies[force.body];
        const Vec3f acceleration = region_acceleration(force, now);
        for (const Index particle : force.particles)
            body.forces.add(particle, body.body->mass[particle] * acceleration);
    }
    for (std::size_t b = 0; b < wind_forces.size(); ++b)
        parallel_for(context, bodies[b].forces.size(), kGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) bodies[b].forces.add(i, wind_forces[b][i]);
        });
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        const BodyState& body = bodies[b];
        double rate = double(elastic[b].rate);
        if (contacts.is_touched(b)) rate += double(kContactRate) * double(body.rest_rate);
        for (Grip& grip : grips) {
            if (grip.hand.body != b || !(grip.hand.from <= now && now < grip.hand.until)) continue;
            const Vec3f to_target =
                grip.hand.target.at(now).cast<float>() - grip.offset - embedded_point(grip.region, 0, body.positions);
            const Vec3f force =
                grip.stiffness * to_target - grip.damping * embedded_point(grip.region, 0, body.velocities);
            add_to_particles(grip.region, 0, force, bodies[b].forces);
            rate += double(grip.rate);
        }
        // A spring that is also damped along its own motion: zeta = omega tau / 2.
        const double omega = std::sqrt(rate), zeta = 0.5 * omega * body.body->material.internal_damping;
        const double step = kSafety * 2 / omega * (std::sqrt(1 + zeta * zeta) - zeta);
        acting.step = std::isfinite(rate) ? std::min(acting.step, step) : 0;
    }
    return acting;
}

void Simulation::Content::blow(double now, const RunContext& context) {
    const Vec3f wind = world.wind.at(now).cast<float>();
    for (std::size_t b = 0; b < wind_forces.size(); ++b) {
        BodyState& body = bodies[b];
        std::vector<Mat3f> particle_gradients(body.positions.size()), gradients(body.skin.size());
        std::vector<Vec3f> points(body.skin.size());
        body.elasticity->gradients(body.positions, particle_gradients, context);
        move_embedded(body.skin, body.elasticity->reference(), body.positions, particle_gradients, points, gradients,
                      context);
        Vectors forces(body.positions.size());
        for (std::size_t s = 0; s < body.skin.size(); ++s) {
            const Mat3f& a = gradients[s];
            Mat3f cofactor;
            cofactor << a.col(1).cross(a.col(2)), a.col(2).cross(a.col(0)), a.col(0).cross(a.col(1));
            const Vec3f area = body.body->skin.areas[s] * (cofactor * body.body->skin.normals[s]); // m^2, outward
            const float size = area.norm();
            if (!(size > 0)) continue;
            const float inwards = -(wind - embedded_point(body.skin, s, body.velocities)).dot(area) / size;
            if (!(inwards > 0)) continue;
            // No further than the wind's own speed within the frame, whatever the point weighs.
            float mass = 0;
            for (Index k = body.skin.offsets[s]; k < body.skin.offsets[s + 1]; ++k)
                mass += std::abs(body.skin.weights[k]) * body.body->mass[body.skin.particles[k]];
            const float most = mass * inwards * float(options.frames_per_second) / 8; // a particle has several points
            const float push = std::min(0.5f * float(world.air_density) * inwards * inwards * size, most);
            add_to_particles(body.skin, s, -push / size * area, forces);
        }
        wind_forces[b] = std::move(forces);
    }
}

Vec3f Simulation::Content::region_acceleration(const RegionForce& force, double now) const {
    double mass = 0;
    for (const Index particle : force.particles) mass += double(bodies[force.body].body->mass[particle]);
    return (force.force.at(now) / std::max(mass, 1e-30)).cast<float>();
}

float Simulation::Content::least_spacing() const {
    float spacing = std::numeric_limits<float>::max();
    for (const BodyState& body : bodies) spacing = std::min(spacing, float(body.body->spacing()));
    return spacing;
}

/// Of particles and moving obstacles, m/s.
float Simulation::Content::most_speed(double now) const {
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
    double obstacles = 0;
    for (const Obstacle& obstacle : world.obstacles) {
        const RigidMotion& motion = obstacle.motion;
        if (motion.move.times.empty() && motion.angle.times.empty()) continue;
        const Eigen::Isometry3d before = motion.at(now), after = motion.at(now + frame_seconds());
        for (const BodyState& body : bodies) {
            const Vec3d place = before.inverse() * body.positions[0].cast<double>();
            const double turning =
                (after.linear() - before.linear()).norm() * 2 *
                (place - before.inverse() * body.positions[body.positions.size() - 1].cast<double>()).norm();
            obstacles = std::max(obstacles, ((after * place - before * place).norm() + turning) / frame_seconds());
        }
    }
    return std::sqrt(squared) + float(obstacles);
}

/// Pinned particles too: move_pins sets them right.
void Simulation::Content::kick(float dt, bool damp, const RunContext& context) {
    const Vec3f gravity = world.gravity.cast<float>();
    for (BodyState& body : bodies) {
        const float kept = damp ? std::exp(-2 * dt * float(body.body->material.damping)) : 1.0f;
        parallel_for(context, body.positions.size(), kGrain, [&](std::size_t begin, std::size_t end) {
            const float* light = body.inverse_mass.data();
            const auto kick_axis = [&](std::vector<float>& velocities, const std::vector<float>& forces, float g) {
                float* v = velocities.data();
                const float* f = forces.data();
                for (std::size_t i = begin; i < end; ++i) v[i] = (v[i] + dt * (f[i] * light[i] + g)) * kept;
            };
            kick_axis(body.velocities.x, body.forces.x, gravity.x());
            kick_axis(body.velocities.y, body.forces.y, gravity.y());
            kick_axis(body.velocities.z, body.forces.z, gravity.z());
        });
    }
}

void Simulation::Content::drift(float dt, const RunContext& context) {
    for (BodyState& body : bodies)
        parallel_for(context, body.positions.size(), kGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) body.positions.x[i] += dt * body.velocities.x[i];
            for (std::size_t i = begin; i < end; ++i) body.positions.y[i] += dt * body.velocities.y[i];
            for (std::size_t i = begin; i < end; ++i) body.positions.z[i] += dt * body.velocities.z[i];
        });
}

void Simulation::Content::move_pins(double now, float dt) {
    for (std::size_t p = 0; p < world.pins.size(); ++p) {
        const Pin& pin = world.pins[p];
        const Eigen::Isometry3d motion = pin.motion.at(now), before = pin.motion.at(now - double(dt));
        BodyState& body = bodies[pin.body];
        for (std::size_t k = 0; k < pin.particles.size(); ++k) {
            const Vec3d from = pinned_from[p][k].cast<double>(), place = motion * from;
            body.positions.set(pin.particles[k], place.cast<float>());
            body.velocities.set(pin.particles[k],
                                dt > 0 ? Vec3f(((place - before * from) / double(dt)).cast<float>()) : Vec3f::Zero());
        }
    }
}

void Simulation::Content::attached(const Attachment& attachment, std::span<Vec3f> points, std::span<Mat3f> gradients,
                                   const RunContext& context) const {
    const BodyState& body = bodies[attachment.body];
    std::vector<Mat3f> particle_gradients(body.positions.size());
    body.elasticity->gradients(body.positions, particle_gradients, context);
    move_embedded(attachment.embedding, body.elasticity->reference(), body.positions, particle_gradients, points,
                  gradients, context);
    if (attachment.gradients.empty()) return;
    for (std::size_t i = 0; i < gradients.size(); ++i) gradients[i] = gradients[i] * attachment.gradients[i];
}

void Simulation::Content::renew(BodyState& body, std::size_t index, const RunContext& context) {
    const auto places_of = [&](const Embedding& points) {
        std::vector<Vec3f> places(points.size());
        for (std::size_t i = 0; i < places.size(); ++i) places[i] = embedded_point(points, i, body.positions);
        return places;
    };
    const std::vector<Vec3f> skin = places_of(body.skin), balls = places_of(body.balls);
    std::vector<std::vector<Vec3f>> carried(attachments.size());
    for (std::size_t a = 0; a < attachments.size(); ++a) {
        Attachment& attachment = attachments[a];
        if (attachment.body != index) continue;
        carried[a].resize(attachment.embedding.size());
        std::vector<Mat3f> gradients(attachment.embedding.size());
        attached(attachment, carried[a], gradients, context);
        parallel_for(context, gradients.size(), kGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) gradients[i] = bounded_stretch(gradients[i]);
        });
        attachment.gradients = std::move(gradients);
    }
    body.elasticity->renew(body.positions, context);
    const double spacing = body.body->spacing();
    body.skin = embed(skin, body.positions, spacing, context);
    if (!balls.empty()) body.balls = embed(balls, body.positions, spacing, context);
    for (std::size_t a = 0; a < attachments.size(); ++a)
        if (attachments[a].body == index)
            attachments[a].embedding = embed(carried[a], body.positions, spacing, context);
}

void Simulation::Content::finish_substep(float dt, const RunContext& context) {
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        BodyState& body = bodies[b];
        body.elasticity->finish_substep(body.positions, dt, context);
        if (body.elasticity->wants_renewal()) renew(body, b, context);
    }
}

/// Starts that no step can take: coincident particles are shaken apart, and what is stretched too far is scaled down.
/// Whether anything was done.
bool Simulation::Content::tame(std::span<const ElasticReport> elastic, FrameReport& report, const RunContext& context) {
    bool tamed = false;
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        BodyState& body = bodies[b];
        const std::size_t count = body.positions.size();
        if (std::abs(elastic[b].least_volume_ratio) < 1e-12f) {
            tamed = true;
            for (std::size_t i = 0; i < count; ++i) {
                const auto shake = [&](std::size_t k) {
                    return float((random_unit(context.seed + b, 3 * i + k) - 0.5) * 2e-3 * body.body->spacing());
                };
                if (!body.fixed[i]) body.positions.add(i, {shake(0), shake(1), shake(2)});
            }
        }
        if (elastic[b].most_stretch <= kMostStretch) continue;
        tamed = true;
        const float factor = std::isfinite(elastic[b].most_stretch) ? kStretchAfter / elastic[b].most_stretch : 0.0f;
        Vec3d mean = Vec3d::Zero();
        for (std::size_t i = 0; i < count; ++i) mean += body.positions[i].cast<double>() / double(count);
        if (!mean.allFinite()) mean.setZero();
        for (std::size_t i = 0; i < count; ++i) {
            if (body.fixed[i]) continue;
            const Vec3f from_mean = body.positions[i] - mean.cast<float>();
            const Vec3f scaled = from_mean.allFinite() ? Vec3f(factor * from_mean) : Vec3f::Zero();
            body.positions.set(i, mean.cast<float>() + scaled);
            body.velocities.set(i, Vec3f::Zero());
            ++report.clamped_particles;
        }
    }
    return tamed;
}

/// Steps explicitly as far as that goes. Returns the time reached: earlier than `until` when steps became too many
/// (for the caller to go on in another way) or the work was cancelled.
double Simulation::Content::explicit_part(double from, double until, FrameReport& report, const RunContext& context) {
    double now = from;
    float travelled = 0;
    const bool meets_anything = !world.obstacles.empty() || bodies.size() > 1;
    const auto look_around = [&] {
        if (!meets_anything) return;
        const Stopwatch watch(report.contact_seconds);
        const float speed = most_speed(now) + float(world.gravity.norm() * frame_seconds());
        contacts.look_around(bodies, now, travelled,
                             std::clamp(2 * speed * float(until - now), 0.25f * least_spacing(), 4 * least_spacing()),
                             0.5f * least_spacing(), context);
    };
    look_around();
    const float first_dt = float(frame_seconds() / options.most_substeps);
    Acting acting = evaluate(now, 0, first_dt, report, context);
    if (tame(acting.elastic, report, context)) acting = evaluate(now, 0, first_dt, report, context);
    const unsigned limit = options.mode == StepMode::automatic ? options.most_substeps : kExplicitLimit;
    while (until - now > 1e-9 * frame_seconds()) {
        const double remaining = until - now;
        const double fewest = std::ceil(kLeastSubsteps * remaining / frame_seconds() - 1e-6);
        const double steps =
            acting.step > 0 ? std::max(fewest, std::ceil(remaining / acting.step)) : kExplicitLimit + 1.0;
        const double allowed = report.substeps == 0 ? limit : 2.0 * limit - report.substeps;
        if (!(steps <= allowed) || context.is_cancelled()) return now;
        const float dt = float(remaining / steps);
        {
            const Stopwatch watch(report.other_seconds);
            kick(0.5f * dt, false, context);
            drift(dt, context);
            now = steps <= 1 ? until : now + double(dt);
            move_pins(now, dt);
            if (meets_anything) travelled += dt * most_speed(now);
        }
        look_around();
        acting = evaluate(now, travelled, dt, report, context);
        {
            const Stopwatch watch(report.contact_seconds);
            contacts.push_out(bodies, now);
        }
        const Stopwatch watch(report.other_seconds);
        kick(0.5f * dt, true, context);
        move_pins(now, dt);
        finish_substep(dt, context);
        ++report.substeps;
    }
    return until;
}

/// Implicit Euler takes angular momentum away however well it is solved; a body that nothing touches gets it back.
void Simulation::Content::restore_momentum(BodyState& body, const RigidState& before, float dt) const {
    RigidState after = rigid_state(body);
    const double t = double(dt), kept = std::exp(-t * body.body->material.damping);
    const Vec3d linear = (before.linear + t * before.mass * world.gravity) * kept;
    const Vec3d centre = before.centre + t / before.mass * before.linear + 0.5 * t * t * world.gravity;
    const Vec3d shift = (linear - after.linear) / after.mass;
    const Vec3d turn = (after.inertia + 1e-12 * after.inertia.trace() * Mat3d::Identity())
                           .ldlt()
                           .solve(before.angular * kept - after.angular);
    const double size = std::sqrt(after.inertia.trace() / after.mass);
    const double rounding = 1e-7 * std::max(centre.norm(), size);
    if ((centre - after.centre).norm() + t * (shift.norm() + size * turn.norm()) < rounding) return;
    for (std::size_t i = 0; i < body.positions.size(); ++i) {
        const Vec3d arm = body.positions[i].cast<double>() - after.centre;
        body.velocities.add(i, (shift + turn.cross(arm)).cast<float>());
        body.positions.add(i, (centre - after.centre).cast<float>());
    }
}

void Simulation::Content::descent_part(double from, double until, FrameReport& report, const RunContext& context) {
    const unsigned steps =
        std::max(1u, unsigned(std::lround(options.descent_substeps * (until - from) / frame_seconds())));
    const double step = (until - from) / steps;
    const float dt = float(step);
    for (unsigned s = 0; s < steps && !context.is_cancelled(); ++s) {
        const double now = s + 1 == steps ? until : from + (s + 1) * step;
        std::vector<ElasticReport> elastic(bodies.size());
        std::vector<RigidState> before(bodies.size());
        std::vector<Vectors> start(bodies.size()), target(bodies.size());
        std::vector<std::vector<float>> inertia(bodies.size());
        std::vector<Contacts::Blocks> blocks(bodies.size());
        {
            const Stopwatch watch(report.contact_seconds);
            const float speed = most_speed(now) + float(world.gravity.norm()) * dt;
            const float way = 1.5f * speed * dt, spacing = least_spacing();
            contacts.forget();
            contacts.look_around(bodies, now, 0, std::clamp(way, 0.25f * spacing, 8 * spacing),
                                 std::clamp(way, 0.25f * spacing, 0.75f * spacing), context);
            for (std::size_t b = 0; b < bodies.size(); ++b)
                blocks[b] = contacts.blocks(bodies, b, now, dt, [&](Contacts::Blocks& all) {
                    for (const Grip& grip : grips)
                        if (grip.hand.body == b && grip.hand.from <= now && now < grip.hand.until)
                            all.add_pull(grip.region, 0, grip.hand.target.at(now).cast<float>() - grip.offset,
                                         grip.stiffness);
                });
        }
        {
            const Stopwatch watch(report.elastic_seconds);
            for (std::size_t b = 0; b < bodies.size(); ++b)
                elastic[b] = bodies[b].elasticity->forces(bodies[b].positions, bodies[b].forces, context);
        }
        tame(elastic, report, context);
        {
            const Stopwatch watch(report.other_seconds);
            std::vector<Vectors> outside(bodies.size());
            for (std::size_t b = 0; b < bodies.size(); ++b) outside[b] = Vectors(bodies[b].positions.size());
            for (const RegionForce& force : world.forces) {
                const Vec3f acceleration = region_acceleration(force, now);
                for (const Index particle : force.particles) outside[force.body].add(particle, acceleration);
            }
            for (std::size_t b = 0; b < bodies.size(); ++b) {
                BodyState& body = bodies[b];
                const std::size_t count = body.positions.size();
                before[b] = rigid_state(body);
                start[b] = body.positions;
                target[b] = Vectors(count);
                inertia[b].resize(count);
                const bool wild = !(elastic[b].least_volume_ratio > 0) || !(elastic[b].most_stretch < kStretchAfter);
                const bool falls = !is_held[b] && !contacts.is_touched(b);
                for (std::size_t i = 0; i < count; ++i) {
                    Vec3f acceleration = world.gravity.cast<float>() + outside[b][i];
                    if (!wind_forces.empty()) acceleration += body.inverse_mass[i] * wind_forces[b][i];
                    const Vec3f coasted = body.positions[i] + dt * body.velocities[i];
                    inertia[b][i] = body.body->mass[i] / (dt * dt);
                    target[b].set(i, coasted + dt * dt * acceleration);
                    if (!wild && !body.fixed[i]) body.positions.set(i, falls ? target[b][i] : coasted);
                }
            }
            move_pins(now, dt);
        }
        for (unsigned iteration = 0; iteration < options.descent_iterations; ++iteration) {
            if (context.is_cancelled()) return;
            const Stopwatch watch(report.elastic_seconds);
            for (std::size_t b = 0; b < bodies.size(); ++b) {
                blocks[b].look(bodies[b].positions);
                bodies[b].elasticity->sweep(bodies[b].positions,
                                            {target[b], inertia[b], bodies[b].fixed, blocks[b].touched(), &blocks[b]},
                                            context);
            }
        }
        {
            const Stopwatch watch(report.contact_seconds);
            const ContactReport touching = contacts.update_anchors(bodies, now);
            report.contacts = touching.contacts;
            report.deepest_contact = std::max(report.deepest_contact, double(touching.deepest));
        }
        const Stopwatch watch(report.other_seconds);
        for (std::size_t b = 0; b < bodies.size(); ++b) {
            BodyState& body = bodies[b];
            const float kept = std::exp(-dt * float(body.body->material.damping));
            for (std::size_t i = 0; i < body.positions.size(); ++i)
                if (!body.fixed[i]) body.velocities.set(i, (body.positions[i] - start[b][i]) / dt * kept);
            if (!is_held[b] && !contacts.is_touched(b) && !is_pulled(b, now)) restore_momentum(body, before[b], dt);
            report.least_volume_ratio = std::min(report.least_volume_ratio, elastic[b].least_volume_ratio);
            report.most_stretch = std::max(report.most_stretch, elastic[b].most_stretch);
        }
        contacts.push_out(bodies, now);
        finish_substep(dt, context);
        ++report.substeps;
    }
}

Result<FrameReport> Simulation::advance(const RunContext& context) {
    if (context.is_cancelled()) return cancelled_error();
    Content& content = *content_;
    const std::string undo = content.save();
    const double from = content.time(), until = double(content.frame + 1) * content.frame_seconds();
    FrameReport report;
    content.contacts.forget();
    content.contacts.forget_touches();
    if (!content.wind_forces.empty()) content.blow(from, context);

    double reached = from;
    if (content.options.mode != StepMode::descent) reached = content.explicit_part(from, until, report, context);
    const auto is_sound = [&] {
        return std::ranges::all_of(content.bodies, [](const BodyState& body) {
            return is_finite(body.positions) && is_finite(body.velocities);
        });
    };
    if (!context.is_cancelled() && !is_sound()) { // an explicit frame that failed is done again
        if (Status undone = content.restore(undo); !undone) return undone.error();
        report = {.elastic_seconds = report.elastic_seconds,
                  .contact_seconds = report.contact_seconds,
                  .other_seconds = report.other_seconds};
        reached = from;
    }
    if (!context.is_cancelled() && reached < until) {
        report.used = StepMode::descent;
        content.descent_part(reached, until, report, context);
    }
    if (context.is_cancelled()) {
        if (Status undone = content.restore(undo); !undone) return undone.error();
        return cancelled_error();
    }
    for (BodyState& body : content.bodies)
        for (std::size_t i = 0; i < body.positions.size(); ++i) {
            if (body.positions[i].allFinite() && body.velocities[i].allFinite()) continue;
            // What cannot be computed stays with its body, at rest.
            const Vec3f rest = body.elasticity->reference()[i];
            body.positions.set(i, body.positions[i].allFinite() ? body.positions[i] : rest);
            body.velocities.set(i, Vec3f::Zero());
            ++report.clamped_particles;
        }
    ++content.frame;
    return report;
}

std::size_t Simulation::frame() const { return content_->frame; }
double Simulation::time() const { return content_->time(); }
const World& Simulation::world() const { return content_->world; }
std::size_t Simulation::body_count() const { return content_->bodies.size(); }
const Body& Simulation::body(std::size_t body) const { return *content_->bodies[body].body; }
const Vectors& Simulation::positions(std::size_t body) const { return content_->bodies[body].positions; }
const Vectors& Simulation::velocities(std::size_t body) const { return content_->bodies[body].velocities; }
void Simulation::set_positions(std::size_t body, const Vectors& positions) {
    content_->bodies[body].positions = positions;
}
void Simulation::set_velocities(std::size_t body, const Vectors& velocities) {
    content_->bodies[body].velocities = velocities;
}
void Simulation::set_hands(std::vector<Hand> hands, const RunContext& context) {
    content_->grips.clear();
    for (const Hand& hand : hands) content_->grips.push_back(content_->grip(hand, context));
    content_->world.hands = std::move(hands);
}

Energy Simulation::energy(const RunContext& context) const {
    Energy energy;
    for (const BodyState& body : content_->bodies) {
        energy.elastic += body.elasticity->energy(body.positions, context);
        for (std::size_t i = 0; i < body.positions.size(); ++i) {
            const double mass = double(body.body->mass[i]);
            energy.kinetic += 0.5 * mass * body.velocities[i].cast<double>().squaredNorm();
            energy.potential -= mass * content_->world.gravity.dot(body.positions[i].cast<double>());
        }
    }
    return energy;
}

Momentum Simulation::momentum() const {
    Momentum momentum;
    for (const BodyState& body : content_->bodies) {
        const RigidState state = rigid_state(body);
        momentum.linear += state.linear;
        momentum.angular += state.angular + state.centre.cross(state.linear);
    }
    return momentum;
}

std::size_t Simulation::attach(std::size_t body, std::span<const Vec3f> points, const RunContext& context) {
    const BodyState& state = content_->bodies[body];
    content_->attachments.push_back({body, {points.begin(), points.end()}, {}, {}});
    content_->attachments.back().embedding =
        embed(points, state.elasticity->reference(), state.body->spacing(), context);
    return content_->attachments.size() - 1;
}

void Simulation::attached(std::size_t attachment, std::span<Vec3f> points, std::span<Mat3f> gradients,
                          const RunContext& context) const {
    content_->attached(content_->attachments[attachment], points, gradients, context);
}

/// Points are kept only where neighbourhoods were renewed: elsewhere they are embedded as they were at the start.
std::string Simulation::Content::save() const {
    ByteWriter writer;
    writer.value(kStateMagic);
    writer.value(std::uint64_t(frame));
    writer.value(std::uint64_t(bodies.size()));
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        const BodyState& body = bodies[b];
        writer.value(std::uint64_t(body.positions.size()));
        writer.vectors(body.positions);
        writer.vectors(body.velocities);
        const std::string elastic = body.elasticity->state();
        writer.array(std::span(elastic));
        const bool renewed = body.skin.rest != body.body->skin.points.rest;
        writer.value(std::uint64_t(renewed));
        if (!renewed) continue;
        writer.array(std::span(body.skin.rest));
        writer.array(std::span(body.balls.rest));
        for (const Attachment& attachment : attachments)
            if (attachment.body == b) {
                writer.array(std::span(attachment.embedding.rest));
                writer.array(std::span(attachment.gradients));
            }
    }
    const std::vector<Contacts::Anchor> anchors = contacts.anchors();
    writer.array(std::span(anchors));
    return writer.take();
}

Status Simulation::Content::restore(std::string_view bytes) {
    const Error damaged{ErrorCode::bad_file, "The saved state is damaged; start the simulation anew."};
    const Error other{ErrorCode::mismatch,
                      "The saved state is of other bodies; resume it with the scene it was saved from."};
    ByteReader reader(bytes);
    if (reader.value<std::uint64_t>() != kStateMagic) return damaged;
    const std::uint64_t saved_frame = reader.value<std::uint64_t>();
    if (reader.value<std::uint64_t>() != bodies.size()) return reader.ok() ? other : damaged;
    const RunContext context(1);
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        BodyState& body = bodies[b];
        const std::size_t count = body.positions.size();
        if (reader.value<std::uint64_t>() != count) return reader.ok() ? other : damaged;
        Vectors positions = reader.vectors(count), velocities = reader.vectors(count);
        const std::vector<char> elastic = reader.array<char>();
        if (!reader.ok()) return damaged;
        if (!body.elasticity->restore_state({elastic.data(), elastic.size()})) return other;
        body.positions = std::move(positions);
        body.velocities = std::move(velocities);
        if (reader.value<std::uint64_t>() == 0) {
            embed_at_rest(b, context);
            continue;
        }
        const Vectors& reference = body.elasticity->reference();
        const double spacing = body.body->spacing();
        const auto read_points = [&](Embedding& points) {
            const std::vector<Vec3f> rest = reader.array<Vec3f>();
            if (rest.size() != points.size()) return false;
            if (rest != points.rest) points = embed(rest, reference, spacing, context);
            return true;
        };
        if (!read_points(body.skin) || !read_points(body.balls)) return reader.ok() ? other : damaged;
        for (Attachment& attachment : attachments)
            if (attachment.body == b) {
                if (!read_points(attachment.embedding)) return reader.ok() ? other : damaged;
                attachment.gradients = reader.array<Mat3f>();
                if (!attachment.gradients.empty() && attachment.gradients.size() != attachment.embedding.size())
                    return reader.ok() ? other : damaged;
            }
    }
    const std::vector<Contacts::Anchor> anchors = reader.array<Contacts::Anchor>();
    if (!reader.ok() || !reader.at_end()) return damaged;
    for (const Contacts::Anchor& anchor : anchors)
        if (anchor.body >= bodies.size() || anchor.obstacle >= world.obstacles.size() ||
            anchor.point >= bodies[anchor.body].skin.size())
            return damaged;
    contacts.set_anchors(anchors);
    frame = saved_frame;
    return Success{};
}

/// What is embedded in a body, as before its neighbourhoods were ever renewed.
void Simulation::Content::embed_at_rest(std::size_t b, const RunContext& context) {
    BodyState& body = bodies[b];
    if (body.skin.rest == body.body->skin.points.rest) return;
    body.skin = body.body->skin.points;
    if (body.balls.size() != 0) body.balls = embed_balls(body, context);
    for (Attachment& attachment : attachments)
        if (attachment.body == b) {
            attachment.embedding = embed(attachment.points, body.body->rest, body.body->spacing(), context);
            attachment.gradients.clear();
        }
}

std::string Simulation::save() const { return content_->save(); }
Status Simulation::restore(std::string_view bytes) {
    const std::string before = content_->save();
    Status restored = content_->restore(bytes);
    if (!restored) (void)content_->restore(before);
    return restored;
}

} // namespace filigree
