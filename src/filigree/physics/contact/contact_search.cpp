// Finding what may touch, and what contacts remember.
#include "filigree/physics/contact/contact.h"

#include "filigree/core/parallel_for.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

constexpr std::size_t kContactSearchGrain = 256;

} // namespace

Contacts::Contacts(const World& world, std::size_t bodies, std::size_t actors, bool between_bodies, bool within_bodies)
    : world_(world), near_(bodies), deepest_near_(bodies, 0), touched_(bodies, 0),
      matter_(world, actors, between_bodies, within_bodies), features_(world) {
    for (std::size_t o = 0; o < world.obstacles.size(); ++o) {
        towards_.push_back(way_towards(o));
        shapes_.emplace_back(world.obstacles[o]);
    }
    seen_.resize(bodies * shapes_.size());
    events_.resize(bodies);
}

Vec3f Contacts::way_towards(std::size_t obstacle) const {
    const RigidMotion& motion = world_.obstacles[obstacle].motion;
    const auto* ground = std::get_if<HalfSpace>(&world_.obstacles[obstacle].shape);
    if (!ground || motion.moves()) return Vec3f::Zero();
    return -(motion.at(0).linear() * ground->normal.normalized()).cast<float>();
}

void Contacts::begin(std::span<const BodyState> bodies) { matter_.begin(bodies); }

void Contacts::add_body(std::span<const BodyState> bodies, std::size_t body) {
    matter_.add_body(bodies, body);
    if (body >= near_.size()) {
        near_.resize(body + 1);
        deepest_near_.resize(body + 1);
        touched_.resize(body + 1);
        seen_.resize((body + 1) * shapes_.size());
        events_.resize(body + 1);
    }
    near_until_ = -1;
}

void Contacts::remove_body(std::span<const BodyState> bodies, std::size_t body) {
    const auto is_of_kind = [&](const BodyState& other) { return other.body == bodies[body].body; };
    if (std::ranges::count_if(bodies, is_of_kind) == 1) particle_depths_.erase(bodies[body].body.get());
    near_[body] = {};
    deepest_near_[body] = 0;
    touched_[body] = 0;
    was_placed(body);
    features_.remove_body(body);
    matter_.remove_body(bodies, body);
}

void Contacts::set_obstacle(std::size_t obstacle, bool is_jump) {
    towards_[obstacle] = way_towards(obstacle);
    near_until_ = -1;
    if (!is_jump) return;
    for (std::size_t b = 0; b < near_.size(); ++b) {
        seen_[b * shapes_.size() + obstacle] = 0;
        for (Near& at : near_[b].points)
            if (at.obstacle == obstacle) {
                at.grasp = {};
                at.rigid_force = Vec3f::Zero();
            }
    }
}

void Contacts::search(std::span<BodyState> bodies, const Search& search, const RunContext& context) {
    if (matter_.search(bodies, search.frame, context)) look_near_again();
    forget_jumps(search.time);
    if (near_way_ + search.step_way > near_until_ && !world_.obstacles.empty()) {
        const float reach = std::max(search.obstacle_reach, 2 * search.step_way);
        find_near(bodies, search.time, reach, context);
        near_way_ = 0;
        near_until_ = reach;
    }
}

/// Where an obstacle has jumped, what was on its other side is not where it was: sides are found anew.
void Contacts::forget_jumps(double time) {
    for (std::size_t o = 0; o < shapes_.size() && time_; ++o) {
        const RigidMotion& motion = world_.obstacles[o].motion;
        if (!shapes_[o].is_traced() || !(jumps_between(motion, *time_, time))) continue;
        for (std::size_t b = 0; b < near_.size(); ++b) seen_[b * shapes_.size() + o] = 0;
        near_until_ = -1;
    }
    time_ = time;
}

/// Finds the points of one body that are near obstacles.
class Contacts::NearFinder {
public:
    NearFinder(Contacts& contacts, const BodyState& body, std::size_t number, float reach, const ObstaclePoses& poses,
               const RunContext& context)
        : contacts_(contacts), body_(body), number_(number), reach_(reach), poses_(poses), context_(context),
          places_(body.surface.size()), distances_(body.surface.size()), old_(contacts.near_[number]) {
        parallel_for(context, places_.size(), kContactSearchGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t s = begin; s < end; ++s) places_[s] = embedded_point(body.surface, s, body.positions);
        });
        box_ = bounds(places_);
    }

    NearPoints find() {
        for (std::size_t o = 0; o < contacts_.shapes_.size(); ++o) {
            while (next_ < old_.points.size() && old_.points[next_].obstacle < o) ++next_;
            if (contacts_.shapes_[o].is_traced())
                add_traced(o);
            else
                add_below(o);
        }
        found_.pad();
        return std::move(found_);
    }

