#include "filigree/physics/rigid/rigid_pairs.h"

#include "filigree/core/parallel_for.h"
#include "filigree/physics/contact/box_sweep.h"
#include "filigree/physics/rigid/rigid_body.h"

#include <limits>

namespace filigree {

namespace {

constexpr std::size_t kPlacedGrain = 32, kPairsGrain = 16;
constexpr float kAlmostTouching = 0.02f; ///< spacings outside at which points take part at rest
constexpr float kFarthestWay = 1;        ///< spacings that two bodies near each other may go in a substep
constexpr float kMostGained = 0.25f;     ///< spacings that points are looked for further away beside a blow
/// Spacings that points are looked for further outside, so that they serve for more than one substep.
constexpr float kLeastFurther = 0.04f, kMostFurther = 0.2f;
constexpr float kSameNormal = 0.9999f, kLeaning = -0.1f; ///< cosines, of flatten
/// Spacings: that a point may be taken further out or in; how far below the plane matter has to be within how much
/// beside the point; and what counts as level with the plane.
constexpr float kFlat = 0.04f, kDeepened = 0.02f, kBelow = 0.1f, kBesideEdge = 0.02f, kLevel = 0.02f;
constexpr float kMayGain = 1.2f; ///< what comes may become so much faster within a substep
constexpr float kAcross = 0.05f; ///< spacings: nearer points take part whether they come nearer or not

bool is_of_other(Index number) { return (number & 1) != 0; }

} // namespace

/// From the axes of one body at rest to those of another.
class RigidPairs::AxesMap {
public:
    AxesMap(const Placed& from, const Placed& to) {
        turn_ = to.turn.transpose() * from.turn;
        const Vec3f between = (from.exact_centre - to.exact_centre).cast<float>();
        shift_ = to.rest_centre + to.turn.transpose() * between - turn_ * from.rest_centre;
    }
    explicit AxesMap(const std::array<float, 12>& numbers)
        : turn_(Eigen::Map<const Mat3f>(numbers.data())), shift_(Eigen::Map<const Vec3f>(numbers.data() + 9)) {}

    std::array<float, 12> numbers() const {
        std::array<float, 12> numbers;
        std::copy_n(turn_.data(), 9, numbers.begin());
        std::copy_n(shift_.data(), 3, numbers.begin() + 9);
        return numbers;
    }
    Vec3f operator()(const Vec3f& point) const { return turn_ * point + shift_; }
    const Mat3f& turn() const { return turn_; }
    const Vec3f& shift() const { return shift_; }
    Vec3f back(const Vec3f& point) const { return turn_.transpose() * (point - shift_); }
    /// m, at most, that a point 1 m from a centre goes beside that by the turn from another map to this.
    float turned(const AxesMap& other) const { return std::sqrt(0.5f) * (turn_ - other.turn_).norm(); }

private:
    Mat3f turn_;
    Vec3f shift_;
};

void RigidPairs::find_shapes(std::span<const BodyState> bodies) {
    shapes_.resize(bodies.size());
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        const Body* body = bodies[b].body.get();
        if (shapes_[b] && &shapes_[b]->body() == body) continue;
        if (!bodies[b].rigid) continue;
        std::shared_ptr<const RigidShape>& shape = known_shapes_[body];
        if (!shape) shape = std::make_shared<const RigidShape>(*body);
        shapes_[b] = shape;
    }
}

void RigidPairs::remove_body(std::span<const BodyState> bodies, std::size_t body) {
    std::erase_if(pairs_, [&](const Pair& pair) { return pair.body == body || pair.other == body; });
    if (body < shapes_.size()) shapes_[body] = nullptr;
    const auto is_of_kind = [&](const BodyState& other) { return other.body == bodies[body].body; };
    if (std::ranges::count_if(bodies, is_of_kind) == 1) known_shapes_.erase(bodies[body].body.get());
}

