// Finding which points might be in which cells, and what contacts in matter remember.
#include "filigree/core/parallel_for.h"
#include "filigree/physics/contact/box_sweep.h"
#include "filigree/physics/contact/cell_boxes.h"
#include "filigree/physics/contact/matter_contact.h"
#include "filigree/physics/contact/own_cells.h"
#include "filigree/physics/rigid/rigid_body.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

namespace filigree {

namespace {

constexpr std::size_t kMatterSearchGrain = 512, kBodiesGrain = 8, kSidesGrain = 8, kTravelGrain = 512; // sides
constexpr float kLeastReach = 0.1f; ///< as kMostReach, at least
constexpr float kOwnReach = 0.3f;   ///< the same of a body beside itself ...
constexpr float kOwnSearches = 4;   ///< ... which is searched no more often than this in a frame
constexpr float kFoldReach = 0.1f; ///< spacings that points may go until the next search into matter folded onto theirs
/// Of what another side may still move until it is searched; they share what a search finds out about bodies.
constexpr float kSearchedAlong = 0.5f;
constexpr float kLongestWay = 0.3f;      ///< spacings a substep that one body may go towards another
constexpr float kCrushed = 0.05f;        ///< volume ratio below which a cell counts as crushed
constexpr float kTooManyCrushed = 0.05f; ///< part of a body's cells
constexpr Index kAskedCells = 7;         ///< one of so many is asked

/// N/m^3 in each cell: what the body's own surface has there, per area.
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
    parallel_for(context, places.size(), kMatterSearchGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t s = begin; s < end; ++s) places[s] = embedded_point(points, s, body.positions);
    });
    return places;
}

/// Whether surface points lie outside of the box of the cells: of parts without cells.
bool has_points_outside(const Body& body) {
    Box box;
    for (const auto& at : body.cells.corners)
        box.extend(body.cells.origin + body.cells.spacing * Vec3d(at[0], at[1], at[2]));
    const double slack = 1e-3 * body.spacing();
    return std::ranges::any_of(body.surface.points.rest, [&](const Vec3f& point) {
        const Vec3d p = point.cast<double>();
        return (p.array() < box.min.array() - slack).any() || (p.array() > box.max.array() + slack).any();
    });
}

/// Particles of a lattice that all others lie between, along x, y or z.
std::vector<Index> outermost(const Vectors& rest) {
    std::vector<std::uint8_t> lies_between(rest.size(), 0);
    std::vector<Index> order(rest.size());
    std::iota(order.begin(), order.end(), Index{0});
    for (int axis = 0; axis < 3; ++axis) {
        const auto row = [&](Index i) { return std::pair(rest[i][(axis + 1) % 3], rest[i][(axis + 2) % 3]); };
        const auto is_before = [&](Index i, Index j) { return row(i) == row(j) && rest[i][axis] < rest[j][axis]; };
        std::ranges::sort(order, {}, [&](Index i) { return std::pair(row(i), rest[i][axis]); });
        for (std::size_t k = 1; k + 1 < order.size(); ++k)
            lies_between[order[k]] |= is_before(order[k - 1], order[k]) && is_before(order[k], order[k + 1]);
    }
    std::erase_if(order, [&](Index i) { return lies_between[i] != 0; });
    std::ranges::sort(order);
    return order;
}

} // namespace

MatterContacts::Followed MatterContacts::followed(const BodyState& body) {
    Followed followed;
    if (body.rigid) {
        followed.corners = outermost(body.body->rest);
        return followed;
    }
    followed.has_points_outside = has_points_outside(*body.body);
    const std::size_t count = body.corner_positions().size();
    followed.counts.resize((count + kExtremesPadding - 1) / kExtremesPadding * kExtremesPadding, 0);
    std::fill_n(followed.counts.begin(), count, 1.0f);
    if (body.corners) return followed;
    const std::vector<float>& mass = body.body->mass;
    followed.heaviest = Index(std::ranges::max_element(mass) - mass.begin());
    const std::vector<std::uint8_t> light = light_particles(*body.body);
    for (std::size_t i = 0; i < light.size(); ++i) followed.counts[i] = light[i] ? 0.0f : 1.0f;
    return followed;
}

