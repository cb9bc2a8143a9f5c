// Which cell of a fracture a point belongs to.
#pragma once

#include "filigree/fracture/crack_warp.h"
#include "filigree/fracture/voronoi.h"
#include "filigree/mesh/edges.h"

namespace filigree {

/// Voronoi (power) cells of seeds in a warped space: what a body or a mesh breaks into. Two meshes, or a mesh and a
/// body, that are asked about the same point agree.
class FractureCells {
public:
    /// seeds: in model units, relative to the mesh's origin, inside options.box; where two fall on one point of the
    /// grid (1/500,000 of the box), the second gets no cell. weights: empty or one a seed, model units squared: a cell
    /// grows where its weight is above its neighbours'. Cost: see voronoi_cells. Errors: unsuitable (no seed, more than
    /// kMostSeeds, numbers that are not finite, weights beyond the box's extent squared), cancelled.
    static Result<FractureCells> create(std::span<const Vec3d> seeds, std::span<const double> weights,
                                        const CrackWarpOptions& options, const RunContext& context);

    /// Cells are named by their seeds; some may be empty.
    Index count() const { return grid_.count; }
    /// The cell that holds the point. near: where to begin, any cell, best one close by; the answer does not depend on
    /// it. Cost: a walk from cell to cell, about 15 products a step.
    Index cell_at(const Vec3d& point, Index near = kNoIndex) const { return cell_at(on_grid(point), near); }
    Index cell_at(const GridPoint& point, Index near = kNoIndex) const;
    GridPoint on_grid(const Vec3d& point) const;

    /// Makes cells pieces together: the number of each cell's piece, every number from 0 on taken by a cell or more.
    /// Until then each cell is a piece, with its own number. There are no cracks inside a piece. Errors: usage (not one
    /// a cell, a number left out).
    Status merge(std::vector<Index> piece_of_cell);
    Index pieces() const { return pieces_.empty() ? count() : piece_count_; }
    Index piece_of(Index cell) const { return pieces_.empty() ? cell : pieces_[cell]; }
    Index piece_at(const Vec3d& point) const { return piece_of(cell_at(point)); }
    std::span<const Index> neighbours(Index cell) const { return neighbours_[cell]; }

    const CrackWarp& warp() const { return warp_; }
    const GridSeeds& grid() const { return grid_; }
    const VoronoiCell& cell(Index seed) const { return cells_[seed]; }

    static constexpr Index kMostSeeds = 100'000;

private:
    FractureCells(const CrackWarp& warp) : warp_(warp) {}

    CrackWarp warp_;
    GridSeeds grid_;
    std::vector<VoronoiCell> cells_;
    IndexLists neighbours_;     ///< of each cell, without ghosts
    Index first_ = 0;           ///< a cell that is not empty
    std::vector<Index> pieces_; ///< of each cell; empty: its own number
    Index piece_count_ = 0;
};

} // namespace filigree
