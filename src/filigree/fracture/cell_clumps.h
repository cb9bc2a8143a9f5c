// Pieces of several cells. Private to the layer.
#pragma once

#include "filigree/fracture.h"

namespace filigree {

/// A piece for each cell, for FractureCells::merge: the clump of the fewest cells joins a neighbour of the fewest,
/// until as many are left as are wanted. Neighbours touch in the matter, that is between points. points: of the matter,
/// about `spacing` apart; model units. Cost O(points log points + cells log cells).
std::vector<Index> cell_clumps(std::span<const Vec3d> points, double spacing, const FractureCells& cells, Index wanted,
                               std::uint64_t seed);

} // namespace filigree
