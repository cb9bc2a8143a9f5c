// Finding what may touch, and what contacts remember.
#include "filigree/physics/contact.h"

#include "filigree/core/parallel_for.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace filigree {

namespace {

constexpr std::size_t kContactSearchGrain = 256;

} // namespace

void Contacts::search(std::span<BodyState> bodies, const Search& search, const RunContext& context) {
    if (matter_.search(bodies, search.frame, context)) near_until_ = -1; // what woke has nothing near yet
    if (near_way_ > near_until_ && !world_.obstacles.empty()) {
        find_near(bodies, search.time, search.obstacle_reach, context);
        near_way_ = 0;
        near_until_ = search.obstacle_reach;
    }
    if (pairs_way_ > pairs_until_ && between_bodies_ && bodies.size() > 1) {
        find_pairs(bodies, search.pair_reach, context);
        pairs_way_ = 0;
        pairs_until_ = search.pair_reach;
    }
}

void Contacts::find_near(std::span<const BodyState> bodies, double time, float reach, const RunContext& context) {
    const ObstaclePoses poses(world_, time);
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        const BodyState& body = bodies[b];
        if (body.is_absent) near_[b].clear();
        if (body.sleeps()) continue;
        const std::size_t points = body.surface.size();
        std::vector<Vec3f> places(points);
        parallel_for(context, points, kContactSearchGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t s = begin; s < end; ++s) places[s] = embedded_point(body.surface, s, body.positions);
        });
        std::vector<Near> found;
        std::vector<float> distances(points);
        auto old = near_[b].begin();
        const Box box = bounds(places);
        for (std::size_t o = 0; o < world_.obstacles.size(); ++o) {
            const float nearest = distance_to(world_.obstacles[o], poses.at(o), box.centre().cast<float>()).distance -
                                  float(box.diagonal() / 2);
            if (nearest > reach) continue;
            parallel_for(context, points, kContactSearchGrain, [&](std::size_t begin, std::size_t end) {
                for (std::size_t s = begin; s < end; ++s)
                    distances[s] = distance_to(world_.obstacles[o], poses.at(o), places[s]).distance;
            });
            for (Index s = 0; s < points; ++s) {
                if (!(distances[s] < reach) || body.is_hidden(s)) continue;
                Near& near = found.emplace_back(Near{.obstacle = Index(o), .point = s, .grasp = {}});
                while (old != near_[b].end() && std::pair(old->obstacle, old->point) < std::pair(Index(o), s)) ++old;
                if (old != near_[b].end() && old->obstacle == o && old->point == s) near = *old;
                near.clear_until = distances[s];
            }
        }
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
    if (std::ranges::none_of(bodies, &BodyState::has_balls)) return;
    std::vector<Box> boxes(bodies.size());
    for (std::size_t b = 0; b < bodies.size(); ++b)
        for (std::size_t i = 0; i < bodies[b].positions.size(); ++i)
            boxes[b].extend(bodies[b].positions[i].cast<double>());
    std::vector<std::vector<Vec3f>> balls(bodies.size());
    const auto find_balls = [&](std::size_t b) {
        if (!balls[b].empty()) return;
        balls[b].resize(bodies[b].balls.size());
        parallel_for(context, balls[b].size(), kContactSearchGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t s = begin; s < end; ++s)
                balls[b][s] = embedded_point(bodies[b].balls, s, bodies[b].positions);
        });
    };
    for (std::size_t a = 0; a < bodies.size(); ++a)
        for (std::size_t b = a + 1; b < bodies.size(); ++b) {
            if (!bodies[a].has_balls() || !bodies[b].has_balls()) continue;
            const PairContact law = world_.contact_of(bodies[a].actor, bodies[b].actor);
            const float far = bodies[a].ball_radius + bodies[b].ball_radius + 2 * reach;
            const Vec3d low = boxes[a].min.cwiseMax(boxes[b].min) - Vec3d::Constant(double(far));
            const Vec3d high = boxes[a].max.cwiseMin(boxes[b].max) + Vec3d::Constant(double(far));
            if (!(low.array() <= high.array()).all()) continue;
            find_balls(a);
            find_balls(b);
            const auto is_common = [&](const Vec3f& p) {
                return (p.cast<double>().array() >= low.array()).all() &&
                       (p.cast<double>().array() <= high.array()).all();
            };
            using Key = std::array<int, 3>;
            const auto key_of = [&](const Vec3f& p) {
                const Vec3d q = (p.cast<double>() - low) / double(far);
                return Key{int(q.x()), int(q.y()), int(q.z())};
            };
            std::vector<std::pair<Key, Index>> grid;
            for (Index t = 0; t < balls[b].size(); ++t)
                if (is_common(balls[b][t])) grid.emplace_back(key_of(balls[b][t]), t);
            std::ranges::sort(grid);
            for (Index s = 0; s < balls[a].size(); ++s) {
                if (!is_common(balls[a][s])) continue;
                const Key key = key_of(balls[a][s]);
                for (int i = key[0] - 1; i <= key[0] + 1; ++i)
                    for (int j = key[1] - 1; j <= key[1] + 1; ++j) {
                        auto at = std::ranges::lower_bound(grid, std::pair(Key{i, j, key[2] - 1}, Index{0}));
                        for (; at != grid.end() && at->first <= Key{i, j, key[2] + 1}; ++at)
                            if (const float gap = (balls[b][at->second] - balls[a][s]).norm() - far + 2 * reach;
                                gap < 2 * reach)
                                pairs_.push_back({Index(a), s, Index(b), at->second, gap / 2, law});
                    }
            }
        }
    for (NearPair& pair : pairs_) {
        const auto old = std::ranges::lower_bound(held, pair.key(), {}, &NearPair::key);
        if (old == held.end() || old->key() != pair.key()) continue;
        pair.grasp = old->grasp;
        pair.offset = old->offset;
    }
}