void RigidPairs::place(std::span<const BodyState> bodies, const RunContext& context) {
    placed_.resize(bodies.size());
    parallel_for(context, bodies.size(), kPlacedGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t b = begin; b < end; ++b) {
            if (!meets(bodies[b])) continue;
            const RigidPose& pose = *bodies[b].rigid;
            const RigidShape& shape = *shapes_[b];
            const Mat3d turn = pose.turn.toRotationMatrix();
            Placed& placed = placed_[b];
            placed.turn = turn.cast<float>();
            placed.exact_centre = pose.centre;
            placed.centre = pose.centre.cast<float>();
            placed.rest_centre = pose.rest_centre.cast<float>();
            placed.velocity = pose.velocity.cast<float>();
            placed.spin = (turn * (pose.inverse_inertia * (turn.transpose() * pose.angular))).cast<float>();
            const Vec3f from_centre = placed.turn * (shape.centre() - placed.rest_centre);
            placed.box_centre = placed.centre + from_centre;
            placed.half_axes = placed.turn * shape.half().asDiagonal();
            placed.turning = placed.spin.norm() * (from_centre.norm() + shape.half().norm());
        }
    });
}

/// Pairs of bodies that may come near each other, ascending.
std::vector<std::uint64_t> RigidPairs::near_bodies(std::span<const BodyState> bodies, float longest) const {
    std::vector<Index> meeting;
    std::vector<BoxSweep::Bounds> bounds;
    for (Index b = 0; b < bodies.size(); ++b) {
        if (!meets(bodies[b])) continue;
        const Placed& placed = placed_[b];
        const float around = kAlmostTouching * float(bodies[b].body->spacing()) +
                             longest * (kMayGain * (placed.velocity.norm() + placed.turning) + longest * gravity_);
        const Vec3f half = placed.half_axes.cwiseAbs().rowwise().sum().array() + around;
        if (!(placed.box_centre + half).allFinite()) continue; // the frame is done again
        meeting.push_back(b);
        bounds.push_back({placed.box_centre - half, placed.box_centre + half});
    }
    std::vector<std::uint64_t> found;
    if (meeting.empty()) return found;
    const BoxSweep sweep(bounds);
    std::vector<std::uint16_t> room;
    for (std::size_t a = 0; a < meeting.size(); ++a) {
        const Index body = meeting[sweep.order()[a]];
        sweep.each_near(a, 0, room, [&](std::size_t at) {
            const Index other = meeting[sweep.order()[at]];
            if (other == body || !(shapes_[body]->has_field() || shapes_[other]->has_field())) return;
            found.push_back(std::uint64_t(std::min(body, other)) << 32 | std::max(body, other));
        });
    }
    std::ranges::sort(found);
    return found;
}

/// m: two bodies are no nearer to each other; by the boxes about their own axes.
float RigidPairs::gap(Index body, Index other) const {
    const Placed &a = placed_[body], &b = placed_[other];
    const Vec3f way = a.box_centre - b.box_centre;
    const auto along_axes_of = [&](const Placed& one, const RigidShape& shape, const Placed& two) {
        const Vec3f reach = (one.turn.transpose() * two.half_axes).cwiseAbs().rowwise().sum() + shape.half();
        return ((one.turn.transpose() * way).cwiseAbs() - reach).cwiseMax(0).norm();
    };
    return std::max(along_axes_of(a, *shapes_[body], b), along_axes_of(b, *shapes_[other], a));
}

/// How long a substep may be, and how far apart points count in it. What is struck by one body may go on towards
/// another as fast.
void RigidPairs::find_margins(std::span<const BodyState> bodies) {
    std::vector<float> gaps(pairs_.size()), struck(bodies.size(), 0);
    for (std::size_t k = 0; k < pairs_.size(); ++k) {
        Pair& pair = pairs_[k];
        const Placed &a = placed_[pair.body], &b = placed_[pair.other];
        pair.speed = (a.velocity - b.velocity).norm() + a.turning + b.turning;
        if (bodies[pair.body].sleeps() && bodies[pair.other].sleeps()) continue;
        gaps[k] = gap(pair.body, pair.other);
        if (!(gaps[k] < float(step_) * pair.speed)) continue;
        const float way = std::max(gaps[k], kFarthestWay * spacing_of(bodies, pair));
        step_ = std::min(step_, double(way / pair.speed));
        for (const Index body : {pair.body, pair.other}) struck[body] = std::max(struck[body], pair.speed);
    }
    const auto step = float(step_);
    for (std::size_t k = 0; k < pairs_.size(); ++k) {
        Pair& pair = pairs_[k];
        const float spacing = spacing_of(bodies, pair), gained = step * std::max(struck[pair.body], struck[pair.other]);
        pair.margin = kAlmostTouching * spacing + step * step * gravity_ +
                      kMayGain * std::max(step * pair.speed, std::min(gained, kMostGained * spacing));
        pair.is_apart = gaps[k] > pair.margin;
    }
}

