// What changes a simulation between frames: bodies come and go. Private to the layer.
#pragma once

#include "filigree/physics/step/simulation_state.h"

namespace filigree {

/// As Simulation::add_body, of an actor that was checked. Returns its number.
Result<std::size_t> add_body(SimulationState& state, const Actor& actor, const RunContext& context);
/// As Simulation::remove_body, of an actor that is there.
void remove_body(SimulationState& state, std::size_t actor);

/// Gives an obstacle another motion. is_jump: it stands elsewhere.
void set_obstacle(SimulationState& state, const SetMotion& set, bool is_jump);
/// m: how far what is beside bodies goes with an obstacle from one pose to the other, at most; without bodies for ever.
double way_between(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to, std::span<const BodyState> bodies);

} // namespace filigree
