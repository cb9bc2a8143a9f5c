// Cells that are inside out. Private to the layer.
#pragma once

#include "filigree/physics/simulation.h"
#include "filigree/physics/step/simulation_state.h"

namespace filigree {

/// As Simulation::inverted.
InvertedCells inverted_cells(const SimulationState& state, std::size_t actor);

} // namespace filigree
