// When rigid bodies sleep. Private to the layer.
#pragma once

#include "filigree/physics/step/simulation_state.h"

namespace filigree {

/// After a frame: rigid bodies that rest and have hardly moved for a while sleep. They wake when anything moves them,
/// and when what held them has gone.
void let_rest(SimulationState& state, double from, double until);

} // namespace filigree
