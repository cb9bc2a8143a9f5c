// What may touch: the clocks of pairs, the broad phase that finds them, and which are to be searched.
#include "filigree/core/parallel_for.h"
#include "filigree/physics/contact/ahead.h"
#include "filigree/physics/contact/box_sweep.h"
#include "filigree/physics/contact/cell_boxes.h"
#include "filigree/physics/rigid/rigid_body.h"

#include <algorithm>
#include <limits>

namespace filigree {

namespace {

constexpr std::size_t kExtentsGrain = 8, kClocksGrain = 512; // bodies, pairs
/// Of what another pair may still move until it is searched; they share what a search finds out about bodies.
constexpr float kSearchedAlong = 0.5f;
constexpr float kFurthest = 1e15f;       ///< m that anything goes in a substep
constexpr float kCrushed = 0.05f;        ///< volume ratio below which a cell counts as crushed
constexpr float kTooManyCrushed = 0.05f; ///< part of a body's cells
constexpr Index kAskedCells = 7;         ///< one of so many is asked

/// Part of the body's cells that are crushed or inside out, of some.
float crushed_part(const BodyState& body, const Matter& matter) {
    const std::size_t cells = body.body->cells.cells.size();
    std::size_t crushed = 0, asked = 0;
    for (Index c = 0; c < cells; c += kAskedCells, ++asked)
        crushed += !(matter.volume_ratio(body.corner_positions(), c) > kCrushed);
    return float(crushed) / float(asked);
}

} // namespace

/// All of a body that may touch.
Box Contacts::extent(const BodyState& body, std::size_t number) const {
    if (body.rigid && matter_[number]->matter) {
        const TurnedBox box = CellBoxes(*matter_[number]->matter, body.positions, 0).rigid_box();
        const Vec3f half = box.half_axes.cwiseAbs().rowwise().sum();
        return {(box.centre - half).cast<double>(), (box.centre + half).cast<double>()};
    }
    Box box = box_of(body.corner_positions());
    if (motions_.has_points_outside(number))
        for (std::size_t s = 0; s < body.surface.size(); ++s)
            box.extend(embedded_point(body.surface, s, body.positions).cast<double>());
    return box;
}

/// Of what both sides have, a bound on how far, or how fast, one has gone beside the other.
float Contacts::bound_between(const ContactPair& pair, const Extremes& points, const Extremes& touched) const {
    if (pair.points.is_obstacle()) return MotionBounds::furthest(touched);
    if (!pair.touched.is_obstacle()) return Extremes::between(points, touched);
    const Vec3f& towards = towards_[pair.touched.number()];
    return towards.isZero(0) ? MotionBounds::furthest(points) : MotionBounds::furthest_along(points, towards);
}

float Contacts::speed_of(const ContactPair& pair) const {
    const auto velocities = [&](ColliderId id) {
        return id.is_obstacle() ? Extremes{} : motions_.velocities(id.number());
    };
    return bound_between(pair, velocities(pair.points), velocities(pair.touched));
}

/// m: bound on how far a pair is from where it was at the last search.
float Contacts::displacement_of(const ContactPair& pair) const {
    const auto shifts = [&](ColliderId id) { return id.is_obstacle() ? Extremes{} : motions_.shifts(id.number()); };
    return pair.displacement + bound_between(pair, shifts(pair.points), shifts(pair.touched));
}

void Contacts::count_from_here(std::span<const BodyState> bodies) {
    for (ContactPair& pair : pairs_) pair.displacement = displacement_of(pair);
    motions_.count_from_here(bodies, false);
}

void Contacts::begin_frame(std::span<BodyState> bodies, const RunContext& context) {
    list_work(bodies); // some may have woken or gone to sleep
    travel(bodies, 0, 0, 0, context);
    motions_.count_from_here(bodies, true);
    find_recovering(bodies);
    for (ContactPair& pair : pairs_) {
        pair.travelled = 0;
        std::ranges::fill(pair.clear_until, 0.0f); // by speeds that may have changed
    }
}

void Contacts::end_frame(std::span<const BodyState> bodies, const RunContext& context) {
    motions_.find_shifts(bodies, context);
    count_from_here(bodies);
}

void Contacts::travel(std::span<BodyState> bodies, float dt, double from, double until, const RunContext& context) {
    place_corners(bodies, context);
    motions_.find_speeds(bodies, dt, context);
    std::vector<float> ways;
    float furthest = 0;
    for (const Obstacle& obstacle : world_.obstacles) {
        const bool moves = obstacle.motion.moves() && until > from;
        ways.push_back(moves ? float(obstacle_way(obstacle.motion, bodies, from, until)) : 0);
        furthest = std::max(furthest, ways.back());
    }
    travelled_ += dt * relative_speed_of_all(bodies) + furthest;
    parallel_for(context, pairs_.size(), kClocksGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
            ContactPair& pair = pairs_[k];
            const float of_obstacle = pair.is_of_bodies() ? 0 : ways[pair.obstacle()];
            pair.speed = speed_of(pair);
            pair.travelled += dt * pair.speed + of_obstacle;
            pair.displacement += of_obstacle;
            pair.since += dt;
        }
    });
}

