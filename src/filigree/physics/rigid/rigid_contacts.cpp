// Based on: Catto, Iterative dynamics with temporal coherence, 2005; Macklin et al., Small steps in physics simulation,
// 2019.
#include "filigree/physics/rigid/rigid_contacts.h"

#include "filigree/core/disjoint_sets.h"
#include "filigree/core/parallel_for.h"
#include "filigree/physics/rigid/contact_manifold.h"
#include "filigree/physics/rigid/rigid_body.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace filigree {

namespace {

constexpr double kCorrected = 0.2;       ///< part of a penetration that a substep takes away ...
constexpr double kFastestCorrection = 3; ///< m/s: ... no faster than this
constexpr double kDeep = 0.5;            ///< spacings; deeper there is no such limit
constexpr double kSlop = 2e-3;           ///< spacings of penetration that are left, so that what rests keeps touching
constexpr std::size_t kFewestSweeps = 4, kMostSweeps = 400, kMostRowsSwept = 10000;
constexpr std::size_t kIslandsGrain = 8;
constexpr float kAbout = 0.02f; ///< spacings: ManifoldPoint's margin on obstacles
constexpr double kStill = 1e-4; ///< of what gravity adds in a substep: a smaller change of velocity ends the sweeps

/// m/s that take a part of a penetration away in dt. What came deep into an obstacle, faster than a substep can see, is
/// out soon.
double correction(double depth, double spacing, bool in_obstacle, double dt) {
    const double wanted = kCorrected * std::max(0.0, depth - kSlop * spacing) / dt;
    return in_obstacle && depth > kDeep * spacing ? wanted : std::min(kFastestCorrection, wanted);
}

} // namespace

float touching_margin(float spacing, float speed) {
    constexpr float kLeast = 0.02f, kFaster = 1.5f; // spacings; what comes may become faster
    return kLeast * spacing + kFaster * kLongestRigidStep * speed;
}

/// Points on obstacles come body by body.
void RigidContacts::reduce_on_obstacles(std::span<const BodyState> bodies) {
    std::vector<ManifoldPoint> group;
    std::size_t kept = 0;
    for (std::size_t from = 0, to = 0; from < points_.size(); from = to) {
        const Index body = points_[from].body;
        const auto belongs = [&](const ContactPoint& point) { return point.body == body && point.other == kNoIndex; };
        for (to = from + 1; to < points_.size() && belongs(points_[from]) && belongs(points_[to]);) ++to;
        group.clear();
        for (std::size_t k = from; k < to; ++k)
            group.push_back({points_[k].place, points_[k].normal, points_[k].separation, *points_[k].force});
        reduce_manifold(group, kAbout * float(bodies[body].body->spacing()));
        for (std::size_t k = from; k < to; ++k) {
            const ManifoldPoint& point = group[k - from];
            *points_[k].force = point.force;
            if (point.is_kept)
                points_[kept++] = points_[k];
            else if (points_[k].holds)
                *points_[k].holds = false;
        }
    }
    points_.resize(kept);
}

Index RigidContacts::mover_of(std::span<const BodyState> bodies, Index body) {
    if (body == kNoIndex || bodies[body].sleeps()) return 0;
    Index& mover = mover_of_body_[body];
    if (mover != 0) return mover;
    mover = Index(movers_.size());
    const RigidPose& pose = *bodies[body].rigid;
    const Mat3d r = pose.turn.toRotationMatrix();
    Mover& made = movers_.emplace_back();
    made.inverse_inertia = r * pose.inverse_inertia * r.transpose();
    made.inverse_mass = 1 / pose.mass;
    made.velocity = pose.velocity;
    made.spin = made.inverse_inertia * pose.angular;
    body_of_mover_.push_back(body);
    return mover;
}

inline Vec3d RigidContacts::relative_velocity(const Row& row) const {
    const Mover &body = movers_[row.body], &other = movers_[row.other];
    return body.velocity + body.spin.cross(row.arm) - other.velocity - other.spin.cross(row.other_arm);
}

inline void RigidContacts::push(const Row& row, const Vec3d& impulse) {
    Mover &body = movers_[row.body], &other = movers_[row.other];
    body.velocity += body.inverse_mass * impulse;
    body.spin += body.inverse_inertia * row.arm.cross(impulse);
    other.velocity -= other.inverse_mass * impulse;
    other.spin -= other.inverse_inertia * row.other_arm.cross(impulse);
}

