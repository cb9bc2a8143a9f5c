// The points of pairs that may touch.
#include "filigree/core/parallel_for.h"
#include "filigree/physics/contact/ahead.h"
#include "filigree/physics/contact/cell_boxes.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace filigree {

namespace {

constexpr std::size_t kSearchGrain = 512, kBodiesSearchGrain = 8, kPairSearchGrain = 8;
constexpr float kOwnReach = 0.3f;       ///< spacings that a body's parts may go beside each other between two searches
constexpr float kFoldReach = 0.1f;      ///< spacings that points may go until the next search for folds
constexpr float kOutsideOfRigid = 0.5f; ///< spacings outside of a rigid body's cells where points may touch

/// Where corners will be in so many seconds.
Vectors positions_in(const BodyState& body, float seconds) {
    Vectors positions = body.corner_positions();
    const auto move = [&](std::vector<float>& x, const std::vector<float>& v) {
        for (std::size_t i = 0; i < x.size(); ++i) x[i] += seconds * v[i];
    };
    move(positions.x, body.corner_velocities().x);
    move(positions.y, body.corner_velocities().y);
    move(positions.z, body.corner_velocities().z);
    return positions;
}

std::vector<Vec3f> surface_places(const BodyState& body, const RunContext& context) {
    const Embedding& points = body.surface;
    std::vector<Vec3f> places(points.size());
    if (body.rigid) {
        const Mat3f turn = body.rigid->turn.toRotationMatrix().cast<float>();
        const Vec3f rest = body.rigid->rest_centre.cast<float>(), now = body.rigid->centre.cast<float>();
        for (std::size_t s = 0; s < places.size(); ++s) places[s] = now + turn * (points.rest[s] - rest);
        return places;
    }
    parallel_for(context, places.size(), kSearchGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t s = begin; s < end; ++s) places[s] = embedded_point(points, s, body.positions);
    });
    return places;
}

/// A place in the matter beside a surface point.
Vec3d inside_of(const BodyState& body, Index point) {
    const Embedding& surface = body.surface;
    Vec3d sum = Vec3d::Zero();
    for (Index k = surface.offsets[point]; k < surface.offsets[point + 1]; ++k)
        sum += body.positions[surface.particles[k]].cast<double>();
    return sum / double(surface.offsets[point + 1] - surface.offsets[point]);
}

/// Where a point that comes near an obstacle stood free at last: where it is, or in the matter beside it. A wall stands
/// between both where the point went through, but also where that matter, which may lie outside of the body, is behind
/// the wall: the body's middle tells. clear: m around the place without a wall.
Vec3d free_place(const ObstacleShape& shape, const Vec3d& place, double clear, const Vec3d& inside,
                 const Vec3d& middle) {
    if ((place - inside).norm() < clear) return place;
    const bool is_behind = shape.is_between(inside, place) && shape.is_between(middle, place);
    return is_behind ? inside : place;
}

constexpr double kMostEdgeParts = 4096; // of an edge

Index parts_of(const ObstacleShape::Edge& edge, double spacing) {
    return Index(std::clamp(std::ceil((edge.to - edge.from).norm() / spacing), 1.0, kMostEdgeParts));
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

/// Whether an edge sticks out to the side that a body lies on: close to it, towards the body, the edge itself is the
/// closest of the obstacle. The edges of a room stick out to nobody in it.
bool sticks_out(const ObstacleShape& shape, const Vec3d& point, const Vec3d& body_centre, double spacing) {
    constexpr double kClose = 0.05, kItself = 0.9;
    const double close = kClose * spacing;
    return shape.clearance(point + close * (body_centre - point).normalized(), close) > kItself * close;
}

} // namespace

/// What several pairs of one search ask of bodies, worked out once for each.
class Contacts::Surroundings {
public:
    Surroundings(const Contacts& contacts, std::span<const BodyState> bodies)
        : contacts_(contacts), bodies_(bodies), extents_(bodies.size()), points_(bodies.size()), cells_(bodies.size()) {
    }
    void find_extent(Index body) {
        extents_[body] = contacts_.extent(bodies_[body], body);
        if (is_rigid(body)) find_cells(body);
    }
    void find_points(Index body, const RunContext& context) { points_[body] = surface_places(bodies_[body], context); }
    void find_cells(Index body) {
        const float reach =
            (Ahead::kMostReach + (is_rigid(body) ? kOutsideOfRigid : 0)) * float(bodies_[body].body->spacing());
        if (!cells_[body]) cells_[body].emplace(matter(body), bodies_[body].corner_positions(), reach);
    }