/// Of particles that are followed: of their values, less `from` unless that is null.
Extremes MatterContacts::extremes(std::size_t body, const Vectors& values, const Vectors* from) const {
    const Followed& followed = *followed_[body];
    const std::vector<Index>& corners = followed.corners;
    if (corners.empty()) return extremes_of(values, from, followed.counts, followed.heaviest);
    const auto value_of = [&](Index i) -> Vec3f { return from ? Vec3f(values[i] - (*from)[i]) : values[i]; };
    Extremes found{value_of(corners[0]), value_of(corners[0])};
    for (const Index i : corners) found = found.with({value_of(i), value_of(i)});
    return found;
}

/// All of a body that may touch.
Box MatterContacts::extent(const BodyState& body, std::size_t number) const {
    if (body.rigid && matter_[number]) {
        const TurnedBox box = CellBoxes(*matter_[number], body.positions, 0).rigid_box();
        const Vec3f half = box.half_axes.cwiseAbs().rowwise().sum();
        return {(box.centre - half).cast<double>(), (box.centre + half).cast<double>()};
    }
    Box box = box_of(body.corner_positions());
    if (followed_[number]->has_points_outside)
        for (std::size_t s = 0; s < body.surface.size(); ++s)
            box.extend(embedded_point(body.surface, s, body.positions).cast<double>());
    return box;
}

void MatterContacts::begin(std::span<const BodyState> bodies) {
    std::map<const Body*, std::shared_ptr<const Matter>> known; // pieces of one kind share theirs
    std::map<const Matter*, std::shared_ptr<const OwnCells>> own_cells;
    std::map<const Body*, std::shared_ptr<const Followed>> known_followed;
    for (const BodyState& state : bodies) {
        std::shared_ptr<const Matter>& matter = known[state.body.get()];
        if (!matter && state.body->field) matter = std::make_shared<Matter>(*state.body);
        matter_.push_back(matter);
        per_area_.push_back(matter ? stiffness_per_area(state) : std::vector<float>());
        std::shared_ptr<const OwnCells>& own = own_cells[matter.get()];
        if (matter && within_bodies_ && !state.rigid && !own) own = std::make_shared<OwnCells>(*matter);
        own_cells_.push_back(own);
        std::shared_ptr<const Followed>& follows = known_followed[state.body.get()];
        if (!follows) follows = std::make_shared<const Followed>(followed(state));
        followed_.push_back(follows);
    }
    speeds_.resize(bodies.size());
    places_.resize(bodies.size());
    shifts_.resize(bodies.size());
    recovers_.assign(bodies.size(), 0);
}

void MatterContacts::begin_anew() {
    sides_until_ = -1;
    way_ = 0;
    for (Side& side : sides_) {
        side.way = side.moved = 0;
        side.until = -1;
        side.since = std::numeric_limits<float>::max();
        for (Pair& pair : side.pairs) pair.clear_until = 0;
    }
}

void MatterContacts::begin_frame(std::span<const BodyState> bodies, const RunContext& context) {
    list_work(bodies); // some may have woken or gone to sleep
    travel(bodies, 0, context);
    for (std::size_t b = 0; b < bodies.size(); ++b)
        if (!bodies[b].is_absent) places_[b] = bodies[b].corner_positions();
    shifts_.assign(bodies.size(), {});
    find_recovering(bodies);
    for (Side& side : sides_) {
        side.way = 0;
        for (Pair& pair : side.pairs) pair.clear_until = 0; // by speeds that may have changed
    }
}

void MatterContacts::end_frame(std::span<const BodyState> bodies, const RunContext& context) {
    find_shifts(bodies, context);
    count_from_here(bodies);
}

void MatterContacts::was_moved(std::size_t body, float way) {
    way_ += way;
    for (Side& side : sides_)
        if (side.body == body || side.other == body) side.way += way;
}

void MatterContacts::travel(std::span<const BodyState> bodies, float dt, const RunContext& context) {
    parallel_for(context, bodies.size(), kBodiesGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t b = begin; b < end; ++b)
            if (!bodies[b].is_absent) speeds_[b] = extremes(b, bodies[b].corner_velocities(), nullptr);
    });
    way_ += dt * relative_speed_of_all([&](std::size_t b) { return !bodies[b].is_absent; });
    parallel_for(context, sides_.size(), kTravelGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
            Side& side = sides_[k];
            side.speed = relative_speed(side.body, side.other);
            side.way += dt * side.speed;
            side.since += dt;
        }
    });
}

/// How far particles are from where they are counted from.
void MatterContacts::find_shifts(std::span<const BodyState> bodies, const RunContext& context) {
    parallel_for(context, bodies.size(), kBodiesGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t b = begin; b < end; ++b)
            if (!bodies[b].is_absent && !bodies[b].sleeps())
                shifts_[b] = extremes(b, bodies[b].corner_positions(), &places_[b]);
    });
}

