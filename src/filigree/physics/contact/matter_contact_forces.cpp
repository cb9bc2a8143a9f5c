// Contacts in matter: forces, and moving out what is too deep.
#include "filigree/core/parallel_for.h"
#include "filigree/physics/contact/cell_boxes.h"
#include "filigree/physics/contact/matter_contact.h"

#include <algorithm>
#include <limits>

namespace filigree {

using namespace contact_law;

namespace {

constexpr std::size_t kMatterForcesGrain = 128;
/// Of a side's speed: what its pairs may gain unasked; less of those beside their own place, which all move alike.
constexpr float kSlowest = 0.2f, kSlowestBeside = 0.02f;
constexpr float kLittle = 0.05f;        ///< spacings until a point that is nowhere is asked again ...
constexpr float kLittleBeside = 0.2f;   ///< ... and the same of those, by their own speed
constexpr float kClearerOfRigid = 0.8f; ///< part of a distance from a rigid body that is safe to go

} // namespace

std::vector<Carrier> carriers_of(const BodyState& body, const Matter& matter, const Matter::Place& place) {
    const Matter::Weights weights = matter.weights(place);
    const auto& corners = matter.corners(place.cell);
    std::vector<Carrier> carriers;
    if (!body.corners) {
        for (int c = 0; c < 8; ++c) carriers.push_back({corners[c], weights[c]});
        return carriers;
    }
    const Embedding& carried = body.body->corners;
    for (int c = 0; c < 8; ++c)
        for (Index k = carried.offsets[corners[c]]; k < carried.offsets[corners[c] + 1]; ++k)
            carriers.push_back({carried.particles[k], weights[c] * carried.weights[k]});
    std::ranges::stable_sort(carriers, {}, &Carrier::particle);
    std::size_t kept = 0;
    for (std::size_t k = 1; k < carriers.size(); ++k)
        if (carriers[k].particle == carriers[kept].particle)
            carriers[kept].weight += carriers[k].weight;
        else
            carriers[++kept] = carriers[k];
    carriers.resize(std::min(kept + 1, carriers.size()));
    return carriers;
}

void MatterContacts::leave(Pair& pair, const Side& side, float clearance) const {
    pair.depth = 0;
    pair.grasp = {};
    pair.tangled = false;
    pair.entry = Vec3f::Zero();
    pair.clear_until = side.way + clearance;
}

/// As safe_way. Neighbours move alike, so that the pair's own speed counts, and not the side's; but it may gain as much
/// as the side's times `slowest` unasked.
float MatterContacts::clearance(const Pair& pair, const Side& side, float distance, float slowest,
                                std::span<const BodyState> bodies) const {
    const float safe = safe_way(side, distance);
    if (safe == 0) return 0;
    const BodyState &body = bodies[side.body], &other = bodies[side.other];
    const Vec3f velocity = embedded_point(body.surface, pair.point, body.velocities) -
                           matter_[side.other]->mean(pair.place, other.corner_velocities());
    return safe * side.speed / (velocity.norm() + slowest * side.speed);
}

/// Of the places that a point has in the cells around place.cell: the furthest from its own inside of the surface, or
/// else the nearest to the surface. Where matter is crushed a walk from cell to cell ends at the point's own place, or
/// nowhere.
std::optional<Matter::Depth> MatterContacts::find_fold(const Pair& pair, const Vec3f& point, const Matter& matter,
                                                       const Vectors& positions, Matter::Place& place) {
    const auto& at = matter.body().cells.cells[place.cell];
    const Vec3f own = matter.body().surface.points.rest[pair.point];
    std::optional<Matter::Depth> best;
    float most = -std::numeric_limits<float>::infinity();
    for (int n = 0; n < 27; ++n) {
        const Index cell = matter.cell_at(at[0] + n % 3 - 1, at[1] + n / 3 % 3 - 1, at[2] + n / 9 - 1);
        if (cell == kNoIndex) continue;
        if (!CellBox(matter.corners(cell), positions).holds(point, 0)) continue;
        Matter::Place found{cell};
        if (!matter.locate_in_cell(positions, point, found) || !is_elsewhere(pair, found, matter)) continue;
        const auto depth = matter.depth(found, matter.inverse_derivative(positions, found), pair.entry);
        if (!depth) continue;
        const float rank = depth->depth > 0 ? (matter.rest_position(found) - own).norm() : depth->depth;
        if (!(rank > most)) continue;
        most = rank;
        place = found;
        best = depth;
    }
    return best;
}

/// Finds where a point lies in the other's matter. The surface's normal there if it touches; else the pair is left
/// until it might.
std::optional<Vec3f> MatterContacts::enter(Pair& pair, const Side& side, std::span<const BodyState> bodies) const {
    const BodyState &body = bodies[side.body], &other = bodies[side.other];
    const Matter& matter = *matter_[side.other];
    const bool own = side.body == side.other;
    const Index from = pair.place.cell;
    const auto leave_for = [&](float clear) {
        leave(pair, side, clear);
        return std::nullopt;
    };
    const Vec3f point = embedded_point(body.surface, pair.point, body.positions);
    const bool beside = own && matter.are_together(matter.cell_of_point(pair.point), from);
    const float slowest = beside ? kSlowestBeside : kSlowest;
    std::optional<Matter::Depth> found;
    if (Mat3f inverse; !(beside && pair.entry.isZero(0)) && // its walk would end at its own place
                       matter.locate(other.corner_positions(), point, pair.place, inverse) &&
                       !(own && !is_elsewhere(pair, pair.place, matter)))
        found = matter.depth(pair.place, inverse, pair.entry);
    if (own && !found) {
        pair.place.cell = from;
        found = find_fold(pair, point, matter, body.corner_positions(), pair.place);
    }
    if (!found) {
        pair.place.local.setConstant(0.5f);
        return leave_for(beside ? clearance(pair, side, kLittleBeside * side.spacing, slowest, bodies)
                                : kLittle * side.spacing);
    }
    if (own && matter.are_together(matter.cell_of_point(pair.point), pair.place.cell) &&
        Matter::are_sides_of_thin_part(body.body->surface.normals[pair.point], found->rest,
                                       matter.rest_position(pair.place) - body.surface.rest[pair.point]))
        return leave_for(kLittle * side.spacing);
    if (found->depth < 0) return leave_for(clearance(pair, side, -found->depth, slowest, bodies));
    const Vec3f& local = pair.place.local;
    const float outside = std::max(-local.minCoeff(), local.maxCoeff() - 1);
    if (found->depth == 0 || (outside > kOutside && !matter.is_rigid())) return leave_for(kLittle * side.spacing);

    if (pair.entry.isZero(0)) pair.tangled = own && (recovers_[side.body] || found->depth > kDeepest * side.spacing);
    pair.entry = found->rest; // follows a point that slides round an edge; a thin part's far side turns it at once
    pair.depth = pair.tangled ? 0 : found->depth;
    if (pair.tangled) return std::nullopt;
    return found->normal;
}

/// N/m; half where the other body's points push as well.
float MatterContacts::stiffness(const Side& side, const Pair& pair, std::span<const BodyState> bodies) const {
    const BodyState& body = bodies[side.body];
    return (matter_[side.body] ? 0.5f : 1.0f) * (side.body == side.other ? kWithinOneBody : 1) *
           std::min(body.surface_stiffness[pair.point],
                    body.body->surface.areas[pair.point] * per_area_[side.other][pair.place.cell]);
}

/// The force on the point; minus it is that on the matter. Lets friction's anchor begin, slide and end.
Vec3f MatterContacts::force(Pair& pair, const Side& side, std::span<const BodyState> bodies, float dt) const {
    if (pair.clear_until > side.way) return Vec3f::Zero();
    const std::optional<Vec3f> normal = enter(pair, side, bodies);
    if (!normal) return Vec3f::Zero();
    const BodyState &body = bodies[side.body], &other = bodies[side.other];
    const Matter& matter = *matter_[side.other];
    const Touch touch{*normal,
                      embedded_point(body.surface, pair.point, body.velocities) -
                          matter.mean(pair.place, other.corner_velocities()),
                      pair.depth,
                      stiffness(side, pair, bodies),
                      float(side.law.friction),
                      float(side.law.restitution),
                      std::max(body.rest_squared_frequency, other.rest_squared_frequency)};
    pair.normal = touch.normal;
    pair.approach = -touch.velocity.dot(touch.normal);
    const Vec3f place = matter.mean(pair.place, other.corner_positions());
    Vec3f offset = Vec3f::Zero();
    if (pair.grasp.holds)
        offset = along_surface(place - matter.mean(pair.anchor, other.corner_positions()), touch.normal);
    const bool landed = !pair.grasp.holds;
    const Vec3f force = touch_force(touch, offset, pair.grasp, dt, smooth_speed(world_, dt));
    if (landed || pair.grasp.slides) anchor_at(pair, side, other, offset);
    return force;
}

/// Of two rigid bodies: the normal where the point lies in the other, or may lie before the next substep ends; else
/// zero. pair.depth is below 0 outside.
Vec3f MatterContacts::probe(Pair& pair, const Side& side, std::span<const BodyState> bodies) const {
    if (pair.clear_until > side.way) return Vec3f::Zero();
    const BodyState &body = bodies[side.body], &other = bodies[side.other];
    const Matter& matter = *matter_[side.other];
    const Vec3f point = embedded_point(body.surface, pair.point, body.positions);
    Mat3f inverse;
    const bool is_found = matter.locate(other.positions, point, pair.place, inverse);
    const auto found = is_found ? matter.depth(pair.place, inverse, pair.entry) : std::nullopt;
    const float margin = margin_of(side);
    if (!found || found->depth < -margin) {
        leave(pair, side, found ? kClearerOfRigid * (-found->depth - margin) : kLittle * side.spacing);
        pair.rigid_force = Vec3f::Zero();
        return Vec3f::Zero();
    }
    pair.depth = found->depth;
    pair.entry = found->depth > 0 ? found->rest : Vec3f(Vec3f::Zero());
    return found->normal;
}

void MatterContacts::add_contact_point(Pair& pair, const Side& side, std::span<const BodyState> bodies,
                                       const Vec3f& normal, RigidContacts& rigid) {
    const BodyState& body = bodies[side.body];
    rigid.add({.body = side.body,
               .other = side.other,
               .place = embedded_point(body.surface, pair.point, body.positions),
               .normal = normal,
               .separation = -pair.depth,
               .friction = float(side.law.friction),
               .restitution = float(side.law.restitution),
               .force = &pair.rigid_force,
               .holds = &pair.grasp.holds});
}

/// Puts the anchor so far behind the point.
void MatterContacts::anchor_at(Pair& pair, const Side& side, const BodyState& other, const Vec3f& offset) const {
    pair.anchor = pair.place;
    if (!offset.isZero(0))
        pair.anchor.local -= matter_[side.other]->inverse_derivative(other.corner_positions(), pair.place) * offset;
}

ContactReport MatterContacts::add_forces(std::span<BodyState> bodies, float dt, std::span<std::uint8_t> touched,
                                         RigidContacts& rigid, ContactEvents& events, const RunContext& context) {
    ContactReport report;
    is_too_deep_ = false;
    forces_.resize(work_.size());
    parallel_for(context, work_.size(), kMatterForcesGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
            Side& side = sides_[work_[k].first];
            Pair& pair = side.pairs[work_[k].second];
            const Vec3f found = side.is_rigid ? probe(pair, side, bodies) : force(pair, side, bodies, dt);
            forces_[k] = {found, pair.depth};
        }
    });
    for (std::size_t k = 0; k < work_.size(); ++k) {
        const auto& [force, depth] = forces_[k];
        if (!(depth > 0) && force.isZero(0)) continue;
        Side& side = sides_[work_[k].first];
        Pair& pair = side.pairs[work_[k].second];
        if (side.is_rigid) add_contact_point(pair, side, bodies, force, rigid);
        if (!(depth > 0)) continue;
        if (!side.is_rigid) {
            add_to_particles(bodies[side.body].surface, pair.point, force, bodies[side.body].forces);
            matter_[side.other]->add(pair.place, -force, bodies[side.other].corner_forces());
            if (side.body != side.other)
                events.touch(side.body, Touched::body(side.other),
                             embedded_point(bodies[side.body].surface, pair.point, bodies[side.body].positions),
                             pair.normal, dt * force.dot(pair.normal), pair.approach);
        }
        touched[side.body] |= touch_of(side);
        touched[side.other] |= touch_of(side);
        ++report.contacts;
        report.deepest_in_matter = std::max(report.deepest_in_matter, depth);
        is_too_deep_ |= !side.is_rigid && depth > most_depth(side);
    }
    for (std::size_t b = 0; b < bodies.size(); ++b)
        if (bodies[b].corners && touched[b] & (kTouched | kTouchedItself))
            bodies[b].corners->give_forces(bodies[b].forces, context);
    return report;
}