bool RigidPairs::search(std::span<BodyState> bodies, double longest, const RunContext& context) {
    step_ = longest;
    bool woke = false;
    if (!between_bodies_) return woke;
    for (const Pair& pair : pairs_) {
        const bool sleeps = bodies[pair.body].sleeps();
        if (sleeps == bodies[pair.other].sleeps() || !holds(pair)) continue;
        BodyState& sleeper = bodies[sleeps ? pair.body : pair.other];
        if (sleeper.is_absent) continue;
        wake(sleeper);
        woke = true;
    }
    const bool any = std::ranges::any_of(bodies, [&](const BodyState& body) { return meets(body) && !body.sleeps(); });
    if (!any) return woke;
    find_shapes(bodies);
    place(bodies, context);
    std::vector<Pair> pairs;
    auto old = pairs_.begin();
    for (const std::uint64_t two : near_bodies(bodies, float(longest))) {
        const auto body = Index(two >> 32), other = Index(two);
        while (old != pairs_.end() && std::pair(old->body, old->other) < std::pair(body, other)) ++old;
        if (old != pairs_.end() && old->body == body && old->other == other)
            pairs.push_back(std::move(*old));
        else
            static_cast<PairMemory&>(pairs.emplace_back()) = {.body = body, .other = other};
    }
    pairs_ = std::move(pairs);
    find_margins(bodies);
    return woke;
}

/// Whether a point that comes nearer will touch before the substep ends; `surface` is then as where it does, but for
/// the distance until there. What passes by a corner is not pushed.
bool RigidPairs::meets_on_its_way(const RigidShape& shape, const Vec3f& at, const Vec3f& velocity,
                                  DistanceField::Sample& surface) const {
    if (surface.distance < kAcross * float(shape.body().spacing())) return true;
    const Vec3f way = float(step_) * velocity;
    if (-way.dot(surface.normal) < surface.distance) return true; // not at this speed; it may be pushed
    const float part = shape.first_touch(at, way);
    if (!(part <= 1)) return false;
    const Vec3f normal = shape.surface(at + part * way).normal;
    const float distance = -part * way.dot(normal);
    if (distance > 0) surface = {distance, normal};
    return true;
}

RigidPairs::AxesMap RigidPairs::to_axes(Index body, Index other) const { return {placed_[body], placed_[other]}; }

/// m: no point of either body has gone further beside the other since points were found.
float RigidPairs::moved(const Pair& pair, const AxesMap& map) const {
    const AxesMap before(pair.beside);
    const RigidShape &a = *shapes_[pair.body], &b = *shapes_[pair.other];
    const float turned = map.turned(before);
    return std::max(turned * a.half().norm() + (map(a.centre()) - before(a.centre())).norm(),
                    turned * b.half().norm() + (map.back(b.centre()) - before.back(b.centre())).norm());
}

/// Points of one body in the field of the other.
void RigidPairs::add_near_points(const Pair& pair, bool of_other, const AxesMap& map, std::span<const BodyState> bodies,
                                 Candidates& found) const {
    const Index body = of_other ? pair.other : pair.body, other = of_other ? pair.body : pair.other;
    const RigidShape &points = *shapes_[body], &matter = *shapes_[other];
    if (!matter.has_field()) return;
    const Placed &a = placed_[body], &b = placed_[other];
    points.each_near(matter, map, pair.looked, [&](Index s, const Vec3f& rest, const Vec3f& at) {
        if (bodies[body].is_hidden(s)) return;
        const Index number = 2 * s + (of_other ? 1 : 0);
        const auto known = std::ranges::find(pair.points, number, &Point::number);
        const bool is_known = known != pair.points.end();
        DistanceField::Sample surface = matter.surface(at, is_known ? known->entry : Vec3f(Vec3f::Zero()));
        const Vec3f arm = a.turn * (rest - a.rest_centre), place = a.centre + arm;
        const Vec3f velocity = a.velocity + a.spin.cross(arm) - b.velocity - b.spin.cross(place - b.centre);
        if (!meets_on_its_way(matter, at, b.turn.transpose() * velocity, surface)) {
            found.is_passing = true;
            return;
        }
        const Vec3f normal = b.turn * surface.normal;
        const float comes = std::max(0.0f, -velocity.dot(normal));
        found.points.push_back({.place = place,
                                .normal = of_other ? -normal : normal,
                                .separation = surface.distance - float(step_) * comes});
        found.memory.push_back({.number = number, .separation = surface.distance, .at = at, .normal = surface.normal});
        if (is_known) found.points.back().force = known->force;
        if (surface.distance < 0) found.memory.back().entry = surface.normal;
    });
}