private:
    /// The number of what was found last of a point, or none. Points are asked for in ascending order.
    std::size_t old_of(Index obstacle, Index point) {
        const auto& points = old_.points;
        const auto key = [&](std::size_t k) { return std::pair(points[k].obstacle, points[k].point); };
        while (next_ < points.size() && key(next_) < std::pair(obstacle, point)) ++next_;
        return next_ < points.size() && key(next_) == std::pair(obstacle, point) ? next_ : points.size();
    }

    /// Of a half-space, or a field.
    void add_below(std::size_t o) {
        const float nearest = poses_.distance_to(o, box_.centre().cast<float>()).distance - float(box_.diagonal() / 2);
        if (nearest > reach_) return;
        parallel_for(context_, places_.size(), kContactSearchGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t s = begin; s < end; ++s) distances_[s] = poses_.distance_to(o, places_[s]).distance;
        });
        for (Index s = 0; s < places_.size(); ++s) {
            if (!(distances_[s] < reach_) || body_.is_hidden(s)) continue;
            Near near{.obstacle = Index(o), .point = s, .grasp = {}};
            if (const std::size_t k = old_of(Index(o), s); k < old_.points.size()) near = old_.points[k];
            found_.points.push_back(near);
            found_.clear_until.push_back(near.grasp.holds ? 0 : distances_[s]); // what holds is asked
        }
    }

    void add_traced(std::size_t o) {
        const ObstacleShape& shape = contacts_.shapes_[o];
        const Eigen::Isometry3d to_own = poses_.at(o).inverse();
        const bool is_new = !std::exchange(contacts_.seen_[number_ * contacts_.shapes_.size() + o], 1);
        std::optional<StartSides> sides;
        if (is_new) sides.emplace(body_, shape, poses_.at(o));
        const bool is_across = sides && !sides->all_right();
        const bool is_known = !is_new && next_ < old_.points.size() && old_.points[next_].obstacle == o;
        const double all = 0.5 * box_.diagonal() + double(reach_);
        if (!is_across && !is_known && shape.clearance(to_own * box_.centre(), all) >= all) return;
        parallel_for(context_, places_.size(), kContactSearchGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t s = begin; s < end; ++s)
                distances_[s] = float(shape.clearance(to_own * places_[s].cast<double>(), double(reach_)));
        });
        for (Index s = 0; s < places_.size(); ++s) {
            if (body_.is_hidden(s)) continue;
            const std::size_t k = is_new ? old_.points.size() : old_of(Index(o), s);
            const Vec3d place = to_own * places_[s].cast<double>();
            if (k < old_.points.size())
                keep(k, place, distances_[s]);
            else if (is_across || distances_[s] < reach_)
                begin(o, s, place, sides ? sides->start_of(s) : to_own * inside_of(s), distances_[s]);
        }
    }

    /// A point that was followed before. What may have met something since it was last asked has to be asked again.
    void keep(std::size_t k, const Vec3d& place, float distance) {
        Near near = old_.points[k];
        Trace trace = old_.traces[near.trace];
        const bool may_have_met =
            !(old_.clear_until[k] > contacts_.near_way_) || !((place - trace.place).norm() < double(distance));
        const bool is_asked = near.depth > 0 || near.grasp.holds || may_have_met;
        if (!is_asked && !(distance < reach_)) return;
        if (!is_asked) trace.place = place;
        add(near, trace, is_asked ? 0 : distance);
    }

    void begin(std::size_t o, Index s, const Vec3d& place, const Vec3d& from, float distance) {
        Near near{.obstacle = Index(o), .point = s, .grasp = {}};
        Trace trace{.place = place};
        if (!((place - from).norm() < double(distance))) {
            trace.place = from;
            near.depth = float(contacts_.shapes_[o].follow(trace.place, place).depth);
        }
        if (near.depth > 0 || distance < reach_) add(near, trace, near.depth > 0 ? 0 : distance);
    }

    void add(Near near, const Trace& trace, float clear_until) {
        near.trace = Index(found_.traces.size());
        found_.points.push_back(near);
        found_.traces.push_back(trace);
        found_.clear_until.push_back(clear_until);
    }

    /// World: a place in the matter beside a surface point.
    Vec3d inside_of(Index point) const {
        const Embedding& surface = body_.surface;
        Vec3d sum = Vec3d::Zero();
        for (Index k = surface.offsets[point]; k < surface.offsets[point + 1]; ++k)
            sum += body_.positions[surface.particles[k]].cast<double>();
        return sum / double(surface.offsets[point + 1] - surface.offsets[point]);
    }

    Contacts& contacts_;
    const BodyState& body_;
    const std::size_t number_;
    const float reach_;
    const ObstaclePoses& poses_;
    const RunContext& context_;
    std::vector<Vec3f> places_;
    std::vector<float> distances_;
    Box box_;
    const NearPoints& old_;
    NearPoints found_;
    std::size_t next_ = 0;
};

