// Contacts: forces of what touches, contact points of what does not deform, and moving out what is too deep.
#include "filigree/physics/contact/contact.h"

#include "filigree/core/bits.h"
#include "filigree/core/parallel_for.h"

#include <algorithm>
#include <map>

namespace filigree {

using namespace contact_law;

namespace {

constexpr std::size_t kTouchGrain = 4; // blocks
/// How much harder parts of one body push each other than two bodies do: it took a dragon that falls on itself from
/// 0.34 spacings deep to 0.29.
constexpr float kWithinOneBody = 1.5f;
constexpr float kEdgeSlack = 0.1f;  ///< spacings: so deep an edge may be in what surface points carry
constexpr float kLongestWay = 0.3f; ///< spacings a substep that one body may go towards another

} // namespace

Contacts::Contacts(const World& world, std::size_t actors, bool between_bodies, bool within_bodies)
    : world_(world), laws_(world, actors), between_bodies_(between_bodies), within_bodies_(within_bodies) {
    for (std::size_t o = 0; o < world.obstacles.size(); ++o) {
        towards_.push_back(way_towards(o));
        shapes_.emplace_back(world.obstacles[o]);
    }
}

Vec3f Contacts::way_towards(std::size_t obstacle) const {
    const RigidMotion& motion = world_.obstacles[obstacle].motion;
    const auto* ground = std::get_if<HalfSpace>(&world_.obstacles[obstacle].shape);
    if (!ground || motion.moves()) return Vec3f::Zero();
    return -(motion.at(0).linear() * ground->normal.normalized()).cast<float>();
}

void Contacts::begin(std::span<const BodyState> bodies) {
    std::map<const Body*, std::size_t> first; // of its kind: pieces of one kind share what belongs to the kind
    for (std::size_t b = 0; b < bodies.size(); ++b)
        make_ready(bodies[b], b, first.emplace(bodies[b].body.get(), b).first->second);
}

/// like: a body of its kind that is ready, or itself.
void Contacts::make_ready(const BodyState& state, std::size_t body, std::size_t like) {
    if (body >= matter_.size()) {
        matter_.resize(body + 1, std::make_shared<const BodyMatter>());
        own_cells_.resize(body + 1);
        passing_.resize(body + 1);
        own_gaps_.resize(body + 1);
        recovers_.resize(body + 1);
        touched_.resize(body + 1);
        loads_.resize(body + 1);
        events_.resize(body + 1);
    }
    motions_.set_body(body, state, like);
    matter_[body] = matter_[like];
    own_cells_[body] = own_cells_[like];
    if (like != body || !state.body->field) return;
    BodyMatter made{std::make_shared<const Matter>(*state.body), stiffness_per_area(state)};
    if (within_bodies_ && !state.rigid) own_cells_[body] = std::make_shared<const OwnCells>(*made.matter);
    matter_[body] = std::make_shared<const BodyMatter>(std::move(made));
}

void Contacts::add_body(std::span<const BodyState> bodies, std::size_t body) {
    std::size_t like = 0;
    while (like < matter_.size() && (like == body || bodies[like].body != bodies[body].body)) ++like;
    make_ready(bodies[body], body, like < matter_.size() ? like : body);
    reach_ = -1; // it may be near others
}

void Contacts::remove_body(std::span<const BodyState> bodies, std::size_t body) {
    const auto is_of_kind = [&](const BodyState& other) { return other.body == bodies[body].body; };
    if (std::ranges::count_if(bodies, is_of_kind) == 1) crushed_.forget(bodies[body].body);
    const ColliderId id = ColliderId::body(body);
    std::erase_if(pairs_, [&](const ContactPair& pair) { return pair.points == id || pair.touched == id; });
    matter_[body] = std::make_shared<const BodyMatter>();
    own_cells_[body] = nullptr;
    passing_[body] = nullptr;
    own_gaps_[body] = 0;
    recovers_[body] = touched_[body] = 0;
    motions_.remove_body(body);
    list_work(bodies);
}

void Contacts::set_passing(std::size_t body, std::shared_ptr<const OwnCells::Passing> passing) {
    if (!passing && !passing_[body]) return;
    passing_[body] = std::move(passing);
    const ColliderId id = ColliderId::body(body);
    std::erase_if(pairs_, [&](const ContactPair& pair) { return pair.points == id && pair.touched == id; });
    reach_ = -1;
}

void Contacts::set_own_gap(std::size_t body, float gap) {
    if (own_gaps_[body] == gap) return;
    own_gaps_[body] = gap;
    const ColliderId id = ColliderId::body(body);
    std::erase_if(pairs_, [&](const ContactPair& pair) { return pair.points == id && pair.touched == id; });
    reach_ = -1;
}

void Contacts::set_obstacle(std::size_t obstacle, bool is_jump) {
    towards_[obstacle] = way_towards(obstacle);
    reach_ = -1;
    const ColliderId id = ColliderId::obstacle(obstacle);
    for (ContactPair& pair : pairs_) {
        if (pair.points != id && pair.touched != id) continue;
        pair.reach = -1;
        if (!is_jump) continue;
        pair.knows_side = false;
        for (Candidate& at : pair.candidates) {
            at.grasp = {};
            at.rigid_force = Vec3f::Zero();
        }
    }
}

ContactPair Contacts::make_pair(ColliderId points, ColliderId touched, std::span<const BodyState> bodies) const {
    ContactPair pair{.points = points, .touched = touched, .law = {}, .candidates = {}, .clear_until = {}};
    const auto spacing = [&](ColliderId id) {
        return id.is_obstacle() ? std::numeric_limits<float>::max() : float(bodies[id.number()].body->spacing());
    };
    const auto is_rigid = [&](ColliderId id) { return id.is_obstacle() || bodies[id.number()].rigid; };
    pair.spacing = std::min(spacing(points), spacing(touched));
    pair.is_rigid = is_rigid(points) && is_rigid(touched);
    if (pair.is_of_bodies()) {
        pair.law = laws_.of(bodies[points.number()].actor, bodies[touched.number()].actor);
        pair.stiffness = matter_[points.number()]->matter ? 0.5f : 1.0f; // half where the other's points push as well
        if (pair.is_own()) {
            pair.stiffness *= kWithinOneBody;
            pair.slack = -own_gaps_[points.number()];
        }
        return pair;
    }
    const Obstacle& obstacle = world_.obstacles[pair.obstacle()];
    pair.law = {obstacle.friction, obstacle.restitution};
    pair.stiffness = float(obstacle.stiffness);
    pair.is_traced = touched.is_obstacle() && shapes_[pair.obstacle()].is_traced();
    if (points.is_obstacle()) pair.slack = kEdgeSlack * pair.spacing;
    return pair;
}

template <class Visit>
void Contacts::with_sides(const ContactPair& pair, std::span<BodyState> bodies, const ObstaclePoses& poses,
                          const Visit& visit) const {
    const Index points = pair.points.number(), touched = pair.touched.number();
    const auto matter = [&] { return MatterCollider(bodies[touched], *matter_[touched], recovers_[touched] != 0); };
    if (pair.points.is_obstacle())
        visit(EdgePoints(poses, points), matter());
    else if (pair.touched.is_obstacle())
        visit(BodyPoints(bodies[points]), ObstacleCollider(shapes_[touched], poses, touched));
    else
        visit(BodyPoints(bodies[points]), matter());
}

/// m outside, at which a point of a rigid pair counts as touching: however fast the body goes, something may turn it
/// towards the obstacle within the substep.
float Contacts::margin_of(const ContactPair& pair) const {
    return pair.is_rigid ? touching_margin(pair.spacing, motions_.speed(pair.body())) : 0;
}

/// The force on a point; minus it is that on what it touches. Lets friction's anchor begin, slide and end. Of a rigid
/// pair the normal.
template <class Points, class Touched>
Vec3f Contacts::touch(ContactPair& pair, std::size_t k, const Points& points, const Touched& touched, float dt) const {
    Candidate& at = pair.candidates[k];
    const Vec3f point = points.position(at);
    const Approach approach{margin_of(pair),
                            pair.is_of_edges() ? Vec3f(dt * points.velocity(at)) : Vec3f(Vec3f::Zero()), dt};
    const Meeting met = touched.meet(at, pair, point, approach);
    at.depth = at.is_tangled ? 0 : met.depth;
    if (met.normal.isZero(0)) {
        float clear = -met.depth;
        if (met.slowest < 1) { // neighbours move alike: the point's own speed counts, and not the pair's
            clear = pair.safe_way(clear);
            const float speed = (points.velocity(at) - touched.velocity(at, point)).norm();
            if (clear > 0) clear *= pair.speed / (speed + met.slowest * pair.speed);
        }
        pair.clear_until[k] = pair.travelled + clear;
        at.depth = 0;
        at.grasp = {};
        at.is_tangled = false;
        at.entry_normal = at.rigid_force = Vec3f::Zero();
        return Vec3f::Zero();
    }
    if (at.is_tangled) return Vec3f::Zero();
    at.normal = met.normal;
    if (pair.is_rigid) return met.normal;
    const Touch touch{met.normal,
                      points.velocity(at) - touched.velocity(at, point),
                      std::min(at.depth, kDeepest * pair.spacing), // deeper it is moved out
                      pair.stiffness * std::min(points.stiffness(at), touched.stiffness(at, points.area(at))),
                      float(pair.law.friction),
                      float(pair.law.restitution),
                      std::max(points.squared_frequency(), touched.squared_frequency()) *
                          (pair.is_of_bodies() ? 1 : pair.stiffness)};
    Vec3f offset = Vec3f::Zero();
    if (at.grasp.holds) offset = along_surface(touched.from_anchor(at, point), touch.normal);
    const bool landed = !at.grasp.holds;
    at.approach = -touch.velocity.dot(touch.normal);
    const Vec3f force = touch_force(touch, offset, at.grasp, dt, smooth_speed(world_, dt));
    if (landed || at.grasp.slides) touched.put_anchor(at, point, offset);
    return force;
}

ContactPoint Contacts::contact_point(ContactPair& pair, Candidate& at, const Vec3f& normal, std::span<BodyState> bodies,
                                     const ObstaclePoses& poses) const {
    ContactPoint point{.separation = -at.depth,
                       .friction = float(pair.law.friction),
                       .restitution = float(pair.law.restitution),
                       .force = &at.rigid_force,
                       .holds = &at.grasp.holds};
    point.body = pair.body();
    point.obstacle = pair.obstacle();
    point.normal = pair.is_of_edges() ? Vec3f(-normal) : normal;
    with_sides(pair, bodies, poses, [&](const auto& points, const auto& touched) {
        point.place = points.position(at);
        point.other_velocity = pair.is_of_edges() ? points.velocity(at) : touched.velocity(at, point.place);
    });
    return point;
}

/// To the frame's events: what pushes a body along the normal, N s, by forces or, is_push, beside them.
void Contacts::tell(const ContactPair& pair, const Vec3f& place, const Vec3f& normal, float impulse, float approach,
                    bool is_push) {
    if (pair.is_own()) return;
    const Index body = pair.body();
    const ColliderId other = pair.is_of_edges() ? pair.points : pair.touched;
    const Vec3f towards = pair.is_of_edges() ? Vec3f(-normal) : normal;
    if (is_push)
        events_.push(body, other, place, towards, impulse, approach);
    else
        events_.touch(body, other, place, towards, impulse, approach);
}

void Contacts::note_touch(const ContactPair& pair, const Candidate& at, ContactReport& report) {
    const std::uint8_t rubs = at.grasp.slides && pair.law.friction > 0 ? kRubs : 0;
    ++report.contacts;
    if (pair.is_of_bodies()) {
        const auto touch = std::uint8_t((pair.is_own() ? kInItself : kInMatter) | rubs);
        touched_[pair.points.number()] |= touch;
        touched_[pair.touched.number()] |= touch;
        report.deepest_in_matter = std::max(report.deepest_in_matter, at.depth + std::min(pair.slack, 0.0f));
        return;
    }
    touched_[pair.body()] |= std::uint8_t((pair.is_of_edges() ? kInMatter : kOnObstacle) | rubs);
    report.deepest = std::max(report.deepest, at.depth);
}

/// On both bodies, as far as they are stiff.
template <class Points, class Touched>
void Contacts::add_loads(const ContactPair& pair, const Candidate& at, const Vec3f& force, const Points& points,
                         const Touched& touched, std::span<const BodyState> bodies) {
    const auto is_stiff = [&](ColliderId id) { return !id.is_obstacle() && bodies[id.number()].is_stiff; };
    if (pair.is_own() || !(is_stiff(pair.points) || is_stiff(pair.touched))) return;
    const Vec3f place = points.position(at);
    const double push = double(force.dot(at.normal));
    const auto number = [](ColliderId id) { return id.is_obstacle() ? BodyLoad::kObstacle : double(id.number()); };
    if (is_stiff(pair.points))
        loads_[pair.points.number()].add(push, at.normal, place, touched.velocity(at, place), pair.law.restitution,
                                         number(pair.touched));
    if (is_stiff(pair.touched))
        loads_[pair.touched.number()].add(push, -at.normal, place, points.velocity(at), pair.law.restitution,
                                          number(pair.points));
}

ContactReport Contacts::add_forces(std::span<BodyState> bodies, double time, float dt, RigidContacts& rigid,
                                   const RunContext& context) {
    constexpr std::size_t kBlock = ContactPair::kBlock;
    const ObstaclePoses poses(world_, time);
    forces_.resize(work_.size() * kBlock);
    parallel_for(context, work_.size(), kTouchGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t w = begin; w < end; ++w) {
            Work& work = work_[w];
            ContactPair& pair = pairs_[work.pair];
            const std::size_t first = work.block * kBlock, left = pair.candidates.size() - first;
            const float* until = &pair.clear_until[first];
            std::uint64_t asked = bits_where<kBlock>([&](std::size_t k) { return !(until[k] > pair.travelled); });
            if (left < kBlock) asked &= (std::uint64_t{1} << left) - 1; // also where a way is not a number
            work.touching = 0;
            if (asked == 0) continue;
            with_sides(pair, bodies, poses, [&](const auto& points, const auto& touched) {
                for_each_bit(asked, [&](int bit) { points.read_ahead(pair.candidates[first + std::size_t(bit)]); });
                for_each_bit(asked, [&](int bit) {
                    const std::size_t k = first + std::size_t(bit);
                    Vec3f& force = forces_[w * kBlock + std::size_t(bit)];
                    force = touch(pair, k, points, touched, dt);
                    const bool touches = pair.candidates[k].depth > 0 || (pair.is_rigid && !force.isZero(0));
                    work.touching |= std::uint64_t{touches} << bit;
                });
            });
        }
    });
    ContactReport report;
    events_.begin_forces();
    rigid.clear();
    touched_.assign(touched_.size(), 0);
    loads_.assign(loads_.size(), {});
    for (std::size_t w = 0; w < work_.size(); ++w) {
        ContactPair& pair = pairs_[work_[w].pair];
        if (work_[w].block == 0) pair.deepest = 0;
        if (work_[w].touching == 0) continue;
        with_sides(pair, bodies, poses, [&](const auto& points, const auto& touched) {
            for_each_bit(work_[w].touching, [&](int bit) {
                Candidate& at = pair.candidates[work_[w].block * kBlock + std::size_t(bit)];
                const Vec3f& force = forces_[w * kBlock + std::size_t(bit)];
                if (pair.is_rigid) {
                    rigid.add(contact_point(pair, at, force, bodies, poses));
                } else {
                    add_loads(pair, at, force, points, touched, bodies);
                    tell(pair, points.position(at), at.normal, dt * force.dot(at.normal), at.approach, false);
                    points.push(at, force);
                    touched.push(at, -force);
                }
                pair.deepest = std::max(pair.deepest, at.depth);
                if (at.depth > 0) note_touch(pair, at, report);
            });
        });
    }
    for (std::size_t b = 0; b < bodies.size(); ++b)
        if (bodies[b].corners && touched_[b] & (kInMatter | kInItself))
            bodies[b].corners->give_forces(bodies[b].forces, context);
    return report;
}