/// A field's normals lean outwards at its body's edges, so that bodies of one size would push each other aside. What
/// touches as the surface that most others touch goes on does so along its normal; what lies level with it beside an
/// edge touches nothing, or nothing could slide. The two bodies' surfaces there are taken as planes.
void RigidPairs::flatten(const Pair& pair, float spacing, Candidates& found) const {
    Vec3f all = Vec3f::Zero();
    for (const ManifoldPoint& point : found.points) all += point.normal;
    std::size_t best = 0;
    for (std::size_t k = 1; k < found.points.size(); ++k)
        if (found.points[k].normal.dot(all) > found.points[best].normal.dot(all)) best = k;
    if (found.points.empty()) return;
    const Vec3f normal = found.points[best].normal;
    const float height = found.points[best].place.dot(normal), between = found.memory[best].separation;
    const bool is_of_first = !is_of_other(found.memory[best].number);
    const float first = is_of_first ? height : height + between, other = is_of_first ? height - between : height;
    std::size_t kept = 0;
    for (std::size_t k = 0; k < found.points.size(); ++k) {
        ManifoldPoint point = found.points[k];
        Point memory = found.memory[k];
        const float alike = point.normal.dot(normal), at = point.place.dot(normal);
        if (alike < kSameNormal && alike > kLeaning) {
            const bool of_other = is_of_other(memory.number);
            const float separation = of_other ? first - at : at - other, further = separation - memory.separation;
            const Vec3f rest_normal = of_other ? Vec3f(-(placed_[pair.body].turn.transpose() * normal))
                                               : Vec3f(placed_[pair.other].turn.transpose() * normal);
            const RigidShape& matter = *shapes_[of_other ? pair.body : pair.other];
            const Vec3f below = memory.at - (separation + kBelow * spacing) * rest_normal;
            const bool is_beside = !(matter.distance(below) < kBesideEdge * spacing);
            if (is_beside && std::abs(separation) < kLevel * spacing) continue;
            if (!is_beside && further > -kDeepened * spacing && further < kFlat * spacing) {
                point.separation += further;
                point.normal = normal;
                memory.separation = separation;
                memory.normal = rest_normal;
                memory.entry = separation < 0 ? memory.normal : Vec3f(Vec3f::Zero());
            }
        }
        found.points[kept] = point;
        found.memory[kept++] = memory;
    }
    found.points.resize(kept);
    found.memory.resize(kept);
}

/// Leaves the points that are solved, and those whose entry is remembered.
void RigidPairs::find_points(Pair& pair, std::span<const BodyState> bodies, Candidates& found) const {
    found.points.clear();
    found.memory.clear();
    found.is_passing = false;
    const AxesMap map = to_axes(pair.body, pair.other), back = to_axes(pair.other, pair.body);
    if (!(pair.margin + moved(pair, map) <= pair.looked)) {
        const float spacing = spacing_of(bodies, pair);
        pair.looked =
            pair.margin + std::clamp(float(step_) * pair.speed, kLeastFurther * spacing, kMostFurther * spacing);
        pair.beside = map.numbers();
        add_near_points(pair, false, map, bodies, found);
        add_near_points(pair, true, back, bodies, found);
        flatten(pair, spacing, found);
        reduce_manifold(found.points, kManifoldScale * spacing);
        pair.points.clear();
        for (std::size_t k = 0; k < found.points.size(); ++k) {
            Point& point = found.memory[k];
            point.force = found.points[k].force;
            point.is_kept = found.points[k].is_kept;
            if (point.is_kept || !point.entry.isZero(0)) pair.points.push_back(point);
        }
        if (found.is_passing) pair.looked = -1;
    }
    follow_points(pair, map, back);
}

