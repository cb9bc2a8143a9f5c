// How bodies come into a simulation. Private to the layer.
#pragma once

#include "filigree/physics/step/simulation_state.h"

namespace filigree {

/// A body where it starts, and why it is rigid (Simulation::why_rigid).
struct Beginning {
    BodyState body;
    std::string why_rigid;
};
/// Rigid where StepOptions::automatic_rigid makes it so. number: the actor's. A body of mpm is on the grid already.
Beginning begin_actor(SimulationState& state, const Actor& actor, std::size_t number, const RunContext& context);

/// A body for each piece of an actor that breaks; they wait. None of others.
std::vector<BodyState> begin_pieces(const Actor& actor, std::size_t number, const RunContext& context);

/// Puts bodies into slots that are free, or that follow the last one.
void take_slots(SimulationState& state, std::size_t first, std::vector<BodyState> bodies);
/// That a body breaks into the pieces that stand in slots from `first_piece` on.
void let_break(SimulationState& state, const Actor& actor, std::size_t slot, std::size_t first_piece);

} // namespace filigree
