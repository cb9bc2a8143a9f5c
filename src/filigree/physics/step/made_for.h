// Which simulation a saved state is of. Private to the layer.
#pragma once

#include "filigree/physics/simulation.h"

namespace filigree {

/// Hashes of all that stays as it is while a simulation runs. Not of where bodies begin, which the state says itself,
/// nor of what may be set meanwhile: hands, forces on particles, air and heat sources.
struct MadeFor {
    std::uint64_t bodies = 0, world = 0, options = 0;
    bool operator==(const MadeFor&) const = default;
};

/// Cost O(particles). actors: before any became rigid.
MadeFor made_for(const World& world, std::span<const Actor> actors, const StepOptions& options);

/// Errors: mismatch (a sentence that says what differs).
Status check_same(const MadeFor& saved, const MadeFor& here);

} // namespace filigree
