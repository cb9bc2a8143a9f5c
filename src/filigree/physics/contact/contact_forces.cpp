// Contacts in explicit steps: forces of what touches, and moving out what is too deep.
#include "filigree/physics/contact/contact.h"

#include "filigree/core/bits.h"
#include "filigree/core/parallel_for.h"
#include "filigree/physics/body/point_grid.h"
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

/// Of each particle a surface point that is about the closest at rest: the closest in the smallest box around it that
/// holds any.
std::vector<Index> near_surface_points(const Body& body, const RunContext& context) {
    const std::vector<Vec3f>& rest = body.surface.points.rest;
    Vectors places(rest.size());
    for (std::size_t s = 0; s < rest.size(); ++s) places.set(s, rest[s]);
    const float spacing = float(body.spacing());
    const PointGrid points(places, spacing);
    std::vector<Index> nearest(body.particle_count(), 0);
    parallel_for(context, nearest.size(), kContactForcesGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            float least = std::numeric_limits<float>::infinity();
            for (float radius = spacing; !(least < radius) && radius < 1e6f * spacing; radius *= 2)
                points.near(body.rest[i], radius, [&](Index s) {
                    const float distance = (rest[s] - body.rest[i]).norm();
                    if (distance < least || (distance == least && s < nearest[i])) {
                        least = distance;
                        nearest[i] = s;
                    }
                });
        }
    });
    return nearest;
}

} // namespace

/// Follows a point to `place`. Below 0, how deep it is behind the wall that it touches; else how far it may go.
/// touched: when it was asked last.
DistanceField::Sample Contacts::follow(std::size_t obstacle, Trace& trace, bool touched, const Vec3f& place,
                                       const ObstaclePoses& poses) const {
    const ObstacleShape& shape = shapes_[obstacle];
    const Eigen::Isometry3d& motion = poses.at(obstacle);
    const Vec3d own = motion.linear().transpose() * (place.cast<double>() - motion.translation());
    const double reach = std::max(0.0, double(near_until_ - near_way_));
    double clear = touched ? 0 : shape.clearance(own, reach);
    if ((own - trace.place).norm() < clear) {
        trace.place = own;
        return {float(clear), Vec3f::Zero()};
    }
    const WallTouch touch = shape.follow(trace.place, own);
    trace.normal = touch.normal.cast<float>();
    if (touch.depth > 0) return {-float(touch.depth), (motion.linear() * touch.normal).cast<float>()};
    if (touched) clear = shape.clearance(own, reach);
    return {float(clear), Vec3f::Zero()};
}

/// How far a place is in front of the wall that a point touches, below 0 behind it.
DistanceField::Sample Contacts::surface_at(const Near& at, const NearPoints& of, const Vec3f& place,
                                           const ObstaclePoses& poses) const {
    if (at.trace == kNoIndex) return poses.distance_to(at.obstacle, place);
    const Trace& trace = of.traces[at.trace];
    const Vec3f normal = (poses.at(at.obstacle).linear() * trace.normal.cast<double>()).cast<float>();
    const Vec3d beyond = place.cast<double>() - poses.at(at.obstacle) * trace.place;
    return {float(beyond.dot(normal.cast<double>())), normal};
}

/// Of a rigid body: the normal where a point touches, or may touch within the next substep; else zero. at.depth is
/// below 0 outside.
Vec3f Contacts::probe_rigid(Near& at, float& clear_until, const DistanceField::Sample& surface, float margin) const {
    clear_until = near_way_ + std::max(0.0f, surface.distance - margin);
    if (surface.distance < margin) {
        at.depth = -surface.distance;
        return surface.normal;
    }
    at.grasp = {};
    at.rigid_force = Vec3f::Zero();
    return Vec3f::Zero();
}

