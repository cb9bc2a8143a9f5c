#include "filigree/physics/contact/colliders.h"

#include "filigree/core/math.h"
#include "filigree/physics/contact/cell_boxes.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

constexpr float kSlowest = 0.2f, kSlowestBeside = 0.02f; ///< less of points beside their own place: all move alike
constexpr float kLittle = 0.05f;                         ///< spacings until a point that is nowhere is asked again ...
constexpr float kLittleBeside = 0.2f;                    ///< ... and the same of those, by their own speed
constexpr float kClearerOfRigid = 0.8f;                  ///< part of a distance from a rigid body that is safe to go
constexpr float kLeap = 0.25f;         ///< spacings; after a longer one the closest surface may be another one
constexpr float kShareOfPoints = 0.5f; ///< of the stiffness that a particle's surface points may have

} // namespace

std::vector<float> stiffness_per_area(const BodyState& state) {
    const Embedding& points = state.body->surface.points;
    const Cells& cells = state.body->cells;
    double stiffness = 0, area = 0;
    for (std::size_t s = 0; s < points.size(); ++s) {
        stiffness += double(state.surface_stiffness[s]);
        area += double(state.body->surface.areas[s]);
    }
    std::vector<float> at_particle(state.positions.size(), area > 0 ? float(stiffness / area) : 0);
    for (std::size_t s = 0; s < points.size(); ++s)
        for (Index k = points.offsets[s]; k < points.offsets[s + 1]; ++k) {
            float& particle = at_particle[points.particles[k]];
            particle = std::min(particle, state.surface_stiffness[s] / state.body->surface.areas[s]);
        }
    const Embedding& carried = state.body->corners;
    std::vector<float> at_corner(carried.size(), std::numeric_limits<float>::max());
    for (std::size_t c = 0; c < at_corner.size(); ++c)
        for (Index k = carried.offsets[c]; k < carried.offsets[c + 1]; ++k)
            at_corner[c] = std::min(at_corner[c], at_particle[carried.particles[k]]);
    if (at_corner.empty()) at_corner = std::move(at_particle);
    std::vector<float> in_cell(cells.cells.size(), std::numeric_limits<float>::max());
    for (std::size_t c = 0; c < in_cell.size(); ++c)
        for (const Index corner : cells.cell_corners[c]) in_cell[c] = std::min(in_cell[c], at_corner[corner]);
    return in_cell;
}

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

/// A point that is followed is asked where it got to only if something may have been in its way.
Meeting ObstacleCollider::meet(Candidate& at, const ContactPair& pair, const Vec3f& point,
                               const Approach& approach) const {
    if (!pair.is_traced) {
        const DistanceField::Sample surface = poses_.distance_to(obstacle_, point);
        if (surface.distance < approach.margin) return {surface.normal, -surface.distance};
        return {.depth = approach.margin - surface.distance};
    }
    const Eigen::Isometry3d& motion = poses_.at(obstacle_);
    const Vec3d place = motion.linear().transpose() * (point.cast<double>() - motion.translation());
    const double reach = std::max(0.0, double(pair.reach));
    const bool touched = !at.entry_normal.isZero(0);
    double clear = touched ? 0 : shape_.clearance(place, reach);
    if ((place - at.local_point).norm() < clear) {
        at.local_point = place;
    } else {
        const WallTouch touch = shape_.follow(at.local_point, place);
        if (touch.depth > 0) {
            at.entry_normal = touch.normal.cast<float>();
            return {(motion.linear() * touch.normal).cast<float>(), float(touch.depth)};
        }
        if (touched) clear = shape_.clearance(place, reach);
    }
    at.entry_normal = Vec3f::Zero();
    if (const double margin = double(approach.margin); clear < margin)
        if (const auto wall = shape_.closest(place, margin))
            return {(motion.linear() * wall->second).cast<float>(), -float(wall->first)};
    return {.depth = approach.margin - float(clear)};
}

