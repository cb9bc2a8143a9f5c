// Which cell of a fracture a point belongs to.
#pragma once

#include "filigree/core/run_context.h"
#include "filigree/core/types.h"

#include <memory>

namespace filigree {

class CrackWarp;
struct CellFace;
struct GridSeeds;

/// How cracks bend: fractal noise and a stretch of space. Lengths are in model units, points relative to the mesh's
/// origin.
struct CrackWarpOptions {
    Box box;                 ///< of what is cut
    double roughness = 0;    ///< 0: cracks are planes; 1: as rough as space may be bent without folding
    double wavelength = 0;   ///< of the coarsest bumps; above 0 where roughness is
    Vec3d grain = {0, 0, 1}; ///< unit vector along which pieces are longer
    double stretch = 1;      ///< how many times longer, 1 or more
    std::uint64_t seed = 1;
};

/// Voronoi (power) cells of seeds in a warped space: what a body or a mesh breaks into. A mesh and a body that are
/// asked about the same point agree. Copies share the cells and have pieces of their own.
class FractureCells {
public:
    /// seeds: in model units, relative to the mesh's origin, inside options.box; where two fall on one point of the
    /// grid (1/500,000 of the box), the second gets no cell. weights: empty or one a seed, model units squared: a cell
    /// grows where its weight is above its neighbours'. Cost: O(N) a cell for distances and about 15 exact cuts, all of
    /// the N seeds for cells at the border. Errors: unsuitable (no seed, more than kMostSeeds, numbers that are not
    /// finite, weights beyond the box's extent squared), cancelled.
    static Result<FractureCells> create(std::span<const Vec3d> seeds, std::span<const double> weights,
                                        const CrackWarpOptions& options, const RunContext& context);
    ~FractureCells();
    FractureCells(const FractureCells&);
    FractureCells& operator=(const FractureCells&);
    FractureCells(FractureCells&&) noexcept;
    FractureCells& operator=(FractureCells&&) noexcept;

    /// Cells are named by their seeds; some may be empty.
    Index count() const;
    /// The cell that holds the point. near: where to begin, any cell, best one close by; the answer does not depend on
    /// it. Cost: a walk from cell to cell, about 15 products a step.
    Index cell_at(const Vec3d& point, Index near = kNoIndex) const { return cell_at(on_grid(point), near); }
    std::span<const Index> neighbours(Index cell) const;

    /// Makes cells pieces together: the number of each cell's piece, every number from 0 on taken by a cell or more.
    /// Until then each cell is a piece, with its own number. There are no cracks inside a piece. Errors: usage (not one
    /// a cell, a number left out).
    Status merge(std::vector<Index> piece_of_cell);
    Index pieces() const { return pieces_.empty() ? count() : piece_count_; }
    Index piece_of(Index cell) const { return pieces_.empty() ? cell : pieces_[cell]; }
    Index piece_at(const Vec3d& point) const { return piece_of(cell_at(point)); }

    static constexpr Index kMostSeeds = 100'000;

    // For fracture() itself: cells on the grid of integers on which all decisions are exact.
    using GridPoint = std::array<std::int64_t, 3>;
    Index cell_at(const GridPoint& point, Index near = kNoIndex) const;
    GridPoint on_grid(const Vec3d& point) const;
    const CrackWarp& warp() const;
    const GridSeeds& grid() const;
    const std::vector<CellFace>& cell(Index seed) const;

private:
    struct Diagram;
    explicit FractureCells(std::shared_ptr<const Diagram> diagram);

    std::shared_ptr<const Diagram> diagram_;
    std::vector<Index> pieces_; ///< of each cell; empty: its own number
    Index piece_count_ = 0;
};

} // namespace filigree
