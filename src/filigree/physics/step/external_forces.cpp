#include "filigree/physics/step/external_forces.h"

#include "filigree/core/parallel_for.h"
#include "filigree/physics/body/embedding.h"
#include "filigree/physics/fem/cofactor.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

constexpr std::size_t kExternalForcesGrain = 2048;
constexpr float kHandShare = 0.25f; // of the body's squared frequency at rest: a hand may add that much
constexpr double kHandReach = 4;    // spacings

/// m/s^2, of every particle of the region: the force is shared out by mass.
Vec3f region_acceleration(const RegionForce& force, const Body& body, double time) {
    double mass = 0;
    force.each_particle(body.particle_count(), [&](Index particle) { mass += double(body.mass[particle]); });
    return (force.force.at(time) / std::max(mass, 1e-30)).cast<float>();
}

Vec3f push_of_wind(const BodyState& body, std::size_t point, const Mat3f& gradient, const Vec3f& wind,
                   double air_density, double frames_per_second) {
    const BodySurface& surface = body.body->surface;
    const Vec3f area = surface.areas[point] * (cofactor(gradient) * surface.normals[point]); // m^2, outward
    const float size = area.norm();
    if (!(size > 0)) return Vec3f::Zero();
    const float inwards = -(wind - embedded_point(body.surface, point, body.velocities)).dot(area) / size;
    if (!(inwards > 0)) return Vec3f::Zero();
    float mass = 0;
    for (Index k = body.surface.offsets[point]; k < body.surface.offsets[point + 1]; ++k)
        mass += std::abs(body.surface.weights[k]) * body.body->mass[body.surface.particles[k]];
    return -wind_push(air_density, inwards, size, mass, frames_per_second) / size * area;
}

/// From rest to now, around the particles of a region.
Mat3f region_gradient(const Embedding& region, const BodyState& body, const RunContext& context) {
    Mat3f gradient = Mat3f::Zero();
    if (!body.elasticity) {
        Vec3f place;
        fit_embedded(region, body.body->rest, body.positions, std::span(&place, 1), std::span(&gradient, 1), context);
        return bounded_stretch(gradient);
    }
    std::vector<Mat3f> gradients(body.positions.size());
    body.elasticity->gradients(body.positions, gradients, context);
    for (std::size_t k = 0; k < region.particles.size(); ++k)
        gradient += region.weights[k] * gradients[region.particles[k]];
    return gradient;
}

} // namespace

Grip make_grip(const Hand& hand, const BodyState& body, const RunContext& context) {
    const Vectors& rest = body.body->rest;
    const Vec3f point = hand.point;
    const float reach = float(kHandReach) * float(body.body->spacing());
    Grip grip{.hand = hand, .region = {}};
    grip.region.rest = {point};
    double mass = 0, region_mass = 0;
    std::size_t nearest = 0;
    for (std::size_t i = 0; i < rest.size(); ++i) {
        const float squared = (rest[i] - point).squaredNorm();
        if (squared < (rest[nearest] - point).squaredNorm()) nearest = i;
        const float part = 1 - squared / (reach * reach);
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
    grip.offset = region_gradient(grip.region, body, context) * (point - embedded_point(grip.region, 0, rest));
    // A pull of k gives particle i the squared frequency k w_i / m_i, at most k / (sum of weighted masses).
    const double stiffest = double(kHandShare) * double(body.rest_squared_frequency) * mass;
    grip.stiffness = float(hand.stiffness > 0 ? std::min(hand.stiffness, stiffest) : stiffest / 8);
    grip.damping = std::sqrt(grip.stiffness * float(mass * mass / region_mass));
    grip.squared_frequency = kHandShare * body.rest_squared_frequency;
    return grip;
}

bool ExternalForces::pull(std::size_t body, double time) const {
    return std::ranges::any_of(grips_, [&](const Grip& grip) { return grip.pulls(body, time); });
}

void ExternalForces::find_wind(std::span<const BodyState> bodies, double time, double frames_per_second,
                               const RunContext& context) {
    if (!has_wind()) return;
    const Vec3f wind = world_.wind.at(time).cast<float>();
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        const BodyState& body = bodies[b];
        if (body.is_absent) continue;
        std::vector<Mat3f> particle_gradients(body.positions.size()), gradients(body.surface.size());
        std::vector<Vec3f> points(body.surface.size());
        body.elasticity->gradients(body.positions, particle_gradients, context);
        move_embedded(body.surface, body.body->rest, body.positions, particle_gradients, points, gradients, context);
        Vectors forces(body.positions.size());
        for (std::size_t s = 0; s < body.surface.size(); ++s) {
            if (body.is_hidden(s)) continue;
            const Vec3f push = push_of_wind(body, s, gradients[s], wind, world_.air_density, frames_per_second);
            if (!push.isZero(0)) add_to_particles(body.surface, s, push, forces);
        }
        wind_[b] = std::move(forces);
    }
}

template <class State, class Visit>
void ExternalForces::each_push(std::span<State> bodies, double time, const Visit& visit) const {
    const auto push = [&](std::size_t pushed, Index particle, const Vec3f& acceleration) {
        each_copy(bodies, pushed, particle,
                  [&](State& body, std::size_t index, Index copy) { visit(body, index, copy, acceleration); });
    };
    for (const RegionForce& force : world_.forces) {
        const Body& body = *bodies[force.body].body;
        const Vec3f acceleration = region_acceleration(force, body, time);
        force.each_particle(body.particle_count(), [&](Index particle) { push(force.body, particle, acceleration); });
    }
    for (std::size_t b = 0; b < pushes_.size(); ++b)
        for (Index i = 0; i < pushes_[b].size(); ++i)
            if (const Vec3f force = pushes_[b][i]; !force.isZero(0)) push(b, i, force / bodies[b].body->mass[i]);
}

void ExternalForces::add_forces(std::span<BodyState> bodies, double time, const RunContext& context) const {
    each_push(bodies, time, [](BodyState& body, std::size_t, Index particle, const Vec3f& acceleration) {
        if (!body.is_on_grid) body.forces.add(particle, body.body->mass[particle] * acceleration);
    });
    if (!has_wind()) return;
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        if (bodies[b].is_absent) continue;
        parallel_for(context, bodies[b].forces.size(), kExternalForcesGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) bodies[b].forces.add(i, wind_[b][i]);
        });
    }
}

void ExternalForces::add_forces_on_grid(std::span<BodyState> bodies, double time) const {
    each_push(bodies, time, [](BodyState& body, std::size_t, Index particle, const Vec3f& acceleration) {
        if (body.is_on_grid) body.forces.add(particle, body.body->mass[particle] * acceleration);
    });
    for (std::size_t b = 0; b < bodies.size(); ++b)
        if (bodies[b].is_on_grid) add_pulls(bodies[b], b, time, 0);
}

bool ExternalForces::acts_on(std::size_t body, double time) const {
    return push(body) || pull(body, time) ||
           std::ranges::any_of(world_.forces, [&](const RegionForce& force) { return force.body == body; });
}

double ExternalForces::add_pulls(BodyState& body, std::size_t index, double time, double squared_frequency) const {
    for (const Grip& grip : grips_) {
        if (!grip.pulls(index, time)) continue;
        const Vec3f to_target = grip.target(time) - embedded_point(grip.region, 0, body.positions);
        const Vec3f force = grip.stiffness * to_target - grip.damping * embedded_point(grip.region, 0, body.velocities);
        add_to_particles(grip.region, 0, force, body.forces);
        squared_frequency += double(grip.squared_frequency);
    }
    return squared_frequency;
}

} // namespace filigree