Meeting MatterCollider::meet(Candidate& at, const ContactPair& pair, const Vec3f& point,
                             const Approach& approach) const {
    if (pair.is_rigid) return meet_rigid(at, pair, point, approach);
    const bool own = pair.is_own();
    const bool beside = own && matter_.are_together(matter_.cell_of_point(at.point), at.place.cell);
    const float slowest = beside ? kSlowestBeside : kSlowest;
    const Meeting nowhere{.depth = -kLittle * pair.spacing};
    const std::optional<Matter::Depth> found = own ? find_own(at, point, beside) : find_other(at, point, approach);
    if (!found) {
        at.place.local.setConstant(0.5f);
        return beside ? Meeting{.depth = -kLittleBeside * pair.spacing, .slowest = slowest} : nowhere;
    }
    const BodySurface& surface = body_.body->surface;
    if (own && matter_.are_together(matter_.cell_of_point(at.point), at.place.cell) &&
        Matter::are_sides_of_thin_part(surface.normals[at.point], found->rest,
                                       matter_.rest_position(at.place) - surface.points.rest[at.point]))
        return nowhere;
    const float depth = found->depth - pair.slack;
    if (depth < 0) return {.depth = depth, .slowest = slowest};
    const Vec3f& local = at.place.local;
    const float outside = std::max(-local.minCoeff(), local.maxCoeff() - 1);
    if (!(depth > 0) || (outside > kOutside && !matter_.is_rigid())) return nowhere;
    if (at.entry_normal.isZero(0)) at.is_tangled = own && (recovers_ || depth > contact_law::kDeepest * pair.spacing);
    at.entry_normal = found->rest; // follows a point that slides round an edge; a thin part's far side turns it at once
    return {found->normal, depth};
}

/// Of an edge and a rigid body: where the point lies in it, or may lie before the next substep ends.
Meeting MatterCollider::meet_rigid(Candidate& at, const ContactPair& pair, const Vec3f& point,
                                   const Approach& approach) const {
    Mat3f inverse;
    const bool is_found = matter_.locate(body_.positions, point, at.place, inverse);
    const std::optional<Matter::Depth> found =
        is_found ? matter_.depth(at.place, inverse, at.entry_normal) : std::nullopt;
    if (!found) return {.depth = -kLittle * pair.spacing};
    const float depth = found->depth - pair.slack;
    if (depth < -approach.margin) return {.depth = kClearerOfRigid * (depth + approach.margin)};
    at.entry_normal = depth > 0 ? found->rest : Vec3f(Vec3f::Zero());
    return {found->normal, depth};
}

std::optional<Matter::Depth> MatterCollider::find_other(Candidate& at, const Vec3f& point,
                                                        const Approach& approach) const {
    const Vectors& positions = body_.corner_positions();
    const Matter::Place before = at.place;
    Mat3f inverse;
    bool is_rough = false;
    if (!matter_.locate(positions, point, at.place, inverse)) {
        at.place = before;
        is_rough = !matter_.is_rigid() && !approach.leap.isZero(0) && locate_roughly(point, at.place, inverse);
        if (!is_rough) return std::nullopt;
    }
    Vec3f entry = at.entry_normal;
    if (entry.isZero(0) && !approach.leap.isZero(0)) {
        const Vec3f leap = approach.leap - approach.dt * matter_.mean(at.place, body_.corner_velocities());
        if (leap.norm() > kLeap * float(body_.body->spacing())) entry = -(inverse * leap).normalized();
    }
    const std::optional<Matter::Depth> found = matter_.depth(at.place, inverse, entry);
    if (is_rough) at.place.local = at.place.local.cwiseMax(0).cwiseMin(1); // what carries it
    return found;
}

/// Where cells are inverted or flat: the place by the linear map of the cell around that it is the least outside of.
bool MatterCollider::locate_roughly(const Vec3f& point, Matter::Place& place, Mat3f& inverse) const {
    constexpr float kFlat = 0.2f, kFarthest = 1.5f; // of a cell's volume; cells from its middle
    float least = kFarthest;
    const auto at = matter_.body().cells.cells[place.cell];
    for (int n = 0; n < 27; ++n) {
        const Index cell = matter_.cell_at(at[0] + n % 3 - 1, at[1] + n / 3 % 3 - 1, at[2] + n / 9 - 1);
        if (cell == kNoIndex || !(matter_.volume_ratio(body_.corner_positions(), cell) > kFlat)) continue;
        const Matter::Linear map = matter_.linear(body_.corner_positions(), cell);
        const Vec3f local = map.local(point);
        const float outside = (local - Vec3f::Constant(0.5f)).cwiseAbs().maxCoeff();
        if (!(outside < least)) continue;
        least = outside;
        place = {cell, local};
        inverse = map.inverse;
    }
    return least < kFarthest;
}

