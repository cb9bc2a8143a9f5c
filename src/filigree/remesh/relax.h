// Even quads: vertices slid over the surface until their quads are good, and none is turned inside out.
#pragma once

#include "filigree/remesh/patch_grid.h"

namespace filigree {

/// Whether so many quads are inverted that `untangle` does not try: another base will do better. Cost O(quads).
bool is_hopeless(const PatchGrid& grid);

/// Moves every vertex towards the area-weighted mean of its neighbours, on the surface, along curves; a move that
/// makes a quad worse than it was and than a scaled Jacobian of 0.5, or turns one over, is not made. Tips that are held
/// stay.
/// Cost O(vertices x sweeps), in parallel; same result for any number of threads.
void relax(PatchGrid& grid, const SurfaceWalk& walk, unsigned sweeps, const RunContext& context);

struct Untangled {
    std::size_t inverted = 0;    ///< quads left whose scaled Jacobian is not above zero
    std::size_t off_surface = 0; ///< vertices that had to leave the surface
};

/// Searches around every quad whose scaled Jacobian is below `least` for better places: on the surface first, then, for
/// those not above zero, off it; tips near those are let go first. Nothing is tried when too many are inverted from the
/// start. Cost O(bad quads).
Untangled untangle(PatchGrid& grid, const SurfaceWalk& walk, double least, const RunContext& context);

} // namespace filigree
