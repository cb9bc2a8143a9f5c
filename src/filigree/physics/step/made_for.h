// Which simulation a saved state is of. Private to the layer.
#pragma once

#include "filigree/physics/simulation.h"

namespace filigree {

/// Hashes of all that stays as it is while a simulation runs, but for bodies that come and go. Not of where bodies
/// begin, which the state says itself, nor of what may be set meanwhile: hands, forces on particles, air and heat
/// sources.
struct MadeFor {
    std::uint64_t bodies = 0, world = 0, options = 0;
    bool operator==(const MadeFor&) const = default;
};

/// Of a world and options; of bodies there are none yet.
MadeFor made_for(const World& world, const StepOptions& options);
/// Of an actor before it became rigid. Cost O(particles).
std::uint64_t made_of(const Actor& actor);
/// MadeFor::bodies: of each actor where it stands (SimulationState::slot_of) and what it is made of.
std::uint64_t made_of_all(std::span<const Index> slots, std::span<const std::uint64_t> actors);

/// Errors: mismatch (a sentence that says what differs).
Status check_same(const MadeFor& saved, const MadeFor& here);

} // namespace filigree