void Contacts::find_near(std::span<const BodyState> bodies, double time, float reach, const RunContext& context) {
    const ObstaclePoses poses(world_, time);
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        const BodyState& body = bodies[b];
        if (body.is_absent) {
            near_[b] = {};
            was_placed(b);
        }
        if (body.sleeps())
            near_[b].clear_until.assign(near_[b].clear_until.size(), 0); // ways are counted anew
        else
            near_[b] = NearFinder(*this, body, b, reach, poses, context).find();
    }
    if (follows_points()) features_.search(bodies, shapes_, matter_, poses, reach);
}

Contacts::Memory Contacts::memory() const {
    Memory memory{{}, near_way_, near_until_, seen_, features_.near(), matter_.memory(), events_.memory()};
    for (Index b = 0; b < near_.size(); ++b)
        for (std::size_t k = 0; k < near_[b].points.size(); ++k) {
            const Near& at = near_[b].points[k];
            const bool touches = at.trace != kNoIndex && at.depth > 0;
            memory.near.push_back({b, at.obstacle, at.point,
                                   Index(at.grasp.holds) + 2 * Index(at.grasp.slides) + 4 * Index(touches),
                                   near_[b].clear_until[k], at.anchor, at.rigid_force, 0,
                                   at.trace == kNoIndex ? Vec3d(Vec3d::Zero()) : near_[b].traces[at.trace].place});
        }
    return memory;
}

bool Contacts::set_memory(const Memory& memory, std::span<const BodyState> bodies) {
    const auto is_sound = [&](const NearMemory& near) {
        return near.body < bodies.size() && near.obstacle < world_.obstacles.size() &&
               near.point < bodies[near.body].surface.size() && near.anchor.allFinite() &&
               near.rigid_force.allFinite() && near.place.allFinite() && std::isfinite(near.clear_until);
    };
    if (memory.seen.size() != seen_.size()) return false;
    if (!features_.is_sound(memory.features, bodies, shapes_, matter_)) return false;
    if (!std::isfinite(memory.near_way) || !std::isfinite(memory.near_until)) return false;
    if (!std::ranges::all_of(memory.near, is_sound) || !matter_.is_sound(memory.matter, bodies)) return false;
    for (NearPoints& near : near_) near = {};
    for (const NearMemory& near : memory.near) {
        const contact_law::Grasp grasp{(near.flags & 1) != 0, (near.flags & 2) != 0};
        NearPoints& of = near_[near.body];
        const bool is_traced = shapes_[near.obstacle].is_traced();
        const float touches = (near.flags & 4) != 0 ? std::numeric_limits<float>::min() : 0; // found with the forces
        of.points.push_back({near.obstacle, near.point, touches, grasp, near.anchor, near.rigid_force,
                             is_traced ? Index(of.traces.size()) : kNoIndex});
        if (is_traced) of.traces.push_back({near.place, Vec3f::Zero()});
        near_[near.body].clear_until.push_back(near.clear_until);
    }
    for (NearPoints& near : near_) near.pad();
    near_way_ = memory.near_way;
    near_until_ = memory.near_until;
    seen_ = memory.seen;
    features_.set_near(memory.features);
    time_.reset();
    matter_.set_memory(memory.matter, bodies);
    events_.set_memory(memory.touched);
    return true;
}

} // namespace filigree
