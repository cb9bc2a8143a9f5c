// Where the matter of cells that are not full counts.
#pragma once

#include "filigree/physics/body.h"

namespace filigree {

/// Moves a part of what cells that are not full hold to the two neighbours, along each axis, towards which their
/// centroids lie, so that the sum, the mean place and the second moments of all matter stay what they are (for these
/// the matter counts as a slab along each axis): spread over its whole cell, the matter of a surface cell would lie
/// too far out, and a round beam would be too stiff. Fractions below the surface may then be above 1. A cell keeps what
/// it holds where there is no neighbour, and no less than kLeastFraction. For bodies whose particles are corners.
/// Cost O(cells log cells).
void share_with_neighbours(Cells& cells);

} // namespace filigree