std::optional<Matter::Depth> MatterCollider::find_own(Candidate& at, const Vec3f& point, bool is_beside) const {
    const Index from = at.place.cell;
    const bool ends_at_own_place = is_beside && at.entry_normal.isZero(0); // a walk from cell to cell would
    std::optional<Matter::Depth> found;
    if (Mat3f inverse; !ends_at_own_place && matter_.locate(body_.corner_positions(), point, at.place, inverse) &&
                       is_elsewhere(at, at.place))
        found = matter_.depth(at.place, inverse, at.entry_normal);
    if (found) return found;
    at.place.cell = from;
    return find_fold(at, point, at.place);
}

/// Of the places that a point has in the cells around place.cell: the furthest from its own inside of the surface, or
/// else the nearest to the surface. Where matter is crushed a walk from cell to cell ends at the point's own place, or
/// nowhere.
std::optional<Matter::Depth> MatterCollider::find_fold(const Candidate& candidate, const Vec3f& point,
                                                       Matter::Place& place) const {
    const Vectors& positions = body_.corner_positions();
    const auto at = matter_.body().cells.cells[place.cell];
    const Vec3f own = matter_.body().surface.points.rest[candidate.point];
    std::optional<Matter::Depth> best;
    float most = -std::numeric_limits<float>::infinity();
    for (int n = 0; n < 27; ++n) {
        const Index cell = matter_.cell_at(at[0] + n % 3 - 1, at[1] + n / 3 % 3 - 1, at[2] + n / 9 - 1);
        if (cell == kNoIndex) continue;
        if (!CellBox(matter_.corners(cell), positions).holds(point, 0)) continue;
        Matter::Place found{cell};
        if (!matter_.locate_in_cell(positions, point, found) || !is_elsewhere(candidate, found)) continue;
        const auto depth = matter_.depth(found, matter_.inverse_derivative(positions, found), candidate.entry_normal);
        if (!depth) continue;
        const float rank = depth->depth > 0 ? (matter_.rest_position(found) - own).norm() : depth->depth;
        if (!(rank > most)) continue;
        most = rank;
        place = found;
        best = depth;
    }
    return best;
}

void MatterCollider::put_anchor(Candidate& at, const Vec3f&, const Vec3f& offset) const {
    at.anchor = at.place;
    if (!offset.isZero(0)) at.anchor.local -= matter_.inverse_derivative(body_.corner_positions(), at.place) * offset;
}

/// Of a point without area: about as surface points have, and no more than the particles follow that carry it.
float MatterCollider::stiffness(const Candidate& at, std::optional<float> area) const {
    if (area) return *area * per_area_[at.place.cell];
    if (matter_.is_rigid()) return body_.surface_stiffness.empty() ? 0 : body_.surface_stiffness.front();
    const double modulus = body_.body->material.density * math::pow(pressure_wave_speed(body_.body->material), 2);
    float stiffness = float(modulus * body_.body->spacing());
    for (const auto& [particle, weight] : carriers_of(body_, matter_, at.place))
        if (const float part = std::abs(weight); part > 1e-3f)
            stiffness = std::min(stiffness, kShareOfPoints * kContactShare * body_.rest_squared_frequency *
                                                body_.body->mass[particle] / part);
    return stiffness;
}

float MatterCollider::yielding(const Candidate& at) const {
    float gives = 0;
    for (const auto& [particle, weight] : carriers_of(body_, matter_, at.place))
        gives += weight * weight * body_.inverse_mass[particle];
    return gives;
}

void MatterCollider::move(const Candidate& at, const Vec3f& way, const Vec3f& velocity, float most) const {
    for (const auto& [particle, weight] : carriers_of(body_, matter_, at.place))
        push_particle(body_, particle, weight, way, velocity, most);
}

} // namespace filigree