    const BodyState& body(Index body) const { return bodies_[body]; }
    const Box& extent(Index body) const { return extents_[body]; }            ///< after find_extent
    std::span<const Vec3f> points(Index body) const { return points_[body]; } ///< after find_points
    const CellBoxes& cells(Index body) const { return *cells_[body]; }        ///< after find_cells
    /// m: how far outside of a body's cells points may touch it.
    float outside(Index body) const {
        return (is_rigid(body) ? kOutsideOfRigid : MatterCollider::kOutside) * float(bodies_[body].body->spacing());
    }
    /// m, after find_extent of both: points of a body are no nearer to another. Looks no closer where that is `enough`.
    double gap(Index body, Index other, double enough) const {
        const Box &a = extent(body), &b = extent(other);
        const double gap = (a.min - b.max).cwiseMax(b.min - a.max).cwiseMax(0).norm();
        if (gap > enough || !is_rigid(other)) return gap;
        return std::max(gap, double(cells(other).gap_of_rigid(turned_box(a))));
    }

private:
    const Matter& matter(Index body) const { return *contacts_.matter_[body]->matter; }
    bool is_rigid(Index body) const { return contacts_.matter_[body]->matter && matter(body).is_rigid(); }

    const Contacts& contacts_;
    std::span<const BodyState> bodies_;
    std::vector<Box> extents_;
    std::vector<std::vector<Vec3f>> points_;
    std::vector<std::optional<CellBoxes>> cells_;
};

/// A pair's candidates anew, in place of those there were; its clock starts when this ends. Points are asked for and
/// added in ascending order.
class Contacts::Merge {
public:
    explicit Merge(ContactPair& pair)
        : pair_(pair), old_(std::move(pair.candidates)), old_clear_(std::move(pair.clear_until)) {
        pair_.candidates.clear();
        pair_.clear_until.clear();
    }
    Merge(const Merge&) = delete;
    Merge& operator=(const Merge&) = delete;
    ~Merge() {
        pair_.pad();
        pair_.travelled = pair_.displacement = 0;
    }
    /// What was found of a point before; null: nothing.
    const Candidate* old(Index point) {
        while (next_ < old_.size() && old_[next_].point < point) ++next_;
        return next_ < old_.size() && old_[next_].point == point ? &old_[next_] : nullptr;
    }
    bool had_any() const { return !old_.empty(); }
    /// m that the pair may still go until the point that was asked for last may touch.
    float still_clear() const { return old_clear_[next_] - pair_.travelled; }
    void add(const Candidate& candidate, float clear) {
        pair_.candidates.push_back(candidate);
        pair_.clear_until.push_back(clear);
    }

private:
    ContactPair& pair_;
    const std::vector<Candidate> old_;
    const std::vector<float> old_clear_;
    std::size_t next_ = 0;
};

/// Finds the candidates of pairs anew.
void Contacts::find_candidates(std::span<const Index> due, std::span<const BodyState> bodies, const Ahead& ahead,
                               const ObstaclePoses& poses, const RunContext& context) {
    Surroundings around(*this, bodies);
    std::vector<Index> near; // pairs of two things
    std::vector<std::uint8_t> has_extent(bodies.size(), 0), has_points = has_extent, has_cells = has_extent;
    const auto ask = [](std::vector<std::uint8_t>& of, ColliderId id) {
        if (!id.is_obstacle()) of[id.number()] = 1;
    };
    const auto each_body = [&](const auto& visit) {
        parallel_for(context, bodies.size(), kBodiesSearchGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t b = begin; b < end; ++b) visit(Index(b));
        });
    };
    for (const Index i : due) {
        ContactPair& pair = pairs_[i];
        pair.since = 0;
        if (pair.is_own()) {
            find_own(pair, bodies[pair.points.number()], ahead.frame, context);
            continue;
        }
        ask(has_extent, pair.points);
        ask(has_extent, pair.touched);
    }
    each_body([&](Index b) {
        if (has_extent[b]) around.find_extent(b);
    });
    for (const Index i : due) {
        ContactPair& pair = pairs_[i];
        if (pair.is_own() || !begin_pair(pair, around, ahead, poses)) continue;
        near.push_back(i);
        ask(has_points, pair.points);
        ask(has_cells, pair.touched);
    }
    each_body([&](Index b) {
        if (has_points[b]) around.find_points(b, context);
        if (has_cells[b]) around.find_cells(b);
    });
    parallel_for(context, near.size(), kPairSearchGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
            ContactPair& pair = pairs_[near[k]];
            if (pair.is_of_edges())
                find_at_edges(pair, around, poses);
            else if (!pair.touched.is_obstacle())
                find_in_matter(pair, around, context);
            else if (pair.is_traced)
                find_traced(pair, around, poses, context);
            else
                find_below(pair, around, poses, context);
        }
    });
}

