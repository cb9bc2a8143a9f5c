#include "filigree/physics/contact/feature_contacts.h"

#include <algorithm>
#include <cmath>

namespace filigree {

using namespace contact_law;

namespace {

constexpr double kMostEdgeParts = 4096; // of an edge
constexpr float kFree = 0.1f;           // spacings: so deep may be what surface points carry
constexpr float kShareOfPoints = 0.5f;  // of the stiffness that a particle's surface points may have

Index parts_of(const ObstacleShape::Edge& edge, double spacing) {
    return Index(std::clamp(std::ceil((edge.to - edge.from).norm() / spacing), 1.0, kMostEdgeParts));
}

Vec3d point_of(const ObstacleShape::Edge& edge, Index part, Index parts) {
    return edge.from + double(part) / double(parts) * (edge.to - edge.from);
}

/// The parts of an edge that may lie in a ball; first > last: none.
std::array<Index, 2> parts_within(const ObstacleShape::Edge& edge, Index parts, const Vec3d& centre, double radius) {
    const Vec3d way = edge.to - edge.from;
    const double squared = way.squaredNorm();
    const double nearest = squared > 0 ? std::clamp((centre - edge.from).dot(way) / squared, 0.0, 1.0) : 0;
    const double apart = (edge.from + nearest * way - centre).norm();
    if (apart > radius) return {1, 0};
    const double half = squared > 0 ? std::sqrt((radius * radius - apart * apart) / squared) : 0;
    const double low = std::ceil((nearest - half) * parts - 1), high = std::floor((nearest + half) * parts + 1);
    const Index last = squared > 0 ? parts : 0;
    return {Index(std::clamp(low, 0.0, double(last))), Index(std::clamp(high, 0.0, double(last)))};
}

/// The cell whose middle is the closest.
Index closest_cell(const Matter& matter, const Vectors& positions, const Vec3f& point) {
    if (matter.is_rigid()) return 0;
    Index closest = 0;
    float least = std::numeric_limits<float>::infinity();
    for (Index cell = 0; cell < matter.body().cells.cells.size(); ++cell) {
        const float distance = (matter.mean({cell}, positions) - point).squaredNorm();
        if (!(distance < least)) continue;
        least = distance;
        closest = cell;
    }
    return closest;
}

/// Whether an edge sticks out to the side that a body lies on: close to it, towards the body, the edge itself is the
/// closest of the obstacle. The edges of a room stick out to nobody in it.
bool sticks_out(const ObstacleShape& shape, const Vec3d& point, const Vec3d& body_centre, double spacing) {
    constexpr double kClose = 0.05, kItself = 0.9;
    const double close = kClose * spacing;
    return shape.clearance(point + close * (body_centre - point).normalized(), close) > kItself * close;
}

/// Where cells are inverted or flat: the place by the linear map of the cell around that it is the least outside of.
bool locate_roughly(const Matter& matter, const Vectors& positions, const Vec3f& point, Index around,
                    Matter::Place& place, Mat3f& inverse) {
    constexpr float kFlat = 0.2f, kFarthest = 1.5f; // of a cell's volume; cells from its middle
    float least = kFarthest;
    const auto& at = matter.body().cells.cells[around];
    for (int n = 0; n < 27; ++n) {
        const Index cell = matter.cell_at(at[0] + n % 3 - 1, at[1] + n / 3 % 3 - 1, at[2] + n / 9 - 1);
        if (cell == kNoIndex || !(matter.volume_ratio(positions, cell) > kFlat)) continue;
        const Matter::Linear map = matter.linear(positions, cell);
        const Vec3f local = map.local(point);
        const float outside = (local - Vec3f::Constant(0.5f)).cwiseAbs().maxCoeff();
        if (!(outside < least)) continue;
        least = outside;
        place = {cell, local};
        inverse = map.inverse;
    }
    return least < kFarthest;
}

/// Whether a place is within a cell, or nearly.
bool is_in_matter(const Matter& matter, const Matter::Place& place) {
    const Vec3f margin = Vec3f::Constant(MatterContacts::kOutside);
    if (!matter.is_rigid())
        return (place.local.array() >= -margin.array()).all() &&
               (place.local.array() <= (Vec3f::Ones() + margin).array()).all();
    return (place.local.array() >= matter.rigid_low().array()).all() &&
           (place.local.array() <= matter.rigid_high().array()).all();
}

} // namespace

void FeatureContacts::search(std::span<const BodyState> bodies, std::span<const ObstacleShape> shapes,
                             const MatterContacts& matter, const ObstaclePoses& poses, float reach) {
    std::vector<Near> found;
    for (Index b = 0; b < bodies.size(); ++b) {
        const BodyState& body = bodies[b];
        if (body.is_absent || !matter.has_matter(b) || !body.body->field || !is_finite(body.positions)) continue;
        const Box box = box_of(body.corner_positions());
        const double radius = 0.5 * box.diagonal() + double(reach), spacing = body.body->spacing();
        for (Index o = 0; o < shapes.size(); ++o) {
            const std::span<const ObstacleShape::Edge> edges = shapes[o].sharp_edges();
            const Vec3d centre = edges.empty() ? Vec3d(Vec3d::Zero()) : Vec3d(poses.at(o).inverse() * box.centre());
            for (Index e = 0; e < edges.size(); ++e) {
                const Index parts = parts_of(edges[e], spacing);
                const auto [first, last] = parts_within(edges[e], parts, centre, radius);
                for (Index part = first; part <= last && first <= last; ++part) {
                    const Vec3d own = point_of(edges[e], part, parts);
                    if (!sticks_out(shapes[o], own, centre, spacing)) continue;
                    const Vec3f point = (poses.at(o) * own).cast<float>();
                    const Index cell = closest_cell(matter.matter(b), body.corner_positions(), point);
                    found.push_back({b, o, e, part, cell, Vec3f::Constant(0.5f), 0});
                }
            }
        }
    }
    near_ = std::move(found);
}

/// N/m of a point in a cell: about as surface points have, and no more than the particles follow that carry it.
float FeatureContacts::stiffness(const BodyState& body, const Matter& matter, const Matter::Place& place) const {
    if (body.surface_stiffness.empty()) return 0;
    if (matter.is_rigid()) return body.surface_stiffness.front();
    const double modulus = body.body->material.density * std::pow(pressure_wave_speed(body.body->material), 2);
    float stiffness = float(modulus * body.body->spacing());
    for (const auto& [particle, weight] : carriers_of(body, matter, place))
        if (const float part = std::abs(weight); part > 1e-3f)
            stiffness = std::min(stiffness, kShareOfPoints * kContactShare * body.rest_squared_frequency *
                                                body.body->mass[particle] / part);
    return stiffness;
}

ContactReport FeatureContacts::add_forces(std::span<BodyState> bodies, std::span<const ObstacleShape> shapes,
                                          const MatterContacts& matter, const ObstaclePoses& poses, float dt, float way,
                                          std::span<std::uint8_t> touched, ContactEvents& events) {
    ContactReport report;
    deep_.clear();
    for (Near& near : near_) {
        BodyState& body = bodies[near.body];
        if (near.clear_until > way || body.sleeps()) continue;
        const Matter& of = matter.matter(near.body);
        const ObstacleShape::Edge& edge = shapes[near.obstacle].sharp_edges()[near.edge];
        const double spacing = body.body->spacing();
        const Vec3f point =
            (poses.at(near.obstacle) * point_of(edge, near.part, parts_of(edge, spacing))).cast<float>();
        Matter::Place place{near.cell, near.local};
        Mat3f inverse;
        const bool is_found =
            of.locate(body.corner_positions(), point, place, inverse)
                ? is_in_matter(of, place)
                : !of.is_rigid() && locate_roughly(of, body.corner_positions(), point, near.cell, place, inverse);
        if (!is_found) {
            near.clear_until = way + 0.05f * float(spacing);
            continue;
        }
        near.cell = place.cell;
        near.local = of.is_rigid() ? Vec3f(Vec3f::Zero()) : place.local;
        const Vec3f velocity = poses.velocity(near.obstacle, point) - of.mean(place, body.corner_velocities());
        // Where it came in, if it came so far in this step that the closest surface may be another one.
        Vec3f entry = Vec3f::Zero();
        if (velocity.norm() * dt > 0.25f * float(spacing)) entry = -(inverse * velocity).normalized();
        const std::optional<Matter::Depth> depth = of.depth(place, inverse, entry);
        if (!of.is_rigid()) place.local = place.local.cwiseMax(0).cwiseMin(1); // what carries it
        const float deep = depth ? depth->depth - kFree * float(spacing) : 0;
        if (!(deep > 0)) {
            near.clear_until = way + (depth ? -0.5f * deep : 0.05f * float(spacing));
            continue;
        }
        const Obstacle& obstacle = world_.obstacles[near.obstacle];
        const float deepest = kDeepest * float(spacing);
        const Touch touch{depth->normal,
                          velocity,
                          std::min(deep, deepest),
                          stiffness(body, of, place) * float(obstacle.stiffness),
                          float(obstacle.friction),
                          float(obstacle.restitution),
                          body.rest_squared_frequency * float(obstacle.stiffness)};
        Grasp grasp{true, true}; // it is not held, but rubs
        Vec3f offset = Vec3f::Zero();
        const Vec3f slip = along_surface(velocity, depth->normal);
        if (slip.norm() > 0) offset = slip.normalized() * touch.friction * touch.depth / kTangentialStiffness;
        const Vec3f force = touch_force(touch, offset, grasp, dt, smooth_speed(world_, dt));
        of.add(place, -force, body.corner_forces());
        events.touch(near.body, Touched::obstacle(near.obstacle), point, -depth->normal, dt * force.dot(depth->normal),
                     -velocity.dot(depth->normal));
        touched[near.body] |= MatterContacts::kTouched;
        ++report.contacts;
        report.deepest = std::max(report.deepest, deep);
        if (deep > deepest)
            deep_.push_back({near.body, near.obstacle, place, depth->normal, poses.velocity(near.obstacle, point),
                             std::min(deep - deepest, float(spacing))});
    }
    return report;
}

void FeatureContacts::push_out(std::span<BodyState> bodies, const MatterContacts& matter, ContactEvents& events) const {
    for (const Deep& deep : deep_) {
        BodyState& body = bodies[deep.body];
        const Matter& of = matter.matter(deep.body);
        const std::vector<Carrier> carriers = carriers_of(body, of, deep.place);
        float gives = 0;
        for (const auto& [particle, weight] : carriers) gives += weight * weight * body.inverse_mass[particle];
        if (!(gives > 0)) continue;
        const float inwards =
            std::max(0.0f, (of.mean(deep.place, body.corner_velocities()) - deep.velocity).dot(deep.normal));
        const Vec3f way = -deep.depth / gives * deep.normal, push = -inwards / gives * deep.normal;
        events.push(deep.body, Touched::obstacle(deep.obstacle), of.mean(deep.place, body.corner_positions()),
                    -deep.normal, inwards / gives);
        for (const auto& [particle, weight] : carriers)
            if (weight != 0) push_particle(body, particle, weight, way, push, deep.depth);
    }
}

bool FeatureContacts::is_sound(std::span<const Near> near, std::span<const BodyState> bodies,
                               std::span<const ObstacleShape> shapes, const MatterContacts& matter) const {
    return std::ranges::all_of(near, [&](const Near& at) {
        return at.body < bodies.size() && at.obstacle < shapes.size() && matter.has_matter(at.body) &&
               at.edge < shapes[at.obstacle].sharp_edges().size() && at.part <= kMostEdgeParts &&
               at.cell < bodies[at.body].body->cells.cells.size() && at.local.allFinite() &&
               std::isfinite(at.clear_until);
    });
}

} // namespace filigree