/// m/s: bound on what anything has beside anything.
float Contacts::relative_speed_of_all(std::span<const BodyState> bodies) const {
    std::optional<Extremes> all;
    if (!shapes_.empty()) all.emplace();
    for (std::size_t b = 0; b < bodies.size(); ++b)
        if (!bodies[b].is_absent) all = all ? all->with(motions_.velocities(b)) : motions_.velocities(b);
    return all ? Extremes::between(*all, *all) : 0;
}

void Contacts::was_moved(std::size_t body, float way) {
    travelled_ += way;
    const ColliderId id = ColliderId::body(body);
    for (ContactPair& pair : pairs_)
        if (pair.points == id || pair.touched == id) pair.travelled += way;
}

void Contacts::was_placed(std::size_t body) {
    for (ContactPair& pair : pairs_)
        if (pair.points == ColliderId::body(body)) pair.knows_side = false;
}

void Contacts::begin_anew() {
    reach_ = -1;
    travelled_ = 0;
    for (ContactPair& pair : pairs_) {
        pair.travelled = pair.displacement = 0;
        pair.reach = -1;
        pair.since = std::numeric_limits<float>::max();
        std::ranges::fill(pair.clear_until, 0.0f);
    }
}

/// Where an obstacle has jumped, what was on its other side is not where it was: sides are found anew.
void Contacts::forget_jumps(double time) {
    for (std::size_t o = 0; o < shapes_.size() && time_; ++o) {
        if (!jumps_between(world_.obstacles[o].motion, *time_, time)) continue;
        reach_ = -1;
        for (ContactPair& pair : pairs_) {
            if (pair.is_of_bodies() || pair.obstacle() != o) continue;
            pair.knows_side = false;
            pair.reach = -1;
        }
    }
    time_ = time;
}

void Contacts::find_pairs(std::span<const BodyState> bodies, float least_reach, const Ahead& ahead,
                          const ObstaclePoses& poses, const RunContext& context) {
    std::vector<Box> boxes(bodies.size()); // empty: of bodies that meet nothing
    parallel_for(context, bodies.size(), kExtentsGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t b = begin; b < end; ++b) {
            if (bodies[b].is_absent) continue;
            if (is_finite(bodies[b].positions)) boxes[b] = extent(bodies[b], b); // else the frame is done again
        }
    });
    float spacing = 0;
    std::vector<Index> meeting;
    std::vector<BoxSweep::Bounds> bounds;
    for (Index b = 0; b < bodies.size(); ++b) {
        if (boxes[b].empty()) continue;
        meeting.push_back(b);
        bounds.push_back({boxes[b].min.cast<float>(), boxes[b].max.cast<float>()});
        spacing = std::max(spacing, float(bodies[b].body->spacing()));
    }
    const float wanted = std::min(relative_speed_of_all(bodies) * ahead.frame, 2 * spacing);
    const float reach = std::max({spacing, wanted, least_reach}), around = reach + spacing;
    travelled_ = 0;
    reach_ = reach;
    std::vector<std::pair<ColliderId, ColliderId>> found;
    const auto add = [&](ColliderId points, ColliderId touched) {
        if (touched.is_obstacle() || matter_[touched.number()]->matter) found.emplace_back(points, touched);
    };
    for (const Index b : meeting) {
        const ColliderId body = ColliderId::body(b);
        if (within_bodies_ && !bodies[b].rigid) add(body, body);
        for (std::size_t o = 0; o < shapes_.size(); ++o) {
            if (!(shapes_[o].gap(boxes[b], poses.at(o)) < double(around))) continue;
            add(body, ColliderId::obstacle(o));
            if (!shapes_[o].sharp_edges().empty()) add(ColliderId::obstacle(o), body);
        }
    }
    const BoxSweep sweep(bounds);
    std::vector<std::uint16_t> room;
    for (std::size_t a = 0; a < meeting.size() && between_bodies_; ++a) {
        const ColliderId body = ColliderId::body(meeting[sweep.order()[a]]);
        sweep.each_near(a, around, room, [&](std::size_t b) {
            const ColliderId other = ColliderId::body(meeting[sweep.order()[b]]);
            if (other == body || (bodies[body.number()].rigid && bodies[other.number()].rigid)) return; // RigidPairs'
            add(body, other);
            add(other, body);
        });
    }
    std::ranges::sort(found);
    std::vector<ContactPair> pairs;
    pairs.reserve(found.size());
    auto old = pairs_.begin();
    for (const auto& [points, touched] : found) {
        while (old != pairs_.end() && std::pair(old->points, old->touched) < std::pair(points, touched)) ++old;
        const bool is_old = old != pairs_.end() && old->points == points && old->touched == touched;
        pairs.push_back(is_old ? std::move(*old) : make_pair(points, touched, bodies));
        pairs.back().speed = speed_of(pairs.back());
    }
    pairs_ = std::move(pairs);
}