/// What has moved so far goes into the sides, and shifts are counted from here.
void MatterContacts::count_from_here(std::span<const BodyState> bodies) {
    for (Side& side : sides_) side.moved = moved(side);
    for (std::size_t b = 0; b < bodies.size(); ++b)
        if (!bodies[b].is_absent && !bodies[b].sleeps()) places_[b] = bodies[b].corner_positions();
    shifts_.assign(bodies.size(), {});
}

/// Which bodies are near each other.
void MatterContacts::find_sides(std::span<const BodyState> bodies, double frame, const RunContext& context) {
    std::vector<Box> boxes(bodies.size()); // empty: of bodies that meet nothing
    parallel_for(context, bodies.size(), kBodiesGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t b = begin; b < end; ++b) {
            if (bodies[b].is_absent) continue;
            if (is_finite(bodies[b].positions)) boxes[b] = extent(bodies[b], b); // else the frame is done again
        }
    });
    float spacing = 0, speed = 0;
    std::vector<Index> meeting;
    std::vector<BoxSweep::Bounds> bounds;
    for (Index b = 0; b < bodies.size(); ++b) {
        if (boxes[b].empty()) continue;
        meeting.push_back(b);
        bounds.push_back({boxes[b].min.cast<float>(), boxes[b].max.cast<float>()});
        spacing = std::max(spacing, float(bodies[b].body->spacing()));
        speed = std::max(speed, relative_speed(b, meeting.front()));
    }
    const float reach = std::max(spacing, std::min(speed * float(frame), 2 * spacing));
    way_ = 0;
    sides_until_ = reach;
    std::vector<std::uint64_t> found; // of two bodies
    const auto add = [&](Index body, Index other) { found.push_back(std::uint64_t(body) << 32 | other); };
    const BoxSweep sweep(bounds);
    std::vector<std::uint16_t> room;
    for (std::size_t a = 0; a < meeting.size(); ++a) {
        const Index body = meeting[sweep.order()[a]];
        if (within_bodies_ && matter_[body] && !bodies[body].rigid) add(body, body);
        if (!between_bodies_) continue;
        sweep.each_near(a, reach + spacing, room, [&](std::size_t b) {
            const Index other = meeting[sweep.order()[b]];
            if (other == body || (bodies[body].rigid && bodies[other].rigid)) return; // those are RigidPairs'
            if (matter_[other]) add(body, other);
            if (matter_[body]) add(other, body);
        });
    }
    std::ranges::sort(found);
    std::vector<Side> sides;
    sides.reserve(found.size());
    auto old = sides_.begin();
    for (const std::uint64_t two : found) {
        const auto body = Index(two >> 32), other = Index(two);
        while (old != sides_.end() && std::pair(old->body, old->other) < std::pair(body, other)) ++old;
        if (old != sides_.end() && old->body == body && old->other == other)
            sides.push_back(std::move(*old));
        else
            sides.push_back(make_side(body, other, bodies));
        sides.back().speed = relative_speed(body, other);
    }
    sides_ = std::move(sides);
}

MatterContacts::Side MatterContacts::make_side(Index body, Index other, std::span<const BodyState> bodies) const {
    Side side{.body = body, .other = other, .law = laws_.of(bodies[body].actor, bodies[other].actor), .pairs = {}};
    side.is_rigid = bodies[body].rigid && bodies[other].rigid;
    side.spacing = float(std::min(bodies[body].body->spacing(), bodies[other].body->spacing()));
    return side;
}

/// Pairs of a side anew, and its way counts from here; those that touch stay. find(s): what point s is near.
template <class Find>
void MatterContacts::take_pairs(Side& side, const BodyState& body, std::size_t points, const Find& find) {
    const float margin = side.is_rigid ? margin_of(side) : 0;
    std::vector<Pair> pairs;
    auto old = side.pairs.begin();
    for (Index s = 0; s < points; ++s) {
        const CellBoxes::Near found = find(s);
        if (found.cell == kNoIndex && (old == side.pairs.end() || s < old->point)) continue;
        while (old != side.pairs.end() && old->point < s) ++old;
        if (old != side.pairs.end() && old->point == s && (old->grasp.holds || old->tangled))
            pairs.emplace_back(*old).clear_until -= side.way;
        else if (found.cell != kNoIndex && !body.is_hidden(s))
            pairs.push_back({.point = s,
                             .place = {found.cell},
                             .clear_until = safe_way(side, found.gap - margin),
                             .grasp = {},
                             .anchor = {}});
    }
    side.way = side.moved = 0;
    side.pairs = std::move(pairs);
}

