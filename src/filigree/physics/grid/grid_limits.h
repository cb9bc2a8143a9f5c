// What bodies of the model mpm do not feel, to be told before anything moves.
#pragma once

#include "filigree/physics/simulation.h"

namespace filigree {

/// An obstacle that is thinner, in two directions, than particles of mpm lie apart: matter goes around it.
struct SlenderObstacle {
    std::size_t obstacle = 0;
    double width = 0, spacing = 0; ///< m: the wider of both; between particles
    /// As in "obstacle 'b' is 0.004 m wide, ...", without a full stop.
    std::string sentence(const std::string& obstacle_name) const;
};
/// None where there are no bodies of mpm.
std::vector<SlenderObstacle> find_slender_obstacles(const World& world, std::span<const Actor> actors);

/// A sentence, without a full stop, where there are bodies of mpm and of other models; else "".
std::string why_models_do_not_meet(std::span<const Actor> actors);

} // namespace filigree