/// Rows of bodies that touch each other, directly or by others, one after the other.
void RigidContacts::find_islands() {
    DisjointSets sets(movers_.size());
    for (const Row& row : rows_)
        if (row.body != 0 && row.other != 0) sets.join(row.body, row.other);
    const auto island = [&](const Row& row) { return sets.root(row.body != 0 ? row.body : row.other); };
    std::vector<Index> first(movers_.size() + 1, 0);
    for (const Row& row : rows_) ++first[island(row) + 1];
    islands_.clear();
    for (std::size_t k = 0; k + 1 < first.size(); ++k) {
        if (first[k + 1] > 0) islands_.push_back(first[k]);
        first[k + 1] += first[k];
    }
    islands_.push_back(Index(rows_.size()));
    std::vector<Row> sorted(rows_.size());
    for (const Row& row : rows_) sorted[first[island(row)]++] = row;
    rows_ = std::move(sorted);
}

void RigidContacts::begin_row(Row& row, const ContactPoint& point, std::span<const BodyState> bodies,
                              const Vec3d& gravity) const {
    const Vec3d place = point.place.cast<double>(), other_velocity = point.other_velocity.cast<double>();
    row.normal = point.normal.cast<double>();
    row.tangents[0] = row.normal.unitOrthogonal();
    row.tangents[1] = row.normal.cross(row.tangents[0]);
    row.arm = place - bodies[point.body].rigid->centre;
    row.other_arm = point.other == kNoIndex ? Vec3d::Zero() : Vec3d(place - bodies[point.other].rigid->centre);
    row.separation = double(point.separation);
    row.friction = double(point.friction);
    const auto velocity_of = [&](const Vec3d& impulse) { // by an impulse there
        Vec3d velocity = Vec3d::Zero();
        for (const auto& [mover, arm] : {std::pair(row.body, &row.arm), std::pair(row.other, &row.other_arm)}) {
            const Mover& moved = movers_[mover];
            velocity += moved.inverse_mass * impulse + (moved.inverse_inertia * arm->cross(impulse)).cross(*arm);
        }
        return velocity;
    };
    const Vec3d pushed = velocity_of(row.normal);
    row.mass = 1 / pushed.dot(row.normal);
    row.other_velocity[0] = other_velocity.dot(row.normal);
    for (int k = 0; k < 2; ++k) {
        row.tangent_masses[k] = 1 / velocity_of(row.tangents[k]).dot(row.tangents[k]);
        row.beside[k] = pushed.dot(row.tangents[k]);
        row.other_velocity[k + 1] = other_velocity.dot(row.tangents[k]);
    }
    row.approach = relative_velocity(row).dot(row.normal) - row.other_velocity[0];
    if (row.approach < 0 && (row.body == 0 || row.other == 0)) {
        const double towards = (row.body == 0 ? 1 : -1) * gravity.dot(row.normal);
        row.approach = -std::sqrt(std::max(0.0, row.approach * row.approach + 2 * towards * row.separation));
    }
}

void RigidContacts::prepare(std::span<const BodyState> bodies, const Vec3d& gravity) {
    reduce_on_obstacles(bodies);
    rows_.clear();
    movers_.assign(1, {});
    body_of_mover_.assign(1, kNoIndex);
    mover_of_body_.assign(bodies.size(), 0);
    is_pushed_.assign(bodies.size(), 0);
    for (Index k = 0; k < points_.size(); ++k) {
        const Index body = mover_of(bodies, points_[k].body), other = mover_of(bodies, points_[k].other);
        if (body == 0 && other == 0) continue;
        Row& row = rows_.emplace_back();
        row.body = body;
        row.other = other;
        row.point = k;
    }
    find_islands();
    for (Row& row : rows_) begin_row(row, points_[row.point], bodies, gravity);
}

/// Returns by how much the velocity along the normal, or along the surface, changed, m/s.
inline double RigidContacts::solve_row(Row& row) {
    const Vec3d velocity = relative_velocity(row);
    const double along = velocity.dot(row.normal) - row.other_velocity[0];
    const double pushed = std::max(0.0, row.impulse + row.mass * (row.target - along));
    const double more = pushed - std::exchange(row.impulse, pushed);
    if (pushed == 0 && more == 0) return 0;
    double wanted[2];
    for (int k = 0; k < 2; ++k)
        wanted[k] =
            row.tangent_impulses[k] -
            row.tangent_masses[k] * (velocity.dot(row.tangents[k]) - row.other_velocity[k + 1] + more * row.beside[k]);
    const double limit = row.friction * pushed, squared = wanted[0] * wanted[0] + wanted[1] * wanted[1];
    const double shorter = squared > limit * limit ? limit / std::sqrt(squared) : 1;
    double most = std::abs(more) / row.mass;
    Vec3d impulse = more * row.normal;
    for (int k = 0; k < 2; ++k) {
        wanted[k] *= shorter;
        const double part = wanted[k] - std::exchange(row.tangent_impulses[k], wanted[k]);
        impulse += part * row.tangents[k];
        most = std::max(most, std::abs(part) / row.tangent_masses[k]);
    }
    push(row, impulse);
    return most;
}