/// The force on a surface point; lets friction's anchor begin, slide and end. trace: null of a half-space. margin: m,
/// of probe_rigid.
Vec3f Contacts::obstacle_force(Near& at, Trace* trace, float& clear_until, const BodyState& body,
                               const ObstaclePoses& poses, float dt, float margin) const {
    const bool touched = at.depth > 0;
    at.depth = 0;
    const Obstacle& obstacle = world_.obstacles[at.obstacle];
    const Vec3f place = embedded_point(body.surface, at.point, body.positions);
    const DistanceField::Sample surface =
        trace ? follow(at.obstacle, *trace, touched, place, poses) : poses.distance_to(at.obstacle, place);
    if (body.rigid) return probe_rigid(at, clear_until, surface, trace ? 0 : margin);
    clear_until = near_way_ + surface.distance;
    if (!(surface.distance < 0)) {
        at.grasp = {};
        return Vec3f::Zero();
    }
    at.depth = -surface.distance;
    at.normal = surface.normal;
    const Touch touch{surface.normal,
                      embedded_point(body.surface, at.point, body.velocities) - poses.velocity(at.obstacle, place),
                      std::min(at.depth, kDeepest * float(body.body->spacing())), // deeper it is moved out
                      body.surface_stiffness[at.point] * float(obstacle.stiffness),
                      float(obstacle.friction),
                      float(obstacle.restitution),
                      body.rest_squared_frequency * float(obstacle.stiffness)};
    Vec3f offset = Vec3f::Zero();
    if (at.grasp.holds) offset = along_surface(place - poses.to_world(at.obstacle, at.anchor), surface.normal);
    const bool landed = !at.grasp.holds;
    at.approach = -touch.velocity.dot(touch.normal);
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

ContactPoint Contacts::contact_point(Near& at, const Vec3f& normal, Index b, const BodyState& body,
                                     const ObstaclePoses& poses) const {
    const Obstacle& obstacle = world_.obstacles[at.obstacle];
    const Vec3f place = embedded_point(body.surface, at.point, body.positions);
    return {.body = b,
            .obstacle = at.obstacle,
            .place = place,
            .normal = normal,
            .separation = -at.depth,
            .other_velocity = poses.velocity(at.obstacle, place),
            .friction = float(obstacle.friction),
            .restitution = float(obstacle.restitution),
            .force = &at.rigid_force,
            .holds = &at.grasp.holds};
}

/// forces: room. rigid: takes a rigid body's contact points.
ContactReport Contacts::add_obstacle_forces(BodyState& body, std::size_t b, const ObstaclePoses& poses, float dt,
                                            std::vector<Vec3f>& forces, std::vector<ContactPoint>& rigid,
                                            const RunContext& context) {
    ContactReport report;
    constexpr std::size_t kBlock = NearPoints::kBlock;
    std::vector<Near>& points = near_[b].points;
    std::vector<float>& clear_until = near_[b].clear_until;
    std::vector<std::uint64_t> touching(near_[b].blocks()); // bits of each block
    forces.resize(points.size());
    const float margin = touching_margin(float(body.body->spacing()), matter_.speed(b));
    parallel_for(context, touching.size(), kBlocksGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t block = begin; block < end; ++block) {
            const std::size_t first = block * kBlock, left = points.size() - first;
            const float* until = &clear_until[first];
            std::uint64_t asked = bits_where<kBlock>([&](std::size_t k) { return !(until[k] > near_way_); });
            if (left < kBlock) asked &= (std::uint64_t{1} << left) - 1; // also where a way is not a number
            for_each_bit(asked, [&](int bit) { read_ahead(body.surface, points[first + std::size_t(bit)].point); });
            for_each_bit(asked, [&](int bit) {
                const std::size_t k = first + std::size_t(bit);
                Trace* trace = points[k].trace == kNoIndex ? nullptr : &near_[b].traces[points[k].trace];
                forces[k] = obstacle_force(points[k], trace, clear_until[k], body, poses, dt, margin);
                const bool touches = points[k].depth > 0 || (body.rigid && !forces[k].isZero(0));
                touching[block] |= std::uint64_t{touches} << bit;
            });
        }
    });
    for (std::size_t block = 0; block < touching.size(); ++block)
        for_each_bit(touching[block], [&](int bit) {
            const std::size_t k = block * kBlock + std::size_t(bit);
            if (body.rigid)
                rigid.push_back(contact_point(points[k], forces[k], Index(b), body, poses));
            else
                add_to_particles(body.surface, points[k].point, forces[k], body.forces);
            if (!(points[k].depth > 0)) return;
            if (!body.rigid) tell(points[k], forces[k], body, b, dt);
            touched_[b] |= kOnObstacle;
            ++report.contacts;
            report.deepest = std::max(report.deepest, points[k].depth);
        });
    deepest_near_[b] = report.deepest;
    return report;
}

/// A point that touches, for the frame's events.
void Contacts::tell(const Near& at, const Vec3f& force, const BodyState& body, std::size_t b, float dt) {
    events_.touch(Index(b), Touched::obstacle(at.obstacle), embedded_point(body.surface, at.point, body.positions),
                  at.normal, dt * force.dot(at.normal), at.approach);
}

ContactReport Contacts::add_forces(std::span<BodyState> bodies, double time, float dt, RigidContacts& rigid,
                                   const RunContext& context) {
    ContactReport report;
    events_.begin_forces();
    rigid.clear();
    std::vector<std::vector<ContactPoint>> points(bodies.size());
    const ObstaclePoses poses(world_, time);
    std::vector<ContactReport> reports(bodies.size());
    parallel_for(context, bodies.size(), kObstacleForcesGrain, [&](std::size_t begin, std::size_t end) {
        std::vector<Vec3f> forces;
        for (std::size_t b = begin; b < end; ++b) {
            touched_[b] = 0;
            deepest_near_[b] = 0;
            if (!bodies[b].sleeps())
                reports[b] = add_obstacle_forces(bodies[b], b, poses, dt, forces, points[b], context);
        }
    });
    for (const std::vector<ContactPoint>& of_body : points)
        for (const ContactPoint& point : of_body) rigid.add(point);
    for (const ContactReport& of_body : reports) {
        report.contacts += of_body.contacts;
        report.deepest = std::max(report.deepest, of_body.deepest);
    }
    const ContactReport at_edges =
        features_.add_forces(bodies, shapes_, matter_, poses, dt, near_way_, touched_, events_);
    report.contacts += at_edges.contacts;
    report.deepest = std::max(report.deepest, at_edges.deepest);
    const ContactReport inside = matter_.add_forces(bodies, dt, touched_, rigid, events_, context);
    report.contacts += inside.contacts;
    report.deepest_in_matter = inside.deepest_in_matter;
    return report;
}

