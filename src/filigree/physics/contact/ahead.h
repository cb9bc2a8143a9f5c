// How far things may go until the next search. Private to the layer.
#pragma once

#include "filigree/physics/contact/contact.h"

namespace filigree {

/// How far obstacles go, and anything may go, until the next search or frame. Pairs ask it for what they may meet.
struct Contacts::Ahead {
    static constexpr float kLeastReach = 0.1f, kMostReach = 0.5f; ///< spacings that bodies may go between two searches
    static constexpr float kLeastToObstacle = 0.25f, kMostToObstacle = 4; ///< the same beside an obstacle
    static constexpr float kOwnSearches = 4; ///< a frame: a body beside itself is searched no more often
    static constexpr float kFaster = 1.5f;   ///< than now, anything may go in the next substep

    std::vector<float> obstacle_frame, obstacle_step; ///< m, of each obstacle
    float frame, step;                                ///< s
    float gained;                                     ///< m/s, by gravity in a frame

    Ahead(const World& world, std::span<const BodyState> bodies, const Search& search)
        : frame(float(search.frame)), step(float(search.step)), gained(float(world.gravity.norm() * search.frame)) {
        for (const Obstacle& obstacle : world.obstacles) {
            const auto way = [&](double seconds) {
                return float(obstacle_way(obstacle.motion, bodies, search.time, search.time + seconds));
            };
            const bool moves = obstacle.motion.moves();
            obstacle_frame.push_back(moves ? way(search.frame) : 0);
            obstacle_step.push_back(moves ? way(search.step) : 0);
        }
    }
    /// m that a pair may go in the next substep. What points are followed beside has to be found before; half-spaces
    /// stop also what is found below them.
    float in_step(const ContactPair& pair) const {
        return pair.is_traced || pair.is_rigid
                   ? kFaster * ((pair.speed + gained) * step + obstacle_step[pair.obstacle()])
                   : 0;
    }
    /// m that a pair may go until it is searched again.
    float reach(const ContactPair& pair) const {
        if (pair.is_of_bodies()) return std::clamp(pair.speed * frame, kLeastReach * pair.spacing, most(pair));
        const float way = (pair.speed + gained) * frame + obstacle_frame[pair.obstacle()];
        if (pair.is_of_edges()) return std::clamp(way, kLeastReach * pair.spacing, most(pair));
        const float wanted = std::clamp(2 * way, kLeastToObstacle * pair.spacing, kMostToObstacle * pair.spacing);
        return std::max(wanted, 2 * in_step(pair));
    }
    static float most(const ContactPair& pair) { return kMostReach * pair.spacing; }
    /// As in_step, of anything that goes so fast, m/s.
    float in_step_of_all(float speed) const {
        const float obstacles = obstacle_step.empty() ? 0 : *std::ranges::max_element(obstacle_step);
        return kFaster * ((speed + gained) * step + obstacles);
    }
};

} // namespace filigree
