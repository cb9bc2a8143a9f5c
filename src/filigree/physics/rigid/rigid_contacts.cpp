// Based on: Catto, Iterative dynamics with temporal coherence, 2005; Macklin et al., Small steps in physics simulation,
// 2019.
#include "filigree/physics/rigid/rigid_contacts.h"

#include "filigree/core/disjoint_sets.h"
#include "filigree/core/parallel_for.h"
#include "filigree/physics/rigid/rigid_body.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

namespace filigree {

namespace {

constexpr double kCorrected = 0.2;       ///< part of a penetration that a substep takes away ...
constexpr double kFastestCorrection = 3; ///< m/s: ... no faster than this
constexpr float kDeep = 0.5f;            ///< spacings, in an obstacle: what is deeper is moved out at once
constexpr double kSlop = 2e-3;           ///< spacings of penetration that are left, so that what rests keeps touching
constexpr std::size_t kFewestSweeps = 3, kMostSweeps = 400, kMostRowsSwept = 8000;
constexpr std::size_t kIslandsGrain = 8, kRowsGrain = 128;
/// Spacings outside, and of the way in the substep: what has come so near bounces as what pushes does.
constexpr float kTouches = 0.005f, kTouchesOfWay = 0.05f;
constexpr double kStill = 1e-4; ///< of what gravity adds in a substep: a smaller change of velocity ends the sweeps

/// m/s that take a part of a penetration away in dt.
double correction(double depth, double spacing, double dt) {
    return std::min(kFastestCorrection, kCorrected * std::max(0.0, depth - kSlop * spacing) / dt);
}

ContactRow::Four four_of(const Vec3f& v) {
    const ContactRow::Four four = {v.x(), v.y(), v.z(), 0};
    return four;
}
Vec3f vector_of(const ContactRow::Four& v) { return {v[0], v[1], v[2]}; }

} // namespace

float touching_margin(float spacing, float speed) {
    constexpr float kLeast = 0.02f, kFaster = 1.5f; // spacings; what comes may become faster
    return kLeast * spacing + kFaster * kLongestRigidStep * speed;
}

/// What has to be said of points of one body on obstacles for a manifold.
std::vector<ManifoldPoint> RigidContacts::manifold_points(std::span<const ContactPoint> points, const RigidPose& pose) {
    const Mat3d turn = pose.turn.toRotationMatrix();
    const Vec3d spin = turn * (pose.inverse_inertia * (turn.transpose() * pose.angular));
    std::vector<ManifoldPoint> manifold;
    for (const ContactPoint& point : points) {
        const Vec3d velocity = pose.velocity + spin.cross(point.place.cast<double>() - pose.centre);
        const float comes = (point.other_velocity - velocity.cast<float>()).dot(point.normal);
        manifold.push_back(
            {point.place, point.normal, point.separation - kLongestRigidStep * std::max(0.0f, comes), *point.force});
    }
    return manifold;
}

/// Points on obstacles come body by body.
void RigidContacts::reduce_on_obstacles(std::span<const BodyState> bodies) {
    std::size_t kept = 0;
    for (std::size_t from = 0, to = 0; from < points_.size(); from = to) {
        const Index body = points_[from].body;
        const auto belongs = [&](const ContactPoint& point) { return point.body == body && point.other == kNoIndex; };
        for (to = from + 1; to < points_.size() && belongs(points_[from]) && belongs(points_[to]);) ++to;
        if (to - from <= kMostInManifold) {
            while (from < to) points_[kept++] = points_[from++];
            continue;
        }
        std::vector<ManifoldPoint> manifold =
            manifold_points(std::span(points_).subspan(from, to - from), *bodies[body].rigid);
        reduce_manifold(manifold, kManifoldScale * float(bodies[body].body->spacing()));
        for (const ManifoldPoint& point : manifold) {
            const ContactPoint& of = points_[from++];
            *of.force = point.force;
            if (!point.is_kept && of.holds) *of.holds = false;
            if (point.is_kept) points_[kept++] = of;
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
    Mover& made = movers_.emplace_back();
    made.body = body;
    made.turn = pose.turn.toRotationMatrix();
    const Mat3f r = made.turn.cast<float>();
    made.inverse_inertia = r * pose.inverse_inertia.cast<float>() * r.transpose();
    made.inverse_mass = float(1 / pose.mass);
    return mover;
}

/// Rows of bodies that touch each other, directly or by others, one after the other.
void RigidContacts::find_islands() {
    DisjointSets sets(movers_.size());
    for (const Touching& row : touching_)
        if (row.body != 0 && row.other != 0) sets.join(row.body, row.other);
    const auto island = [&](const Touching& row) { return sets.root(row.body != 0 ? row.body : row.other); };
    std::vector<Index> first(movers_.size() + 1, 0);
    for (const Touching& row : touching_) ++first[island(row) + 1];
    islands_.clear();
    for (std::size_t k = 0; k + 1 < first.size(); ++k) {
        if (first[k + 1] > 0) islands_.push_back(first[k]);
        first[k + 1] += first[k];
    }
    islands_.push_back(Index(touching_.size()));
    sorted_.resize(touching_.size());
    for (const Touching& row : touching_) sorted_[first[island(row)]++] = row;
}

void RigidContacts::begin_answer(ContactRow::Answer& answer, const ContactRow& row, Index mover,
                                 const Vec3d& arm) const {
    const Mover& moved = movers_[mover];
    const Vec3f at = arm.cast<float>();
    answer.speed = moved.inverse_mass;
    for (int k = 0; k < 3; ++k) {
        const Vec3f turning = at.cross(vector_of(row.direction[k]));
        answer.arm[k] = four_of(turning);
        answer.spin[k] = four_of(moved.inverse_inertia * turning);
    }
}

/// m/s, of the body beside the other, before impulses.
Vec3d RigidContacts::velocity_before(const ContactRow& row, const Vec3d& arm, const Vec3d& other_arm) const {
    const Mover &a = movers_[row.movers[0]], &b = movers_[row.movers[1]];
    return a.velocity + a.spin.cross(arm) - b.velocity - b.spin.cross(other_arm) -
           points_[row.point].other_velocity.cast<double>();
}

void RigidContacts::begin_row(ContactRow& row, std::span<const BodyState> bodies, const Vec3d& gravity) const {
    const ContactPoint& point = points_[row.point];
    const Vec3d place = point.place.cast<double>(), arm = place - bodies[point.body].rigid->centre;
    const Vec3d other_arm = point.other == kNoIndex ? Vec3d::Zero() : Vec3d(place - bodies[point.other].rigid->centre);
    const Vec3f tangent = point.normal.unitOrthogonal();
    row.direction[0] = four_of(point.normal);
    row.direction[1] = four_of(tangent);
    row.direction[2] = four_of(point.normal.cross(tangent));
    row.separation = point.separation;
    row.friction = point.friction;
    begin_answer(row.body, row, row.movers[0], arm);
    begin_answer(row.other, row, row.movers[1], other_arm);
    const auto answer = [&](int pushed, int along) { // m/s along one direction of an impulse along another
        const ContactRow::Four sum =
            row.body.arm[along] * row.body.spin[pushed] + row.other.arm[along] * row.other.spin[pushed];
        return sum[0] + sum[1] + sum[2] + (pushed == along ? row.body.speed + row.other.speed : 0);
    };
    for (int k = 0; k < 3; ++k) row.mass[k] = 1 / answer(k, k);
    for (int k = 0; k < 2; ++k) row.beside[k] = answer(0, k + 1);
    const Vec3d normal = point.normal.cast<double>();
    double approach = velocity_before(row, arm, other_arm).dot(normal);
    if (approach < 0 && (row.movers[0] == 0 || row.movers[1] == 0)) {
        const double towards = (row.movers[0] == 0 ? 1 : -1) * gravity.dot(normal);
        approach = -std::sqrt(std::max(0.0, approach * approach + 2 * towards * double(row.separation)));
    }
    row.approach = float(approach);
}

void RigidContacts::take_velocities(std::span<const BodyState> bodies) {
    for (std::size_t k = 1; k < movers_.size(); ++k) {
        Mover& mover = movers_[k];
        const RigidPose& pose = *bodies[mover.body].rigid;
        mover.velocity = pose.velocity;
        mover.angular = pose.angular;
        mover.spin = mover.turn * (pose.inverse_inertia * (mover.turn.transpose() * pose.angular));
    }
}

std::vector<std::pair<Index, float>> RigidContacts::move_out_of_obstacles(std::span<BodyState> bodies) {
    std::map<Index, Vec3f> ways; // of bodies, m
    for (const ContactPoint& point : points_) {
        if (point.other != kNoIndex) continue;
        const float too_deep = -point.separation - kDeep * float(bodies[point.body].body->spacing());
        if (!(too_deep > 0)) continue;
        Vec3f& way = ways.try_emplace(point.body, Vec3f::Zero()).first->second;
        if (too_deep > way.norm()) way = too_deep * point.normal;
    }
    std::vector<std::pair<Index, float>> moved;
    for (const auto& [body, way] : ways) {
        bodies[body].rigid->centre += way.cast<double>();
        place_particles(bodies[body]);
        moved.emplace_back(body, way.norm());
    }
    for (ContactPoint& point : points_) {
        if (const auto of = ways.find(point.body); of != ways.end()) {
            point.place += of->second;
            point.separation += of->second.dot(point.normal);
        }
        if (const auto of = ways.find(point.other); of != ways.end()) point.separation -= of->second.dot(point.normal);
    }
    return moved;
}

void RigidContacts::prepare(std::span<const BodyState> bodies, const Vec3d& gravity, const RunContext& context) {
    reduce_on_obstacles(bodies);
    movers_.assign(1, {});
    mover_of_body_.assign(bodies.size(), 0);
    is_pushed_.assign(bodies.size(), 0);
    touching_.clear();
    for (Index k = 0; k < points_.size(); ++k) {
        const Index body = mover_of(bodies, points_[k].body), other = mover_of(bodies, points_[k].other);
        if (body != 0 || other != 0) touching_.push_back({body, other, k});
    }
    take_velocities(bodies);
    find_islands();
    rows_.resize(sorted_.size());
    parallel_for(context, rows_.size(), kRowsGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
            const Touching& touching = sorted_[k];
            rows_[k].movers[0] = touching.body;
            rows_[k].movers[1] = touching.other;
            rows_[k].point = touching.point;
            begin_row(rows_[k], bodies, gravity);
        }
    });
}

/// There and back, so that loads travel both ways.
void RigidContacts::sweep_until_still(std::span<const Index> rows, std::size_t most_rows, float tolerance) {
    if (rows.empty()) return;
    const std::size_t sweeps = std::clamp(most_rows / rows.size(), kFewestSweeps, kMostSweeps);
    for (std::size_t sweep = 0; sweep < sweeps; ++sweep) {
        float most = 0;
        for (std::size_t k = 0; k < rows.size(); ++k) {
            ContactRow& row = rows_[rows[sweep % 2 == 0 ? k : rows.size() - 1 - k]];
            most = std::max(most, row.solve(changes_[row.movers[0]], changes_[row.movers[1]]));
        }
        if (!(most > tolerance)) return;
    }
}

/// The velocities with all impulses so far.
void RigidContacts::write_back(std::span<BodyState> bodies) const {
    for (std::size_t k = 1; k < movers_.size(); ++k) {
        const Mover& mover = movers_[k];
        RigidPose& pose = *bodies[mover.body].rigid;
        const Vec3d spin = mover.turn.transpose() * vector_of(changes_[k].spin).cast<double>();
        pose.velocity = mover.velocity + vector_of(changes_[k].velocity).cast<double>();
        pose.angular = mover.angular + mover.turn * (pose.inverse_inertia.inverse() * spin);
    }
}

void RigidContacts::solve(std::span<BodyState> bodies, double dt, const RunContext& context) {
    if (rows_.empty()) return;
    take_velocities(bodies);
    changes_.assign(movers_.size(), {});
    swept_.resize(rows_.size());
    std::iota(swept_.begin(), swept_.end(), Index{0});
    for (ContactRow& row : rows_) start_row(row, bodies, dt);
    parallel_for(context, islands_.size() - 1, kIslandsGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k)
            sweep_until_still(std::span(swept_).subspan(islands_[k], islands_[k + 1] - islands_[k]), kMostRowsSwept,
                              float(kStill * (10 * dt)));
    });
    for (const ContactRow& row : rows_) {
        if (!(row.impulse[0] > 0)) continue;
        is_pushed_[points_[row.point].body] = 1;
        if (points_[row.point].other != kNoIndex) is_pushed_[points_[row.point].other] = 1;
    }
    write_back(bodies);
}