/// A body that sleeps wakes when one that is awake touches it.
bool MatterContacts::wake_touched(std::span<BodyState> bodies) const {
    bool woke = false;
    if (std::ranges::none_of(bodies, &BodyState::sleeps)) return woke;
    for (const Side& side : sides_)
        for (const auto& [sleeper, other] : {std::pair(side.body, side.other), std::pair(side.other, side.body)}) {
            if (bodies[sleeper].is_absent || !bodies[sleeper].sleeps() || bodies[other].sleeps()) continue;
            if (std::ranges::none_of(side.pairs, [](const Pair& pair) { return pair.grasp.holds; })) continue;
            wake(bodies[sleeper]);
            woke = true;
        }
    return woke;
}

/// What several sides of one search ask of bodies, worked out once for each.
class MatterContacts::Surroundings {
public:
    Surroundings(const MatterContacts& contacts, std::span<const BodyState> bodies)
        : contacts_(contacts), bodies_(bodies), extents_(bodies.size()), points_(bodies.size()), cells_(bodies.size()) {
    }
    void find_extent(Index body) {
        extents_[body] = contacts_.extent(bodies_[body], body);
        if (is_rigid(body)) find_cells(body);
    }
    void find_points(Index body, const RunContext& context) { points_[body] = surface_places(bodies_[body], context); }
    void find_cells(Index body) {
        const float reach = (kMostReach + (is_rigid(body) ? kMostMargin : 0)) * float(bodies_[body].body->spacing());
        if (!cells_[body]) cells_[body].emplace(*contacts_.matter_[body], bodies_[body].corner_positions(), reach);
    }

    const Box& extent(Index body) const { return extents_[body]; }            ///< after find_extent
    std::span<const Vec3f> points(Index body) const { return points_[body]; } ///< after find_points
    const CellBoxes& cells(Index body) const { return *cells_[body]; }        ///< after find_cells
    /// m: how far outside of a body's cells points may touch it.
    float outside(Index body) const {
        return (is_rigid(body) ? kMostMargin : kOutside) * float(bodies_[body].body->spacing());
    }
    /// m, after find_extent of both: points of a body are no nearer to another. Looks no closer where that is `enough`.
    double gap(Index body, Index other, double enough) const {
        const Box &a = extent(body), &b = extent(other);
        const double gap = (a.min - b.max).cwiseMax(b.min - a.max).cwiseMax(0).norm();
        if (gap > enough || !is_rigid(other)) return gap;
        if (!is_rigid(body)) return std::max(gap, double(cells(other).gap_of_rigid(turned_box(a))));
        return std::max({gap, double(cells(other).gap_of_rigid(cells(body).rigid_box())),
                         double(cells(body).gap_of_rigid(cells(other).rigid_box()))});
    }

private:
    bool is_rigid(Index body) const { return contacts_.matter_[body] && contacts_.matter_[body]->is_rigid(); }

    const MatterContacts& contacts_;
    std::span<const BodyState> bodies_;
    std::vector<Box> extents_;
    std::vector<std::vector<Vec3f>> points_;
    std::vector<std::optional<CellBoxes>> cells_;
};

/// Of a body and itself: where everything will be halfway to the next search.
void MatterContacts::find_own_pairs(Side& side, const BodyState& body, float frame, const RunContext& context) const {
    const float reach = kOwnReach * side.spacing;
    const float ahead = 0.5f * std::clamp(reach / side.speed, frame / kOwnSearches, frame);
    side.until = reach;
    const OwnCells& own = *own_cells_[side.body];
    const Vectors positions = positions_in(body, ahead);
    const OwnCells::Folds folds = own.folds(positions, kFoldReach * side.spacing, context);
    const std::vector<Index> cells = own.find(positions, folds, reach, context);
    take_pairs(side, body, cells.size(), [&](Index s) { return CellBoxes::Near{cells[s]}; });
}

/// False: the bodies are so far from each other that no points need be looked for, and the side is left until they may.
bool MatterContacts::begin_side(Side& side, const Surroundings& around, float frame) {
    side.until = std::clamp(side.speed * frame, kLeastReach * side.spacing, kMostReach * side.spacing);
    const float outside = around.outside(side.other);
    const auto gap = float(around.gap(side.body, side.other, double(side.until + outside)));
    if (!(gap > side.until + outside)) return true;
    side.pairs.clear();
    side.way = side.moved = 0;
    side.until = gap - outside;
    return false;
}