/// False: both are so far from each other that no points need be looked for, and the pair is left until they may.
bool Contacts::begin_pair(ContactPair& pair, const Surroundings& around, const Ahead& ahead,
                          const ObstaclePoses& poses) const {
    pair.reach = ahead.reach(pair);
    float gap = 0;
    if (pair.is_of_bodies()) {
        const Index body = pair.points.number(), other = pair.touched.number();
        const float outside = around.outside(other);
        gap = float(around.gap(body, other, double(pair.reach + outside))) - outside;
    } else {
        const Index body = pair.body(), obstacle = pair.obstacle();
        gap = float(shapes_[obstacle].gap(around.extent(body), poses.at(obstacle)));
        gap -= pair.is_of_edges() ? around.outside(body) : margin_of(pair);
    }
    if (!(gap > pair.reach)) return true;
    pair.clear();
    pair.reach = gap;
    return false;
}

/// Of a body and itself: where everything will be halfway to the next search.
void Contacts::find_own(ContactPair& pair, const BodyState& body, float frame, const RunContext& context) const {
    const float reach = kOwnReach * pair.spacing;
    const float ahead = 0.5f * std::clamp(reach / pair.speed, frame / Ahead::kOwnSearches, frame);
    pair.reach = reach;
    const OwnCells& own = *own_cells_[pair.points.number()];
    const Vectors positions = positions_in(body, ahead);
    const OwnCells::Folds folds = own.folds(positions, kFoldReach * pair.spacing, context);
    const std::vector<Index> cells = own.find(positions, folds, reach, passing_[pair.points.number()].get(), context);
    Merge merge(pair);
    for (Index s = 0; s < cells.size(); ++s) merge_in_matter(merge, pair, body, s, {cells[s]});
}

/// Those that touch stay; their friction goes on.
void Contacts::merge_in_matter(Merge& merge, const ContactPair& pair, const BodyState& body, Index point,
                               const CellBoxes::Near& found) {
    const Candidate* old = merge.old(point);
    if (old && (old->grasp.holds || old->is_tangled))
        merge.add(*old, merge.still_clear());
    else if (found.cell != kNoIndex && !body.is_hidden(point))
        merge.add({.point = point, .place = {found.cell}, .grasp = {}, .anchor = {}}, pair.safe_way(found.gap));
}

void Contacts::find_in_matter(ContactPair& pair, const Surroundings& around, const RunContext& context) const {
    const Index body = pair.points.number(), other = pair.touched.number();
    const float far = pair.reach + around.outside(other);
    const Box& box = around.extent(other);
    const Vec3f low = box.min.cast<float>().array() - far, high = box.max.cast<float>().array() + far;
    const std::span<const Vec3f> points = around.points(body);
    const CellBoxes& cells = around.cells(other);
    std::vector<CellBoxes::Near> found(points.size());
    parallel_for(context, points.size(), kSearchGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t s = begin; s < end; ++s) {
            const Vec3f& p = points[s];
            const bool is_near = p.x() >= low.x() && p.x() <= high.x() && p.y() >= low.y() && p.y() <= high.y() &&
                                 p.z() >= low.z() && p.z() <= high.z();
            if (is_near) found[s] = cells.find(p);
        }
    });
    Merge merge(pair);
    for (Index s = 0; s < points.size(); ++s) merge_in_matter(merge, pair, around.body(body), s, found[s]);
}

void Contacts::find_at_edges(ContactPair& pair, const Surroundings& around, const ObstaclePoses& poses) const {
    const Index obstacle = pair.points.number(), body = pair.touched.number();
    const ObstacleShape& shape = shapes_[obstacle];
    const Eigen::Isometry3d& motion = poses.at(obstacle);
    const Box& box = around.extent(body);
    const Vec3d centre = motion.inverse() * box.centre();
    const double radius = 0.5 * box.diagonal() + double(pair.reach), spacing = double(pair.spacing);
    Merge merge(pair);
    Index first_point = 0; // of the edge
    for (const ObstacleShape::Edge& edge : shape.sharp_edges()) {
        const Index parts = parts_of(edge, spacing);
        const auto [first, last] = parts_within(edge, parts, centre, radius);
        for (Index part = first; part <= last; ++part) {
            const Vec3d own = edge.from + double(part) / double(parts) * (edge.to - edge.from);
            const Candidate* old = merge.old(first_point + part);
            if (old && old->grasp.holds) {
                merge.add(*old, merge.still_clear());
                continue;
            }
            if (!sticks_out(shape, own, centre, spacing)) continue;
            const CellBoxes::Near near = around.cells(body).find((motion * own).cast<float>());
            if (near.cell == kNoIndex) continue;
            merge.add(
                {.point = first_point + part, .place = {near.cell}, .grasp = {}, .anchor = {}, .local_point = own}, 0);
        }
        first_point += parts + 1;
    }
}

