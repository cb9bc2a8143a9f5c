// Finding what may touch, and what contacts remember.
#include "filigree/physics/contact/contact.h"

#include "filigree/core/parallel_for.h"
#include "filigree/physics/body/point_grid.h"
#include "filigree/physics/contact/own_cells.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace filigree {

namespace {

constexpr std::size_t kContactSearchGrain = 256;

Vectors places_of_balls(const BodyState& body, const RunContext& context) {
    Vectors balls(body.balls.size());
    parallel_for(context, balls.size(), kContactSearchGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t s = begin; s < end; ++s) balls.set(s, embedded_point(body.balls, s, body.positions));
    });
    return balls;
}

std::vector<Index> within(const Vectors& points, const Vec3d& low, const Vec3d& high) {
    std::vector<Index> found;
    for (Index i = 0; i < points.size(); ++i) {
        const Eigen::Array3d at = points[i].cast<double>().array();
        if ((at >= low.array()).all() && (at <= high.array()).all()) found.push_back(i);
    }
    return found;
}

} // namespace

struct Contacts::OwnBalls {
    explicit OwnBalls(const Body& body) : matter(body), cells(matter) {}

    Matter matter;
    OwnCells cells;
};

Contacts::Contacts(const World& world, std::size_t bodies, std::size_t actors, bool between_bodies, bool within_bodies)
    : world_(world), between_bodies_(between_bodies), within_bodies_(within_bodies), near_(bodies),
      deepest_near_(bodies, 0), touched_(bodies, 0), matter_(world, actors, between_bodies, within_bodies) {
    for (const Obstacle& obstacle : world.obstacles) {
        const auto* ground = std::get_if<HalfSpace>(&obstacle.shape);
        const bool stands = ground && !obstacle.motion.moves();
        const Vec3d out = stands ? Vec3d(obstacle.motion.at(0).linear() * ground->normal.normalized()) : Vec3d::Zero();
        towards_.push_back(-out.cast<float>());
    }
}

void Contacts::begin(std::span<const BodyState> bodies) {
    matter_.begin(bodies);
    std::map<const Body*, std::shared_ptr<const OwnBalls>> known;
    for (const BodyState& body : bodies) {
        std::shared_ptr<const OwnBalls>& own = known[body.body.get()];
        if (!own && within_bodies_ && body.has_balls()) own = std::make_shared<const OwnBalls>(*body.body);
        own_balls_.push_back(own);
    }
}

void Contacts::search(std::span<BodyState> bodies, const Search& search, const RunContext& context) {
    if (matter_.search(bodies, search.frame, context)) look_near_again();
    if (near_way_ > near_until_ && !world_.obstacles.empty()) {
        find_near(bodies, search.time, search.obstacle_reach, context);
        near_way_ = 0;
        near_until_ = search.obstacle_reach;
    }
    if (pairs_way_ > pairs_until_) {
        find_pairs(bodies, search.pair_reach, context);
        pairs_way_ = 0;
        pairs_until_ = search.pair_reach;
    }
}

void Contacts::find_near(std::span<const BodyState> bodies, double time, float reach, const RunContext& context) {
    const ObstaclePoses poses(world_, time);
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        const BodyState& body = bodies[b];
        if (body.is_absent) near_[b] = {};
        if (body.sleeps()) continue;
        const std::size_t points = body.surface.size();
        std::vector<Vec3f> places(points);
        parallel_for(context, points, kContactSearchGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t s = begin; s < end; ++s) places[s] = embedded_point(body.surface, s, body.positions);
        });
        NearPoints found;
        std::vector<float> distances(points);
        auto old = near_[b].points.begin();
        const Box box = bounds(places);
        for (std::size_t o = 0; o < world_.obstacles.size(); ++o) {
            const float nearest = poses.distance_to(o, box.centre().cast<float>()).distance - float(box.diagonal() / 2);
            if (nearest > reach) continue;
            parallel_for(context, points, kContactSearchGrain, [&](std::size_t begin, std::size_t end) {
                for (std::size_t s = begin; s < end; ++s) distances[s] = poses.distance_to(o, places[s]).distance;
            });
            for (Index s = 0; s < points; ++s) {
                if (!(distances[s] < reach) || body.is_hidden(s)) continue;
                Near& near = found.points.emplace_back(Near{.obstacle = Index(o), .point = s, .grasp = {}});
                while (old != near_[b].points.end() && std::pair(old->obstacle, old->point) < std::pair(Index(o), s))
                    ++old;
                if (old != near_[b].points.end() && old->obstacle == o && old->point == s) near = *old;
                found.clear_until.push_back(near.grasp.holds ? 0 : distances[s]); // what holds is asked
            }
        }
        found.pad();
        near_[b] = std::move(found);
    }
}

std::vector<Contacts::NearPair> Contacts::held_pairs() const {
    std::vector<NearPair> held;
    std::ranges::copy_if(pairs_, std::back_inserter(held), [](const NearPair& pair) { return pair.grasp.holds; });
    std::ranges::sort(held, {}, &NearPair::key);
    return held;
}