/// There and back, so that loads travel both ways.
void RigidContacts::sweep_until_still(std::span<const Index> rows, std::size_t most_rows, double tolerance) {
    if (rows.empty()) return;
    const std::size_t sweeps = std::clamp(most_rows / rows.size(), kFewestSweeps, kMostSweeps);
    for (std::size_t sweep = 0; sweep < sweeps; ++sweep) {
        double most = 0;
        for (std::size_t k = 0; k < rows.size(); ++k)
            most = std::max(most, solve_row(rows_[rows[sweep % 2 == 0 ? k : rows.size() - 1 - k]]));
        if (!(most > tolerance)) return;
    }
}

void RigidContacts::write_back(std::span<BodyState> bodies) const {
    for (std::size_t k = 1; k < movers_.size(); ++k) {
        RigidPose& pose = *bodies[body_of_mover_[k]].rigid;
        const Mat3d r = pose.turn.toRotationMatrix();
        pose.velocity = movers_[k].velocity;
        pose.angular = r * pose.inverse_inertia.inverse() * r.transpose() * movers_[k].spin;
    }
}

void RigidContacts::solve(std::span<BodyState> bodies, double dt, const RunContext& context) {
    if (rows_.empty()) return;
    for (std::size_t k = 1; k < movers_.size(); ++k) {
        const RigidPose& pose = *bodies[body_of_mover_[k]].rigid;
        movers_[k].velocity = pose.velocity;
        movers_[k].spin = movers_[k].inverse_inertia * pose.angular;
    }
    swept_.resize(rows_.size());
    std::iota(swept_.begin(), swept_.end(), Index{0});
    for (Row& row : rows_) {
        const ContactPoint& point = points_[row.point];
        row.target = row.separation > 0
                         ? -row.separation / dt
                         : correction(-row.separation, bodies[point.body].body->spacing(), point.other == kNoIndex, dt);
        const Vec3d before = dt * point.force->cast<double>();
        row.impulse = std::max(0.0, before.dot(row.normal));
        for (int t = 0; t < 2; ++t) row.tangent_impulses[t] = row.impulse > 0 ? before.dot(row.tangents[t]) : 0;
        if (row.impulse > 0) push(row, row.whole_impulse());
    }
    parallel_for(context, islands_.size() - 1, kIslandsGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k)
            sweep_until_still(std::span(swept_).subspan(islands_[k], islands_[k + 1] - islands_[k]), kMostRowsSwept,
                              kStill * (10 * dt));
    });
    for (const Row& row : rows_) {
        if (!(row.impulse > 0)) continue;
        is_pushed_[points_[row.point].body] = 1;
        if (points_[row.point].other != kNoIndex) is_pushed_[points_[row.point].other] = 1;
    }
    write_back(bodies);
}

void RigidContacts::finish(std::span<BodyState> bodies, double dt, double slow, const RunContext& context) {
    if (rows_.empty()) return;
    // What did not push is left alone: it may be slowed down only where it also bounces.
    for (Row& row : rows_)
        row.target = row.approach < -slow ? -double(points_[row.point].restitution) * row.approach : 0;
    parallel_for(context, islands_.size() - 1, kIslandsGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
            const std::span rows = std::span(swept_).subspan(islands_[k], islands_[k + 1] - islands_[k]);
            std::size_t pushing = 0;
            for (Index r = islands_[k]; r < islands_[k + 1]; ++r)
                if (rows_[r].impulse > 0) rows[pushing++] = r;
            sweep_until_still(rows.first(pushing), kMostRowsSwept / 2, kStill * (10 * dt));
        }
    });
    for (const Row& row : rows_) {
        // Of what comes apart the next substep begins anew: the blow's force would throw it.
        const double along = relative_velocity(row).dot(row.normal) - row.other_velocity[0];
        const ContactPoint& point = points_[row.point];
        if (point.holds) *point.holds = row.impulse > 0;
        *point.force = along > 0.5 * slow ? Vec3f(Vec3f::Zero()) : Vec3f((row.whole_impulse() / dt).cast<float>());
    }
    write_back(bodies);
}

} // namespace filigree