/// Of a half-space, or a mesh that has a field alone.
void Contacts::find_below(ContactPair& pair, const Surroundings& around, const ObstaclePoses& poses,
                          const RunContext& context) const {
    const Index body = pair.points.number(), obstacle = pair.touched.number();
    const std::span<const Vec3f> points = around.points(body);
    std::vector<float> distances(points.size());
    parallel_for(context, points.size(), kSearchGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t s = begin; s < end; ++s) distances[s] = poses.distance_to(obstacle, points[s]).distance;
    });
    const float margin = margin_of(pair);
    Merge merge(pair);
    for (Index s = 0; s < points.size(); ++s) {
        if (!(distances[s] < pair.reach + margin) || around.body(body).is_hidden(s)) continue;
        const Candidate* old = merge.old(s);
        const bool holds = old && old->grasp.holds; // what holds is asked
        merge.add(old ? *old : Candidate{.point = s, .place = {}, .grasp = {}, .anchor = {}},
                  holds ? 0 : distances[s] - margin);
    }
}

/// Of what points are followed beside. A point that was followed before goes on; one that may have met something since
/// it was last asked has to be asked again.
void Contacts::find_traced(ContactPair& pair, const Surroundings& around, const ObstaclePoses& poses,
                           const RunContext& context) const {
    const BodyState& body = around.body(pair.points.number());
    const ObstacleShape& shape = shapes_[pair.touched.number()];
    const Eigen::Isometry3d to_own = poses.at(pair.touched.number()).inverse();
    const std::span<const Vec3f> points = around.points(pair.points.number());
    const float margin = margin_of(pair), reach = pair.reach + margin;
    const bool is_new = !std::exchange(pair.knows_side, true);
    std::optional<StartSides> sides;
    if (is_new) sides.emplace(body, shape, poses.at(pair.touched.number()));
    const bool is_across = sides && !sides->all_right();
    if (is_new) pair.clear();
    const Box& box = around.extent(pair.points.number());
    const double all = 0.5 * box.diagonal() + double(reach);
    const Vec3d centre = to_own * box.centre();
    Merge merge(pair);
    if (!is_across && !merge.had_any() && shape.clearance(centre, all) >= all) return;
    std::vector<float> distances(points.size());
    parallel_for(context, points.size(), kSearchGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t s = begin; s < end; ++s)
            distances[s] = float(shape.clearance(to_own * points[s].cast<double>(), double(reach)));
    });
    for (Index s = 0; s < points.size(); ++s) {
        if (body.is_hidden(s)) continue;
        const float distance = distances[s];
        const Vec3d place = to_own * points[s].cast<double>();
        if (const Candidate* old = merge.old(s)) {
            const bool is_clear = merge.still_clear() > 0 && (place - old->local_point).norm() < double(distance);
            const bool is_asked = !old->entry_normal.isZero(0) || old->grasp.holds || !is_clear;
            if (!is_asked && !(distance < reach)) continue;
            Candidate next = *old;
            if (!is_asked) next.local_point = place;
            merge.add(next, is_asked ? 0 : distance - margin);
        } else if (is_across || distance < reach) {
            const Vec3d from = sides ? sides->start_of(s)
                                     : free_place(shape, place, double(distance), to_own * inside_of(body, s), centre);
            Candidate next{.point = s, .place = {}, .grasp = {}, .anchor = {}, .local_point = from};
            if ((place - from).norm() < double(distance))
                next.local_point = place;
            else if (const WallTouch touch = shape.follow(next.local_point, place); touch.depth > 0)
                next.entry_normal = touch.normal.cast<float>();
            const bool is_asked = !next.entry_normal.isZero(0);
            if (is_asked || distance < reach) merge.add(next, is_asked ? 0 : distance - margin);
        }
    }
}

} // namespace filigree
