// The Voronoi (power) diagram of seeds on the grid, as combinatorics.
#pragma once

#include "filigree/context.h"
#include "filigree/fracture/cell_signs.h"

namespace filigree {

/// Three other cells that meet a cell at one of its corners, ascending.
using CellCorner = std::array<Index, 3>;

/// Where a cell touches another.
struct CellFace {
    Index neighbour = 0;
    std::vector<CellCorner> corners; ///< counter-clockwise seen from outside the cell; three or more
};

/// A cell's faces, ghosts' among them; none where weights leave it no room.
using VoronoiCell = std::vector<CellFace>;

/// Every cell but the ghosts'. Cost O(N) a cell for distances, and about 15 exact cuts; all seeds are tried for cells
/// at the diagram's border. Errors: cancelled.
Result<std::vector<VoronoiCell>> voronoi_cells(const GridSeeds& seeds, const RunContext& context);

/// Where the cells i, j, k and l meet, on the grid. Equal places give equal numbers.
Vec3d voronoi_vertex(const GridSeeds& seeds, Index i, Index j, Index k, Index l);

} // namespace filigree