template <class Points, class Touched>
void Contacts::push_out(Candidate& at, const ContactPair& pair, const Points& points, const Touched& touched) {
    const Vec3f point = points.position(at);
    const Meeting met = touched.meet(at, pair, point, {}); // others have moved it since
    if (met.normal.isZero(0) || at.is_tangled) return;
    const float too_deep = met.depth - pair.most_depth();
    const float gives = points.yielding(at) + touched.yielding(at);
    if (!(too_deep > 0) || !(gives > 0)) return;
    const Vec3f velocity = points.velocity(at) - touched.velocity(at, point);
    const Vec3f way = too_deep / gives * met.normal;
    const Vec3f push = std::max(0.0f, -velocity.dot(met.normal)) / gives * met.normal;
    tell(pair, point, met.normal, push.norm(), 0, true);
    points.move(at, way, push, too_deep);
    touched.move(at, -way, -push, too_deep);
}

void Contacts::push_out(std::span<BodyState> bodies, double time, const RunContext& context) {
    const ObstaclePoses poses(world_, time);
    for (ContactPair& pair : pairs_) {
        if (!is_too_deep(pair) || sleeps(pair, bodies)) continue;
        const bool may_crush = pair.touched.is_obstacle();
        const float deep = first_depth(pair);
        Vec3f outwards = Vec3f::Zero(); // of what is deep
        with_sides(pair, bodies, poses, [&](const auto& points, const auto& touched) {
            for (Candidate& at : pair.candidates) {
                if (!(at.depth > deep)) continue;
                if (may_crush) outwards += touched.meet(at, pair, points.position(at), {}).normal;
                if (at.depth > pair.most_depth()) push_out(at, pair, points, touched);
            }
        });
        if (!outwards.isZero(0))
            crushed_.push_out(bodies[pair.points.number()], pair, shapes_[pair.touched.number()], outwards, poses,
                              context);
    }
}

double Contacts::added_frequency(std::size_t body) const {
    const std::uint8_t touched = touched_[body];
    const double in_matter = touched & kInItself ? double(kWithinOneBody) : touched & kInMatter ? 1.0 : 0.0;
    return double(kContactShare) * ((touched & kOnObstacle ? 1.0 : 0.0) + 2 * in_matter);
}

double Contacts::longest_step() const {
    double longest = std::numeric_limits<double>::infinity();
    for (const ContactPair& pair : pairs_)
        if (pair.is_of_bodies() && !pair.is_own() && pair.speed > 0)
            longest = std::min(longest, double(kLongestWay * pair.spacing / pair.speed));
    return longest;
}

} // namespace filigree
