// What is in each cell: its triangles, which of them hang together, and what becomes a piece.
#pragma once

#include "filigree/fracture/crack_surfaces.h"

#include <optional>

namespace filigree {

/// A triangle of one cell's closed surface.
struct CellTriangle {
    Triangle vertices;                        ///< of CutSurface::vertices
    Index cell;                               ///< FractureCells::piece_of: cells that are one piece count as one
    Index part = kNoIndex;                    ///< what hangs together in a cell
    Index uncut = kNoIndex, facet = kNoIndex; ///< one of CutSurface::triangles, or a facet
};

/// Everything that is in cells, the mesh's triangles first, then those on cracks: the two sides of each follow each
/// other.
std::vector<CellTriangle> cell_triangles(const CutSurface& cut, const CrackSurfaces& facets,
                                         const FractureCells& cells);

/// Which piece each part belongs to, and how it came to that.
struct PartPieces {
    std::vector<Index> piece; ///< of each part
    std::size_t cells = 0;    ///< that hold matter
    std::size_t islands = 0;  ///< pieces beyond one a cell
    std::size_t joined = 0;   ///< parts that became one with others
};

/// Fills in CellTriangle::part and says which parts are pieces. Parts below `smallest` of the mean size join the
/// neighbour that they share most with, and shells around cavities the largest part of their cell; unset: each cell is
/// one piece, with the cell's number. Sizes are volumes; of sheets, areas.
PartPieces find_pieces(const CutSurface& cut, std::vector<CellTriangle>& triangles, std::optional<double> smallest,
                       bool is_sheet);

/// Edges at which a piece's triangles do not cancel.
std::size_t count_open_edges(const CutSurface& cut, std::span<const CellTriangle> triangles,
                             std::span<const Index> piece_of_part);

} // namespace filigree