/// From the velocities with loads, and the impulse of the substep before.
void RigidContacts::start_row(ContactRow& row, std::span<const BodyState> bodies, double dt) {
    const ContactPoint& point = points_[row.point];
    const Vec3d place = point.place.cast<double>();
    const Vec3d other_arm = point.other == kNoIndex ? Vec3d::Zero() : Vec3d(place - bodies[point.other].rigid->centre);
    const Vec3f before = velocity_before(row, place - bodies[point.body].rigid->centre, other_arm).cast<float>();
    const Vec3f impulse = float(dt) * *point.force;
    for (int k = 0; k < 3; ++k) {
        row.start[k] = before.dot(vector_of(row.direction[k]));
        row.impulse[k] = impulse.dot(vector_of(row.direction[k]));
    }
    row.target =
        float(point.separation > 0 ? -double(point.separation) / dt
                                   : correction(-double(point.separation), bodies[point.body].body->spacing(), dt));
    if (row.impulse[0] > 0)
        row.push(changes_[row.movers[0]], changes_[row.movers[1]], row.impulse[0], row.impulse[1], row.impulse[2]);
    else
        std::ranges::fill(row.impulse, 0.0f);
}

void RigidContacts::finish(std::span<BodyState> bodies, double dt, double slow, const RunContext& context) {
    if (rows_.empty()) return;
    const auto is_touching = [&](const ContactRow& row) { // now; what only came nearer is left alone
        if (row.impulse[0] > 0) return true;
        const bool is_of_sleeper = row.movers[0] == 0 || (row.movers[1] == 0 && points_[row.point].other != kNoIndex);
        if (is_of_sleeper) return false;
        const float along = row.speeds(changes_[row.movers[0]], changes_[row.movers[1]])[0];
        const float spacing = float(bodies[points_[row.point].body].body->spacing());
        const float came = float(dt) * std::max(-row.approach, float(slow)); // what bounces in the air gains energy
        return row.separation + float(dt) * along < std::min(kTouches * spacing, kTouchesOfWay * came);
    };
    for (ContactRow& row : rows_)
        row.target = row.approach < -float(slow) ? -points_[row.point].restitution * row.approach : 0;
    parallel_for(context, islands_.size() - 1, kIslandsGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
            const std::span rows = std::span(swept_).subspan(islands_[k], islands_[k + 1] - islands_[k]);
            std::size_t pushing = 0;
            for (Index r = islands_[k]; r < islands_[k + 1]; ++r)
                if (is_touching(rows_[r])) rows[pushing++] = r;
            sweep_until_still(rows.first(pushing), kMostRowsSwept / 2, float(kStill * (10 * dt)));
        }
    });
    for (const ContactRow& row : rows_) {
        // Of what comes apart the next substep begins anew: the blow's force would throw it.
        const float along = row.speeds(changes_[row.movers[0]], changes_[row.movers[1]])[0];
        ContactPoint& point = points_[row.point];
        point.impulse = row.impulse[0];
        point.approach = -row.approach;
        if (point.holds) *point.holds = row.impulse[0] > 0;
        Vec3f impulse = Vec3f::Zero();
        for (int k = 0; k < 3 && !(along > 0.5f * float(slow)); ++k)
            impulse += row.impulse[k] * vector_of(row.direction[k]);
        *point.force = impulse / float(dt);
    }
    write_back(bodies);
}

} // namespace filigree
