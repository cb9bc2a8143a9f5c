// How cells turn areas, many cells at a time. Private to the layer.
#pragma once

#include "filigree/physics/body.h"

#include <span>

namespace filigree {

/// Where the middles of these runs' cells have turned areas with those normals at rest: unit normals, of the same side
/// of the area where a cell is inverted, zero where nothing is left of the area. Both one a cell. Same bytes on any
/// processor. Cost O(cells).
void turn_cell_normals(std::span<const Cells::Run> runs, const Vectors& positions, const Vectors& at_rest,
                       Vectors& turned);

} // namespace filigree
