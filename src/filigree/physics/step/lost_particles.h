// Particles whose numbers are no numbers. Private to the layer.
#pragma once

#include "filigree/physics/step/simulation_state.h"

namespace filigree {

/// Particles of which a place or velocity is not finite return to where they were at rest beside the others, and move
/// as the body does. Where nothing of a body is finite it stands where it was put, at rest. Bodies on the grid repair
/// what else they carry. Returns how many particles were repaired.
std::size_t hold_lost_particles(SimulationState& state);
/// The same of one body.
std::size_t hold_lost_particles(SimulationState& state, BodyState& body);

/// Remembers the first particle of a frame that was repaired or held, for the report.
void note_lost(SimulationState& state, const BodyState& body, std::size_t particle);
/// Puts it into the report, and forgets it.
void tell_first_lost(SimulationState& state, FrameReport& report);

} // namespace filigree