void Contacts::search(std::span<BodyState> bodies, const Search& search, const RunContext& context) {
    forget_jumps(search.time);
    const ObstaclePoses poses(world_, search.time);
    const Ahead ahead(world_, bodies, search);
    const bool looks_ahead = std::ranges::any_of(shapes_, &ObstacleShape::is_traced) ||
                             std::ranges::any_of(bodies, [](const BodyState& body) { return body.rigid.has_value(); });
    const float next = looks_ahead ? ahead.in_step_of_all(relative_speed_of_all(bodies)) : 0;
    bool changed = travelled_ + next > reach_;
    if (changed)
        find_pairs(bodies, next < kFurthest ? 2 * next : 0, ahead, poses, context); // else the frame is done again
    const bool woke = wake_touched(bodies);
    const auto is_due = [&](const ContactPair& pair, float moved, float part) {
        if (!(moved > part * (pair.reach - ahead.in_step(pair))) || sleeps(pair, bodies)) return false;
        return !pair.is_own() || pair.since >= ahead.frame / Ahead::kOwnSearches;
    };
    // What has gone no further there and back is no further away.
    const bool may_be_due = std::ranges::any_of(
        pairs_, [&](const ContactPair& pair) { return is_due(pair, pair.displacement + pair.travelled, 1); });
    if (may_be_due) motions_.find_shifts(bodies, context);
    if (may_be_due &&
        std::ranges::any_of(pairs_, [&](const ContactPair& pair) { return is_due(pair, displacement_of(pair), 1); })) {
        changed = true;
        count_from_here(bodies);
        std::vector<Index> due;
        for (Index i = 0; i < pairs_.size(); ++i)
            if (is_due(pairs_[i], pairs_[i].displacement, kSearchedAlong)) due.push_back(i);
        find_candidates(due, bodies, ahead, poses, context);
    }
    if (changed || woke) list_work(bodies);
}

/// A body that sleeps wakes when one that is awake touches it.
bool Contacts::wake_touched(std::span<BodyState> bodies) const {
    bool woke = false;
    if (std::ranges::none_of(bodies, &BodyState::sleeps)) return woke;
    for (const ContactPair& pair : pairs_) {
        if (!pair.is_of_bodies() || !holds(pair)) continue;
        const Index one = pair.points.number(), other = pair.touched.number();
        for (const auto& [sleeper, awake] : {std::pair(one, other), std::pair(other, one)}) {
            if (bodies[sleeper].is_absent || !bodies[sleeper].sleeps() || bodies[awake].sleeps()) continue;
            wake(bodies[sleeper]);
            woke = true;
        }
    }
    return woke;
}

void Contacts::list_work(std::span<const BodyState> bodies) {
    work_.clear();
    for (Index i = 0; i < pairs_.size(); ++i)
        for (Index block = 0; block < pairs_[i].blocks() && !sleeps(pairs_[i], bodies); ++block)
            work_.push_back({i, block});
}

/// A body that starts crushed or inside out would hold itself in that shape. It does not meet itself until all of it is
/// out of itself.
void Contacts::find_recovering(std::span<const BodyState> bodies) {
    for (ContactPair& pair : pairs_) {
        if (!pair.is_own()) continue;
        const Index body = pair.points.number();
        const float crushed = crushed_part(bodies[body], *matter_[body]->matter);
        const bool is_tangled = std::ranges::any_of(pair.candidates, &Candidate::is_tangled);
        std::uint8_t& recovers = recovers_[body];
        recovers = crushed > kTooManyCrushed || (recovers && (is_tangled || crushed > 0));
    }
}

} // namespace filigree