void MatterContacts::push_out(std::span<BodyState> bodies, ContactEvents& events) {
    if (!is_too_deep_) return;
    for (Side& side : sides_) {
        const float most = most_depth(side);
        if (both_sleep(side, bodies) || side.is_rigid) continue;
        for (Pair& pair : side.pairs)
            if (pair.depth > most) push_out(pair, side, bodies, events);
    }
}

void MatterContacts::push_out(Pair& pair, const Side& side, std::span<BodyState> bodies, ContactEvents& events) const {
    const std::optional<Vec3f> normal = enter(pair, side, bodies); // others have moved it since
    const float too_deep = pair.depth - most_depth(side);
    if (!normal || !(too_deep > 0)) return;
    BodyState &body = bodies[side.body], &other = bodies[side.other];
    const Matter& matter = *matter_[side.other];
    const std::vector<Carrier> carriers = carriers_of(other, matter, pair.place);
    float gives = yielding(body.surface, pair.point, body.inverse_mass);
    for (const auto& [particle, weight] : carriers) gives += weight * weight * other.inverse_mass[particle];
    if (!(gives > 0)) return;
    const Vec3f velocity =
        embedded_point(body.surface, pair.point, body.velocities) - matter.mean(pair.place, other.corner_velocities());
    const Vec3f way = too_deep / gives * *normal;
    const Vec3f push = std::max(0.0f, -velocity.dot(*normal)) / gives * *normal;
    events.push(side.body, Touched::body(side.other), matter.mean(pair.place, other.corner_positions()), *normal,
                push.norm());
    for (Index k = body.surface.offsets[pair.point]; k < body.surface.offsets[pair.point + 1]; ++k)
        push_particle(body, body.surface.particles[k], body.surface.weights[k], way, push, too_deep);
    for (const auto& [particle, weight] : carriers) push_particle(other, particle, -weight, way, push, too_deep);
}

} // namespace filigree