void MatterContacts::find_other_pairs(Side& side, const Surroundings& around, const BodyState& body,
                                      const RunContext& context) const {
    const float far = side.until + around.outside(side.other);
    const Box& box = around.extent(side.other);
    const Vec3f low = box.min.cast<float>().array() - far, high = box.max.cast<float>().array() + far;
    const std::span<const Vec3f> points = around.points(side.body);
    const CellBoxes& cells = around.cells(side.other);
    std::vector<CellBoxes::Near> found(points.size());
    parallel_for(context, points.size(), kMatterSearchGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t s = begin; s < end; ++s) {
            const Vec3f& p = points[s];
            const bool is_near = p.x() >= low.x() && p.x() <= high.x() && p.y() >= low.y() && p.y() <= high.y() &&
                                 p.z() >= low.z() && p.z() <= high.z();
            if (is_near) found[s] = cells.find(p);
        }
    });
    take_pairs(side, body, points.size(), [&](Index s) { return found[s]; });
}

/// Finds the pairs of sides anew.
void MatterContacts::find_pairs(std::span<const Index> due, std::span<const BodyState> bodies, float frame,
                                const RunContext& context) {
    Surroundings around(*this, bodies);
    std::vector<Index> near; // sides of two bodies
    std::vector<std::uint8_t> has_extent(bodies.size(), 0), has_points = has_extent, has_cells = has_extent;
    const auto each_body = [&](const auto& visit) {
        parallel_for(context, bodies.size(), kBodiesGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t b = begin; b < end; ++b) visit(Index(b));
        });
    };
    for (const Index i : due) {
        Side& side = sides_[i];
        side.since = 0;
        if (side.body == side.other)
            find_own_pairs(side, bodies[side.body], frame, context);
        else
            has_extent[side.body] = has_extent[side.other] = 1;
    }
    each_body([&](Index b) {
        if (has_extent[b]) around.find_extent(b);
    });
    for (const Index i : due) {
        Side& side = sides_[i];
        if (side.body == side.other || !begin_side(side, around, frame)) continue;
        near.push_back(i);
        has_points[side.body] = has_cells[side.other] = 1;
    }
    each_body([&](Index b) {
        if (has_points[b]) around.find_points(b, context);
        if (has_cells[b]) around.find_cells(b);
    });
    parallel_for(context, near.size(), kSidesGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k) {
            Side& side = sides_[near[k]];
            find_other_pairs(side, around, bodies[side.body], context);
        }
    });
}

bool MatterContacts::search(std::span<BodyState> bodies, double frame, const RunContext& context) {
    bool changed = way_ > sides_until_;
    if (changed) find_sides(bodies, frame, context);
    const bool woke = wake_touched(bodies);
    const auto is_due = [&](const Side& side, float moved, float part) {
        if (!(moved > part * side.until) || both_sleep(side, bodies)) return false;
        return side.body != side.other || side.since >= float(frame) / kOwnSearches;
    };
    // What has gone no further there and back is no further away.
    const bool may_be_due =
        std::ranges::any_of(sides_, [&](const Side& side) { return is_due(side, side.moved + side.way, 1); });
    if (may_be_due) find_shifts(bodies, context);
    if (may_be_due && std::ranges::any_of(sides_, [&](const Side& side) { return is_due(side, moved(side), 1); })) {
        changed = true;
        count_from_here(bodies);
        std::vector<Index> due;
        for (Index i = 0; i < sides_.size(); ++i)
            if (is_due(sides_[i], sides_[i].moved, kSearchedAlong)) due.push_back(i);
        find_pairs(due, bodies, float(frame), context);
    }
    if (changed || woke) list_work(bodies);
    return woke;
}

/// What forces are asked for: pairs of which something is awake.
void MatterContacts::list_work(std::span<const BodyState> bodies) {
    work_.clear();
    for (Index i = 0; i < sides_.size(); ++i)
        for (Index p = 0; p < sides_[i].pairs.size() && !both_sleep(sides_[i], bodies); ++p) work_.emplace_back(i, p);
}

double MatterContacts::longest_step() const {
    double longest = std::numeric_limits<double>::infinity();
    for (const Side& side : sides_) {
        if (side.body == side.other || !(side.speed > 0)) continue;
        longest = std::min(longest, double(kLongestWay * side.spacing / side.speed));
    }
    return longest;
}

