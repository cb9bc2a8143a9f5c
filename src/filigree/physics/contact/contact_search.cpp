// Finding what may touch, and what contacts remember.
#include "filigree/physics/contact/contact.h"

#include "filigree/core/parallel_for.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace filigree {

namespace {

constexpr std::size_t kContactSearchGrain = 256;

} // namespace

Contacts::Contacts(const World& world, std::size_t bodies, std::size_t actors, bool between_bodies, bool within_bodies)
    : world_(world), near_(bodies), deepest_near_(bodies, 0), touched_(bodies, 0),
      matter_(world, actors, between_bodies, within_bodies) {
    for (const Obstacle& obstacle : world.obstacles) {
        const auto* ground = std::get_if<HalfSpace>(&obstacle.shape);
        const bool stands = ground && !obstacle.motion.moves();
        const Vec3d out = stands ? Vec3d(obstacle.motion.at(0).linear() * ground->normal.normalized()) : Vec3d::Zero();
        towards_.push_back(-out.cast<float>());
    }
}

void Contacts::begin(std::span<const BodyState> bodies) { matter_.begin(bodies); }

void Contacts::search(std::span<BodyState> bodies, const Search& search, const RunContext& context) {
    if (matter_.search(bodies, search.frame, context)) look_near_again();
    if (near_way_ > near_until_ && !world_.obstacles.empty()) {
        find_near(bodies, search.time, search.obstacle_reach, context);
        near_way_ = 0;
        near_until_ = search.obstacle_reach;
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

Contacts::Memory Contacts::memory() const {
    Memory memory{{}, near_way_, near_until_, matter_.memory()};
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
    if (!std::isfinite(memory.near_way) || !std::isfinite(memory.near_until)) return false;
    if (!std::ranges::all_of(memory.near, is_sound) || !matter_.is_sound(memory.matter, bodies)) return false;
    for (NearPoints& near : near_) near = {};
    for (const NearMemory& near : memory.near) {
        const contact_law::Grasp grasp{(near.flags & 1) != 0, (near.flags & 2) != 0};
        near_[near.body].points.push_back({near.obstacle, near.point, 0, grasp, near.anchor});
        near_[near.body].clear_until.push_back(near.clear_until);
    }
    for (NearPoints& near : near_) near.pad();
    near_way_ = memory.near_way;
    near_until_ = memory.near_until;
    matter_.set_memory(memory.matter, bodies);
    return true;
}

} // namespace filigree
