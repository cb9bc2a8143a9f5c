// Based on: Catto, Iterative dynamics with temporal coherence, 2005; Macklin et al., Small steps in physics simulation,
// 2019.
#include "filigree/physics/rigid/rigid_contacts.h"

#include "filigree/physics/rigid/rigid_body.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace filigree {

namespace {

constexpr double kCorrected = 0.2;       ///< part of a penetration that a substep takes away ...
constexpr double kFastestCorrection = 3; ///< m/s: ... no faster than this
constexpr double kDeep = 0.5;            ///< spacings; deeper there is no such limit
constexpr double kSlop = 2e-3;           ///< spacings of penetration that are left, so that what rests keeps touching
constexpr std::size_t kFewestSweeps = 4, kMostSweeps = 400, kMostRowsSwept = 16000;
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

Index RigidContacts::mover_of(std::span<const BodyState> bodies, Index body) {
    if (bodies[body].sleeps()) return kNoIndex;
    Index& mover = mover_of_body_[body];
    if (mover != kNoIndex) return mover;
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

Vec3d RigidContacts::relative_velocity(const Row& row) const {
    Vec3d velocity = -row.other_velocity;
    if (row.body != kNoIndex) velocity += movers_[row.body].velocity + movers_[row.body].spin.cross(row.arm);
    if (row.other != kNoIndex) velocity -= movers_[row.other].velocity + movers_[row.other].spin.cross(row.other_arm);
    return velocity;
}

void RigidContacts::push(const Row& row, const Vec3d& impulse) {
    if (row.body != kNoIndex) {
        Mover& mover = movers_[row.body];
        mover.velocity += mover.inverse_mass * impulse;
        mover.spin += mover.inverse_inertia * row.arm.cross(impulse);
    }
    if (row.other != kNoIndex) {
        Mover& mover = movers_[row.other];
        mover.velocity -= mover.inverse_mass * impulse;
        mover.spin -= mover.inverse_inertia * row.other_arm.cross(impulse);
    }
}

void RigidContacts::prepare(std::span<const BodyState> bodies) {
    rows_.clear();
    movers_.clear();
    body_of_mover_.clear();
    mover_of_body_.assign(bodies.size(), kNoIndex);
    is_pushed_.assign(bodies.size(), 0);
    for (const ContactPoint& point : points_) {
        Row& row = rows_.emplace_back();
        row.body = mover_of(bodies, point.body);
        row.other = point.other == kNoIndex ? kNoIndex : mover_of(bodies, point.other);
        const Vec3d place = point.place.cast<double>();
        row.normal = point.normal.cast<double>();
        row.arm = place - bodies[point.body].rigid->centre;
        row.other_arm = point.other == kNoIndex ? Vec3d::Zero() : Vec3d(place - bodies[point.other].rigid->centre);
        row.other_velocity = point.other_velocity.cast<double>();
        row.separation = double(point.separation);
        row.tangents[0] = row.normal.unitOrthogonal();
        row.tangents[1] = row.normal.cross(row.tangents[0]);
        const auto mass_along = [&](const Vec3d& along) {
            double gives = 0;
            const auto add = [&](Index mover, const Vec3d& arm) {
                if (mover == kNoIndex) return;
                const Vec3d turning = arm.cross(along);
                gives += movers_[mover].inverse_mass + turning.dot(movers_[mover].inverse_inertia * turning);
            };
            add(row.body, row.arm);
            add(row.other, row.other_arm);
            return gives > 0 ? 1 / gives : 0;
        };
        row.mass = mass_along(row.normal);
        for (int k = 0; k < 2; ++k) row.tangent_masses[k] = mass_along(row.tangents[k]);
        row.approach = relative_velocity(row).dot(row.normal);
    }
}

/// Returns by how much the velocity along the normal, or along the surface, changed, m/s.
double RigidContacts::solve_row(Row& row, double friction) {
    if (row.mass == 0) return 0;
    Vec3d velocity = relative_velocity(row);
    const double pushed = std::max(0.0, row.impulse + row.mass * (row.target - velocity.dot(row.normal)));
    const double more = pushed - std::exchange(row.impulse, pushed);
    double most = std::abs(more) / row.mass;
    if (more != 0) push(row, more * row.normal);
    if (row.impulse == 0 && row.tangent_impulses[0] == 0 && row.tangent_impulses[1] == 0) return most;
    velocity = relative_velocity(row);
    double wanted[2];
    for (int k = 0; k < 2; ++k)
        wanted[k] = row.tangent_impulses[k] - row.tangent_masses[k] * velocity.dot(row.tangents[k]);
    const double limit = friction * row.impulse, length = std::sqrt(wanted[0] * wanted[0] + wanted[1] * wanted[1]);
    Vec3d impulse = Vec3d::Zero();
    for (int k = 0; k < 2; ++k) {
        if (length > limit) wanted[k] *= limit / length;
        const double part = wanted[k] - std::exchange(row.tangent_impulses[k], wanted[k]);
        impulse += part * row.tangents[k];
        most = std::max(most, std::abs(part) / row.tangent_masses[k]);
    }
    push(row, impulse);
    return most;
}

/// There and back, so that loads travel both ways in one.
void RigidContacts::sweep_until_still(double tolerance) {
    const std::size_t sweeps =
        std::clamp(kMostRowsSwept / std::max<std::size_t>(rows_.size(), 1), kFewestSweeps, kMostSweeps);
    for (std::size_t sweep = 0; sweep < sweeps; ++sweep) {
        double most = 0;
        for (std::size_t k = 0; k < rows_.size(); ++k) {
            const std::size_t row = sweep % 2 == 0 ? k : rows_.size() - 1 - k;
            most = std::max(most, solve_row(rows_[row], double(points_[row].friction)));
        }
        if (!(most > tolerance)) return;
    }
}

void RigidContacts::write_back(std::span<BodyState> bodies) const {
    for (std::size_t k = 0; k < movers_.size(); ++k) {
        RigidPose& pose = *bodies[body_of_mover_[k]].rigid;
        const Mat3d r = pose.turn.toRotationMatrix();
        pose.velocity = movers_[k].velocity;
        pose.angular = r * pose.inverse_inertia.inverse() * r.transpose() * movers_[k].spin;
    }
}

void RigidContacts::solve(std::span<BodyState> bodies, double dt) {
    if (rows_.empty()) return;
    for (std::size_t k = 0; k < movers_.size(); ++k) {
        const RigidPose& pose = *bodies[body_of_mover_[k]].rigid;
        movers_[k].velocity = pose.velocity;
        movers_[k].spin = movers_[k].inverse_inertia * pose.angular;
    }
    for (std::size_t k = 0; k < rows_.size(); ++k) {
        Row& row = rows_[k];
        row.target = row.separation > 0 ? -row.separation / dt
                                        : correction(-row.separation, bodies[points_[k].body].body->spacing(),
                                                     points_[k].other == kNoIndex, dt);
        const Vec3d before = dt * points_[k].force->cast<double>();
        row.impulse = std::max(0.0, before.dot(row.normal));
        for (int t = 0; t < 2; ++t) row.tangent_impulses[t] = before.dot(row.tangents[t]);
        if (row.mass > 0 && row.impulse > 0)
            push(row, row.impulse * row.normal + row.tangent_impulses[0] * row.tangents[0] +
                          row.tangent_impulses[1] * row.tangents[1]);
        else
            row.impulse = row.tangent_impulses[0] = row.tangent_impulses[1] = 0;
    }
    sweep_until_still(kStill * (10 * dt));
    for (std::size_t k = 0; k < rows_.size(); ++k) {
        if (!(rows_[k].impulse > 0)) continue;
        is_pushed_[points_[k].body] = 1;
        if (points_[k].other != kNoIndex) is_pushed_[points_[k].other] = 1;
    }
    write_back(bodies);
}

void RigidContacts::finish(std::span<BodyState> bodies, double dt, double slow) {
    if (rows_.empty()) return;
    for (std::size_t k = 0; k < rows_.size(); ++k) {
        Row& row = rows_[k];
        // What did not push is left alone: it may be slowed down only where it also bounces.
        row.target = row.impulse > 0 ? 0 : -std::numeric_limits<double>::infinity();
        const bool bounces = row.impulse > 0 && row.approach < -slow;
        if (bounces) row.target = -double(points_[k].restitution) * row.approach;
    }
    sweep_until_still(kStill * (10 * dt));
    for (std::size_t k = 0; k < rows_.size(); ++k) {
        const Row& row = rows_[k];
        // Of what comes apart the next substep begins anew: the blow's force would throw it.
        const bool parts = relative_velocity(row).dot(row.normal) > 0.5 * slow;
        *points_[k].holds = row.impulse > 0;
        points_[k].impulse = float(row.impulse);
        points_[k].approach = float(-row.approach);
        const Vec3d impulse = row.impulse * row.normal + row.tangent_impulses[0] * row.tangents[0] +
                              row.tangent_impulses[1] * row.tangents[1];
        *points_[k].force = parts ? Vec3f(Vec3f::Zero()) : Vec3f((impulse / dt).cast<float>());
    }
    write_back(bodies);
}

} // namespace filigree