/// How far the points are outside now.
void RigidPairs::follow_points(Pair& pair, const AxesMap& map, const AxesMap& back) const {
    pair.separations.clear();
    for (const Point& point : pair.points) {
        const bool of_other = is_of_other(point.number);
        const RigidShape& shape = *shapes_[of_other ? pair.other : pair.body];
        const Vec3f& rest = shape.body().surface.points.rest[point.number / 2];
        const Vec3f at = of_other ? back(rest) : map(rest);
        pair.separations.push_back(point.separation + (at - point.at).dot(point.normal));
    }
}

Vec3f RigidPairs::world_place(const Pair& pair, const Point& point) const {
    const Index owner = is_of_other(point.number) ? pair.other : pair.body;
    const Placed& placed = placed_[owner];
    return placed.centre +
           placed.turn * (shapes_[owner]->body().surface.points.rest[point.number / 2] - placed.rest_centre);
}

/// From the second body to the first.
Vec3f RigidPairs::world_normal(const Pair& pair, const Point& point) const {
    if (is_of_other(point.number)) return -(placed_[pair.body].turn * point.normal);
    return placed_[pair.other].turn * point.normal;
}

RigidPairs::Report RigidPairs::add_points(std::span<const BodyState> bodies, RigidContacts& contacts,
                                          const RunContext& context) {
    Report report;
    const auto both_sleep = [&](const Pair& pair) { return bodies[pair.body].sleeps() && bodies[pair.other].sleeps(); };
    if (found_.size() < pairs_.size()) found_.resize(pairs_.size());
    parallel_for(context, pairs_.size(), kPairsGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t k = begin; k < end; ++k)
            if (!both_sleep(pairs_[k]) && !pairs_[k].is_apart) find_points(pairs_[k], bodies, found_[k]);
    });
    for (Pair& pair : pairs_) {
        if (both_sleep(pair)) continue;
        if (pair.is_apart) {
            pair.points.clear();
            pair.looked = -1;
        }
        for (std::size_t k = 0; k < pair.points.size(); ++k) {
            Point& point = pair.points[k];
            const float separation = pair.separations[k];
            report.contacts += separation < 0;
            report.deepest = std::max(report.deepest, -separation);
            if (!point.is_kept || !(separation < pair.margin)) {
                point.force.setZero();
                continue;
            }
            const PairContact law = laws_.of(bodies[pair.body].actor, bodies[pair.other].actor);
            contacts.add({.body = pair.body,
                          .other = pair.other,
                          .place = world_place(pair, point),
                          .normal = world_normal(pair, point),
                          .separation = separation,
                          .friction = float(law.friction),
                          .restitution = float(law.restitution),
                          .force = &point.force});
        }
    }
    return report;
}

RigidPairs::Memory RigidPairs::memory() const {
    Memory memory;
    for (const Pair& pair : pairs_) {
        memory.pairs.push_back(pair);
        memory.pairs.back().points = Index(pair.points.size());
        memory.points.insert(memory.points.end(), pair.points.begin(), pair.points.end());
    }
    return memory;
}

bool RigidPairs::set_memory(const Memory& memory, std::span<const BodyState> bodies) {
    std::vector<Pair> pairs;
    std::size_t from = 0;
    for (const PairMemory& saved : memory.pairs) {
        if (saved.body >= saved.other || saved.other >= bodies.size()) return false;
        if (!meets(bodies[saved.body]) || !meets(bodies[saved.other])) return false;
        if (!pairs.empty() && std::pair(pairs.back().body, pairs.back().other) >= std::pair(saved.body, saved.other))
            return false;
        if (saved.points > memory.points.size() - from || !std::isfinite(saved.looked)) return false;
        Pair& pair = pairs.emplace_back();
        static_cast<PairMemory&>(pair) = saved;
        for (Index k = 0; k < saved.points; ++k, ++from) {
            const Point& point = memory.points[from];
            const Index owner = is_of_other(point.number) ? pair.other : pair.body;
            const bool is_sound = point.number / 2 < bodies[owner].surface.size() && point.force.allFinite() &&
                                  point.entry.allFinite() && point.at.allFinite() && point.normal.allFinite() &&
                                  std::isfinite(point.separation);
            if (!is_sound) return false;
            pair.points.push_back(point);
        }
    }
    if (from != memory.points.size()) return false;
    pairs_ = std::move(pairs);
    return true;
}

} // namespace filigree
