// Contacts in explicit steps: forces of what touches, and moving out what is too deep.
#include "filigree/physics/contact/contact.h"

#include "filigree/core/bits.h"
#include "filigree/core/parallel_for.h"
#include "filigree/physics/contact/contact_law.h"

#include <algorithm>

namespace filigree {

using namespace contact_law;

namespace {

constexpr std::size_t kContactForcesGrain = 256, kObstacleForcesGrain = 16; // bodies
constexpr std::size_t kBlocksGrain = 4;

constexpr float kCrushing = 0.5f; ///< spacings: what touches deeper may be crushed inside
constexpr float kInside = 2;      ///< spacings below the surface at rest: what lies deeper counts as this deep
constexpr float kThinnest = 0.1f; ///< of their depth at rest, to which crushed parts are pressed

/// Spacings of a particle below the surface at rest; corners of cells may lie outside, below 0.
float rest_depth(const Body& body, const Vec3f& particle) {
    return body.field ? (body.field_radius - body.field->at(particle).distance) / float(body.spacing()) : kInside;
}

/// m that each particle may go into an obstacle: at the surface as deep as a penalty is trusted with, a spacing below
/// it not at all. What lies deeper stays outside; corners outside of the surface may go further.
std::vector<float> most_depths_of(const Body& body, const RunContext& context) {
    constexpr float kStretched = 2; // what is outside may be stretched
    const float spacing = float(body.spacing());
    std::vector<float> most(body.particle_count());
    parallel_for(context, most.size(), kContactForcesGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const float depth = rest_depth(body, body.rest[i]);
            most[i] =
                spacing * (depth < 0 ? kDeepest - kStretched * depth
                                     : kDeepest * std::max(0.0f, 1 - depth) - kThinnest * std::min(depth, kInside));
        }
    });
    return most;
}

} // namespace

/// The force on a surface point; lets friction's anchor begin, slide and end.
Vec3f Contacts::obstacle_force(Near& at, float& clear_until, const BodyState& body, const ObstaclePoses& poses,
                               float dt) const {
    at.depth = 0;
    const Obstacle& obstacle = world_.obstacles[at.obstacle];
    const Vec3f place = embedded_point(body.surface, at.point, body.positions);
    const DistanceField::Sample surface = poses.distance_to(at.obstacle, place);
    clear_until = near_way_ + surface.distance;
    if (!(surface.distance < 0)) {
        at.grasp = {};
        return Vec3f::Zero();
    }
    at.depth = -surface.distance;
    const Touch touch{surface.normal,
                      embedded_point(body.surface, at.point, body.velocities) - poses.velocity(at.obstacle, place),
                      at.depth,
                      body.surface_stiffness[at.point] * float(obstacle.stiffness),
                      float(obstacle.friction),
                      float(obstacle.restitution),
                      body.rest_squared_frequency * float(obstacle.stiffness)};
    Vec3f offset = Vec3f::Zero();
    if (at.grasp.holds) offset = along_surface(place - poses.to_world(at.obstacle, at.anchor), surface.normal);
    const bool landed = !at.grasp.holds;
    const Vec3f force = touch_force(touch, offset, at.grasp, dt, smooth_speed(world_, dt));
    if (landed || at.grasp.slides) at.anchor = poses.to_own_axes(at.obstacle, place - offset);
    return force;
}

void Contacts::travel(std::span<BodyState> bodies, float dt, float obstacle_way, const RunContext& context) {
    place_corners(bodies, context);
    matter_.travel(bodies, dt, context);
    near_way_ += dt * approach_speed(bodies) + obstacle_way;
}

float Contacts::approach_speed(std::span<const BodyState> bodies) const {
    float most = 0;
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        if (bodies[b].is_absent || bodies[b].sleeps()) continue;
        for (const Vec3f& towards : towards_) {
            const float speed = towards.isZero(0) ? matter_.speed(b) : matter_.speed_along(b, towards);
            most = speed > most ? speed : most; // not a number: the frame is done again
        }
    }
    return most;
}

/// forces: room.
ContactReport Contacts::add_obstacle_forces(BodyState& body, std::size_t b, const ObstaclePoses& poses, float dt,
                                            std::vector<Vec3f>& forces, const RunContext& context) {
    ContactReport report;
    constexpr std::size_t kBlock = NearPoints::kBlock;
    std::vector<Near>& points = near_[b].points;
    std::vector<float>& clear_until = near_[b].clear_until;
    std::vector<std::uint64_t> touching(near_[b].blocks()); // bits of each block
    forces.resize(points.size());
    parallel_for(context, touching.size(), kBlocksGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t block = begin; block < end; ++block) {
            const std::size_t first = block * kBlock, left = points.size() - first;
            const float* until = &clear_until[first];
            std::uint64_t asked = bits_where<kBlock>([&](std::size_t k) { return !(until[k] > near_way_); });
            if (left < kBlock) asked &= (std::uint64_t{1} << left) - 1; // also where a way is not a number
            for_each_bit(asked, [&](int bit) { read_ahead(body.surface, points[first + std::size_t(bit)].point); });
            for_each_bit(asked, [&](int bit) {
                const std::size_t k = first + std::size_t(bit);
                forces[k] = obstacle_force(points[k], clear_until[k], body, poses, dt);
                touching[block] |= std::uint64_t{points[k].depth > 0} << bit;
            });
        }
    });
    for (std::size_t block = 0; block < touching.size(); ++block)
        for_each_bit(touching[block], [&](int bit) {
            const std::size_t k = block * kBlock + std::size_t(bit);
            add_to_particles(body.surface, points[k].point, forces[k], body.forces);
            touched_[b] |= kOnObstacle;
            ++report.contacts;
            report.deepest = std::max(report.deepest, points[k].depth);
        });
    deepest_near_[b] = report.deepest;
    return report;
}