Contacts::Memory Contacts::memory() const {
    Memory memory{{}, near_way_, near_until_, {}, matter_.memory()};
    for (const NearPair& pair : held_pairs())
        memory.balls.push_back(
            {pair.first_body, pair.first, pair.second_body, pair.second, pair.grasp.slides, pair.offset});
    for (Index b = 0; b < near_.size(); ++b)
        for (const Near& at : near_[b])
            memory.near.push_back({b, at.obstacle, at.point, Index(at.grasp.holds) + 2 * Index(at.grasp.slides),
                                   at.clear_until, at.anchor});
    return memory;
}

bool Contacts::set_memory(const Memory& memory, std::span<const BodyState> bodies) {
    const auto is_sound = [&](const NearMemory& near) {
        return near.body < bodies.size() && near.obstacle < world_.obstacles.size() &&
               near.point < bodies[near.body].surface.size() && near.anchor.allFinite() &&
               std::isfinite(near.clear_until);
    };
    const auto are_balls = [&](const BallMemory& pair) {
        return pair.first_body < pair.second_body && pair.second_body < bodies.size() &&
               pair.first < bodies[pair.first_body].balls.size() &&
               pair.second < bodies[pair.second_body].balls.size() && pair.offset.allFinite();
    };
    if (!std::ranges::all_of(memory.balls, are_balls)) return false;
    if (!std::isfinite(memory.near_way) || !std::isfinite(memory.near_until)) return false;
    if (!std::ranges::all_of(memory.near, is_sound) || !matter_.is_sound(memory.matter, bodies)) return false;
    for (std::vector<Near>& near : near_) near.clear();
    for (const NearMemory& near : memory.near)
        near_[near.body].push_back({near.obstacle,
                                    near.point,
                                    near.clear_until,
                                    0,
                                    {(near.flags & 1) != 0, (near.flags & 2) != 0},
                                    near.anchor});
    pairs_.clear();
    pairs_until_ = -1;
    for (const BallMemory& pair : memory.balls)
        pairs_.push_back({.first_body = pair.first_body,
                          .first = pair.first,
                          .second_body = pair.second_body,
                          .second = pair.second,
                          .clear_until = 0,
                          .law = world_.contact_of(bodies[pair.first_body].actor, bodies[pair.second_body].actor),
                          .grasp = {true, pair.slides != 0},
                          .offset = pair.offset});
    near_way_ = memory.near_way;
    near_until_ = memory.near_until;
    matter_.set_memory(memory.matter, bodies);
    return true;
}

} // namespace filigree