void Contacts::find_pairs(std::span<const BodyState> bodies, float reach, const RunContext& context) {
    const std::vector<NearPair> held = held_pairs();
    pairs_.clear();
    std::vector<Index> order;
    std::vector<Box> boxes(bodies.size());
    for (Index b = 0; b < bodies.size(); ++b) {
        if (!bodies[b].has_balls() || !is_finite(bodies[b].positions)) continue; // or the frame is done again
        boxes[b] = box_of(bodies[b].positions);
        order.push_back(b);
    }
    std::vector<Vectors> balls(bodies.size());
    const auto balls_of = [&](Index b) -> const Vectors& {
        if (balls[b].size() == 0) balls[b] = places_of_balls(bodies[b], context);
        return balls[b];
    };
    for (auto a = order.begin(); a != order.end(); ++a) {
        if (own_balls_[*a]) find_own_pairs(bodies[*a], *a, balls_of(*a), reach);
        for (auto b = a + 1; between_bodies_ && b != order.end(); ++b) {
            const float touch = bodies[*a].ball_radius + bodies[*b].ball_radius, far = touch + reach;
            const Vec3d low = boxes[*a].min.cwiseMax(boxes[*b].min) - Vec3d::Constant(double(far));
            const Vec3d high = boxes[*a].max.cwiseMin(boxes[*b].max) + Vec3d::Constant(double(far));
            if (!(low.array() <= high.array()).all()) continue;
            const PairContact law = matter_.laws().of(bodies[*a].actor, bodies[*b].actor);
            const Vectors &own = balls_of(*a), &others = balls_of(*b);
            const std::vector<Index> near = within(own, low, high), near_others = within(others, low, high);
            Vectors places(near_others.size());
            for (std::size_t k = 0; k < near_others.size(); ++k) places.set(k, others[near_others[k]]);
            const PointGrid grid(places, far);
            for (const Index s : near)
                grid.near(own[s], far, [&](Index k) {
                    const float gap = (places[k] - own[s]).norm() - touch;
                    if (gap < reach) pairs_.push_back({*a, s, *b, near_others[k], gap, law});
                });
        }
    }
    for (NearPair& pair : pairs_) {
        const auto old = std::ranges::lower_bound(held, pair.key(), {}, &NearPair::key);
        if (old == held.end() || old->key() != pair.key()) continue;
        pair.grasp = old->grasp;
        pair.offset = old->offset;
    }
}

void Contacts::find_own_pairs(const BodyState& body, Index number, const Vectors& balls, float reach) {
    const PairContact law = matter_.laws().of(body.actor, body.actor);
    const float touch = 2 * body.ball_radius;
    for (const auto& [s, t] : own_balls_[number]->cells.near_points(balls, touch + reach))
        pairs_.push_back({number, s, number, t, (balls[t] - balls[s]).norm() - touch, law});
}

Contacts::Memory Contacts::memory() const {
    Memory memory{{}, near_way_, near_until_, {}, matter_.memory()};
    for (const NearPair& pair : held_pairs())
        memory.balls.push_back(
            {pair.first_body, pair.first, pair.second_body, pair.second, pair.grasp.slides, pair.offset});
    for (Index b = 0; b < near_.size(); ++b)
        for (std::size_t k = 0; k < near_[b].points.size(); ++k) {
            const Near& at = near_[b].points[k];
            memory.near.push_back({b, at.obstacle, at.point, Index(at.grasp.holds) + 2 * Index(at.grasp.slides),
                                   near_[b].clear_until[k], at.anchor});
        }
    return memory;
}

bool Contacts::set_memory(const Memory& memory, std::span<const BodyState> bodies) {
    const auto is_sound = [&](const NearMemory& near) {
        return near.body < bodies.size() && near.obstacle < world_.obstacles.size() &&
               near.point < bodies[near.body].surface.size() && near.anchor.allFinite() &&
               std::isfinite(near.clear_until);
    };
    const auto are_balls = [&](const BallMemory& pair) {
        return std::pair(pair.first_body, pair.first) < std::pair(pair.second_body, pair.second) &&
               pair.second_body < bodies.size() && pair.first < bodies[pair.first_body].balls.size() &&
               pair.second < bodies[pair.second_body].balls.size() && pair.offset.allFinite();
    };
    if (!std::ranges::all_of(memory.balls, are_balls)) return false;
    if (!std::isfinite(memory.near_way) || !std::isfinite(memory.near_until)) return false;
    if (!std::ranges::all_of(memory.near, is_sound) || !matter_.is_sound(memory.matter, bodies)) return false;
    for (NearPoints& near : near_) near = {};
    for (const NearMemory& near : memory.near) {
        const contact_law::Grasp grasp{(near.flags & 1) != 0, (near.flags & 2) != 0};
        near_[near.body].points.push_back({near.obstacle, near.point, 0, grasp, near.anchor});
        near_[near.body].clear_until.push_back(near.clear_until);
    }
    for (NearPoints& near : near_) near.pad();
    pairs_.clear();
    pairs_until_ = -1;
    for (const BallMemory& pair : memory.balls)
        pairs_.push_back({.first_body = pair.first_body,
                          .first = pair.first,
                          .second_body = pair.second_body,
                          .second = pair.second,
                          .clear_until = 0,
                          .law = matter_.laws().of(bodies[pair.first_body].actor, bodies[pair.second_body].actor),
                          .grasp = {true, pair.slides != 0},
                          .offset = pair.offset});
    near_way_ = memory.near_way;
    near_until_ = memory.near_until;
    matter_.set_memory(memory.matter, bodies);
    return true;
}

} // namespace filigree