ContactReport Contacts::add_forces(std::span<BodyState> bodies, double time, float dt, const RunContext& context) {
    ContactReport report;
    const ObstaclePoses poses(world_, time);
    std::vector<ContactReport> reports(bodies.size());
    parallel_for(context, bodies.size(), kObstacleForcesGrain, [&](std::size_t begin, std::size_t end) {
        std::vector<Vec3f> forces;
        for (std::size_t b = begin; b < end; ++b) {
            touched_[b] = 0;
            deepest_near_[b] = 0;
            if (!bodies[b].sleeps()) reports[b] = add_obstacle_forces(bodies[b], b, poses, dt, forces, context);
        }
    });
    for (const ContactReport& of_body : reports) {
        report.contacts += of_body.contacts;
        report.deepest = std::max(report.deepest, of_body.deepest);
    }
    const ContactReport inside = matter_.add_forces(bodies, dt, touched_, context);
    report.contacts += inside.contacts;
    report.deepest_in_matter = inside.deepest_in_matter;
    return report;
}

void Contacts::push_out(std::span<BodyState> bodies, double time, const RunContext& context) {
    const ObstaclePoses poses(world_, time);
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        BodyState& body = bodies[b];
        const float spacing = float(body.body->spacing()), most = kDeepest * spacing;
        if (!(deepest_near_[b] > kCrushing * spacing) || body.sleeps()) continue;
        std::vector<Vec3f> outwards; // of what is deep in each obstacle
        for (const Near& at : near_[b].points) {
            if (!(at.depth > kCrushing * spacing)) continue;
            const Vec3f place = embedded_point(body.surface, at.point, body.positions);
            const DistanceField::Sample surface = poses.distance_to(at.obstacle, place);
            const float gives = yielding(body.surface, at.point, body.inverse_mass);
            if (!(gives > 0)) continue;
            outwards.resize(world_.obstacles.size(), Vec3f::Zero());
            outwards[at.obstacle] += surface.normal;
            if (!(-surface.distance > most)) continue;
            const float inwards = std::min(
                0.0f, (embedded_point(body.surface, at.point, body.velocities) - poses.velocity(at.obstacle, place))
                          .dot(surface.normal));
            const Vec3f way = (-surface.distance - most) / gives * surface.normal;
            const Vec3f push = -inwards / gives * surface.normal;
            for (Index k = body.surface.offsets[at.point]; k < body.surface.offsets[at.point + 1]; ++k)
                push_particle(body, body.surface.particles[k], body.surface.weights[k], way, push);
        }
        for (std::size_t o = 0; o < outwards.size(); ++o)
            if (!outwards[o].isZero(0) && !body.rigid) push_particles_out(body, o, outwards[o], poses, context);
    }
    matter_.push_out(bodies);
}

/// What hits faster than its own waves run is crushed flat, and its inside would go on through the surface that was
/// stopped. outwards: of the obstacle's surface where the body is in it; particles that are past its middle stay.
void Contacts::push_particles_out(BodyState& body, std::size_t obstacle, const Vec3f& outwards,
                                  const ObstaclePoses& poses, const RunContext& context) {
    std::vector<float>& most_depths = most_depths_[body.body.get()];
    if (most_depths.empty()) most_depths = most_depths_of(*body.body, context);
    std::vector<DistanceField::Sample> found(body.positions.size()); // distance: m beyond the limit, below 0
    parallel_for(context, found.size(), kContactForcesGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            found[i] = poses.distance_to(obstacle, body.positions[i]);
            found[i].distance += most_depths[i];
        }
    });
    for (Index i = 0; i < found.size(); ++i) {
        const auto& [distance, normal] = found[i];
        if (!(distance < 0) || normal.dot(outwards) < 0) continue;
        const float inwards =
            std::min(0.0f, (body.velocities[i] - poses.velocity(obstacle, body.positions[i])).dot(normal));
        // By its mass, so that copies that are tied share one way.
        push_particle(body, i, body.body->mass[i], -distance * normal, -inwards * normal);
    }
}

} // namespace filigree