/// Part of the body's cells that are crushed or inside out, of some.
float MatterContacts::crushed_part(const BodyState& body, const Matter& matter) const {
    const std::size_t cells = body.body->cells.cells.size();
    std::size_t crushed = 0, asked = 0;
    for (Index c = 0; c < cells; c += kAskedCells, ++asked)
        crushed += !(matter.volume_ratio(body.corner_positions(), c) > kCrushed);
    return float(crushed) / float(asked);
}

/// A body that starts crushed or inside out would hold itself in that shape. It does not meet itself until all of it is
/// out of itself.
void MatterContacts::find_recovering(std::span<const BodyState> bodies) {
    for (Side& side : sides_) {
        if (side.body != side.other) continue;
        const float crushed = crushed_part(bodies[side.body], *matter_[side.body]);
        const bool tangled = std::ranges::any_of(side.pairs, &Pair::tangled);
        std::uint8_t& recovers = recovers_[side.body];
        recovers = crushed > kTooManyCrushed || (recovers && (tangled || crushed > 0));
    }
}

MatterContacts::Memory MatterContacts::memory() const {
    Memory memory{way_, sides_until_, {}, {}, recovers_};
    for (const Side& side : sides_) {
        memory.sides.push_back({side.body, side.other, Index(side.pairs.size()), side.moved, side.until, side.since});
        for (const Pair& pair : side.pairs)
            memory.pairs.push_back({pair.point, pair.place.cell, pair.anchor.cell,
                                    Index(pair.grasp.holds) + 2 * Index(pair.grasp.slides) + 4 * Index(pair.tangled),
                                    pair.place.local, pair.anchor.local, pair.entry, pair.rigid_force});
    }
    return memory;
}

bool MatterContacts::is_sound(const Memory& memory, std::span<const BodyState> bodies) const {
    if (memory.recovers.size() != bodies.size() || !std::isfinite(memory.way) || !std::isfinite(memory.until))
        return false;
    std::size_t from = 0;
    const SideMemory* before = nullptr;
    for (const SideMemory& side : memory.sides) {
        if (side.body >= bodies.size() || side.other >= bodies.size() || !matter_[side.other]) return false;
        const bool is_own = side.body == side.other;
        if (is_own ? !own_cells_[side.body] : !between_bodies_) return false; // nothing here would search for these
        if (!std::isfinite(side.moved) || !std::isfinite(side.until) || !(side.since >= 0)) return false;
        if (before && std::pair(before->body, before->other) >= std::pair(side.body, side.other)) return false;
        before = &side;
        if (side.pairs > memory.pairs.size() - from) return false;
        const std::size_t points = bodies[side.body].surface.size(),
                          cells = bodies[side.other].body->cells.cells.size();
        for (Index k = 0; k < side.pairs; ++k, ++from) {
            const PairMemory& pair = memory.pairs[from];
            if (pair.point >= points || pair.cell >= cells) return false;
            const bool is_anchored = (pair.flags & 1) && !(bodies[side.body].rigid && bodies[side.other].rigid);
            if (is_anchored && pair.anchor_cell >= cells) return false;
            if (!pair.local.allFinite() || !pair.anchor_local.allFinite() || !pair.entry.allFinite() ||
                !pair.rigid_force.allFinite())
                return false;
        }
    }
    return from == memory.pairs.size();
}

void MatterContacts::set_memory(const Memory& memory, std::span<const BodyState> bodies) {
    way_ = memory.way;
    sides_until_ = memory.until;
    recovers_ = memory.recovers;
    sides_.clear();
    auto from = memory.pairs.begin();
    for (const SideMemory& saved : memory.sides) {
        Side& side = sides_.emplace_back(make_side(saved.body, saved.other, bodies));
        side.moved = saved.moved;
        side.until = saved.until;
        side.since = saved.since;
        for (Index k = 0; k < saved.pairs; ++k, ++from)
            side.pairs.push_back({.point = from->point,
                                  .place = {from->cell, from->local},
                                  .grasp = {(from->flags & 1) != 0, (from->flags & 2) != 0},
                                  .anchor = {from->anchor_cell, from->anchor_local},
                                  .entry = from->entry,
                                  .tangled = (from->flags & 4) != 0,
                                  .rigid_force = from->rigid_force});
    }
    list_work(bodies);
}

} // namespace filigree