void Contacts::push_out(std::span<BodyState> bodies, double time, const RunContext& context) {
    const ObstaclePoses poses(world_, time);
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        BodyState& body = bodies[b];
        const float spacing = float(body.body->spacing()), most = kDeepest * spacing;
        if (!(deepest_near_[b] > kCrushing * spacing) || body.sleeps() || body.rigid) continue;
        std::vector<Vec3f> outwards; // of what is deep in each obstacle
        for (const Near& at : near_[b].points) {
            if (!(at.depth > kCrushing * spacing)) continue;
            const Vec3f place = embedded_point(body.surface, at.point, body.positions);
            const DistanceField::Sample surface = surface_at(at, near_[b], place, poses);
            const float gives = yielding(body.surface, at.point, body.inverse_mass);
            if (!(gives > 0)) continue;
            outwards.resize(world_.obstacles.size(), Vec3f::Zero());
            outwards[at.obstacle] += surface.normal;
            if (!(-surface.distance > most)) continue;
            const float inwards = std::min(
                0.0f, (embedded_point(body.surface, at.point, body.velocities) - poses.velocity(at.obstacle, place))
                          .dot(surface.normal));
            const float too_deep = -surface.distance - most;
            const Vec3f way = too_deep / gives * surface.normal;
            const Vec3f push = -inwards / gives * surface.normal;
            events_.push(Index(b), Touched::obstacle(at.obstacle), place, surface.normal, -inwards / gives);
            for (Index k = body.surface.offsets[at.point]; k < body.surface.offsets[at.point + 1]; ++k)
                push_particle(body, body.surface.particles[k], body.surface.weights[k], way, push, too_deep);
        }
        for (std::size_t o = 0; o < outwards.size(); ++o)
            if (!outwards[o].isZero(0)) push_particles_out(body, b, o, outwards[o], poses, context);
    }
    features_.push_out(bodies, matter_, events_);
    matter_.push_out(bodies, events_);
}

/// How deep each particle is in an obstacle: below 0 behind its surface. Particles are not followed; beside what a
/// point is followed beside, they are on the right side if nothing stands between them and their surface point's place.
std::vector<DistanceField::Sample> Contacts::depths_of_particles(const BodyState& body, std::size_t b,
                                                                 std::size_t obstacle, const ObstaclePoses& poses,
                                                                 const RunContext& context) {
    std::vector<DistanceField::Sample> found(body.positions.size(), {1, Vec3f::Zero()});
    const ObstacleShape& shape = shapes_[obstacle];
    const Eigen::Isometry3d &motion = poses.at(obstacle), to_own = motion.inverse();
    std::vector<Vec3d> starts;
    if (shape.is_traced()) {
        for (std::size_t s = 0; s < body.surface.size(); ++s)
            starts.push_back(to_own * embedded_point(body.surface, s, body.positions).cast<double>());
        for (const Near& at : near_[b].points)
            if (at.obstacle == obstacle) starts[at.point] = near_[b].traces[at.trace].place;
    }
    const std::vector<Index>& near_surface = particle_depths_.at(body.body.get()).near_surface;
    parallel_for(context, found.size(), kContactForcesGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            if (!shape.is_traced()) {
                found[i] = poses.distance_to(obstacle, body.positions[i]);
                continue;
            }
            Vec3d place = starts[near_surface[i]];
            const WallTouch touch = shape.follow(place, to_own * body.positions[i].cast<double>());
            if (touch.depth > 0) found[i] = {-float(touch.depth), (motion.linear() * touch.normal).cast<float>()};
        }
    });
    return found;
}

/// What hits faster than its own waves run is crushed flat, and its inside would go on through the surface that was
/// stopped. outwards: of the obstacle's surface where the body is in it; particles that are past its middle stay.
void Contacts::push_particles_out(BodyState& body, std::size_t b, std::size_t obstacle, const Vec3f& outwards,
                                  const ObstaclePoses& poses, const RunContext& context) {
    ParticleDepths& depths = particle_depths_[body.body.get()];
    if (depths.most.empty()) depths = {most_depths_of(*body.body, context), near_surface_points(*body.body, context)};
    // distance: m beyond the limit, below 0
    std::vector<DistanceField::Sample> found = depths_of_particles(body, b, obstacle, poses, context);
    for (std::size_t i = 0; i < found.size(); ++i) found[i].distance += depths.most[i];
    for (Index i = 0; i < found.size(); ++i) {
        const auto& [distance, normal] = found[i];
        if (!(distance < 0) || normal.dot(outwards) < 0) continue;
        const float inwards =
            std::min(0.0f, (body.velocities[i] - poses.velocity(obstacle, body.positions[i])).dot(normal));
        // By its mass, so that copies that are tied share one way.
        push_particle(body, i, body.body->mass[i], -distance * normal, -inwards * normal, -distance);
    }
}

} // namespace filigree
