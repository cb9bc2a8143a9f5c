#include "filigree/physics/contact/crushed_particles.h"

#include "filigree/core/parallel_for.h"
#include "filigree/physics/body/point_grid.h"
#include "filigree/physics/contact/contact_law.h"

#include <algorithm>

namespace filigree {

namespace {

using contact_law::kDeepest;

constexpr std::size_t kCrushedGrain = 256;
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
    parallel_for(context, most.size(), kCrushedGrain, [&](std::size_t begin, std::size_t end) {
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
    parallel_for(context, nearest.size(), kCrushedGrain, [&](std::size_t begin, std::size_t end) {
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

/// How deep each particle is in an obstacle: below 0 behind its surface. Particles are not followed; beside what a
/// point is followed beside, they are on the right side if nothing stands between them and their surface point's place.
std::vector<DistanceField::Sample> depths_of_particles(const BodyState& body, const ContactPair& pair,
                                                       const ObstacleShape& shape, std::span<const Index> near_surface,
                                                       const ObstaclePoses& poses, const RunContext& context) {
    std::vector<DistanceField::Sample> found(body.positions.size(), {1, Vec3f::Zero()});
    const std::size_t obstacle = pair.touched.number();
    const Eigen::Isometry3d &motion = poses.at(obstacle), to_own = motion.inverse();
    std::vector<Vec3d> starts;
    if (pair.is_traced) {
        for (std::size_t s = 0; s < body.surface.size(); ++s)
            starts.push_back(to_own * embedded_point(body.surface, s, body.positions).cast<double>());
        for (const Candidate& at : pair.candidates) starts[at.point] = at.local_point;
    }
    parallel_for(context, found.size(), kCrushedGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            if (!pair.is_traced) {
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

} // namespace

void CrushedParticles::push_out(BodyState& body, const ContactPair& pair, const ObstacleShape& shape,
                                const Vec3f& outwards, const ObstaclePoses& poses, const RunContext& context) {
    Depths& depths = depths_[body.body];
    if (depths.most.empty()) depths = {most_depths_of(*body.body, context), near_surface_points(*body.body, context)};
    // distance: m beyond the limit, below 0
    std::vector<DistanceField::Sample> found =
        depths_of_particles(body, pair, shape, depths.near_surface, poses, context);
    for (std::size_t i = 0; i < found.size(); ++i) found[i].distance += depths.most[i];
    for (Index i = 0; i < found.size(); ++i) {
        const auto& [distance, normal] = found[i];
        if (!(distance < 0) || normal.dot(outwards) < 0) continue;
        const Vec3f velocity = body.velocities[i] - poses.velocity(pair.touched.number(), body.positions[i]);
        const float inwards = std::min(0.0f, velocity.dot(normal));
        // By its mass, so that copies that are tied share one way.
        push_particle(body, i, body.body->mass[i], -distance * normal, -inwards * normal, -distance);
    }
}

} // namespace filigree
