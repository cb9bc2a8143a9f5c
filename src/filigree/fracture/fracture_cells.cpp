#include "filigree/fracture/fracture_cells.h"

#include <algorithm>
#include <cmath>
#include <unordered_set>

namespace filigree {

namespace {

constexpr std::int64_t kGridEnd = std::int64_t(CrackWarp::kGridHalf);
constexpr std::int64_t kGhostDistance = 8 * kGridEnd;

std::uint64_t packed(const GridPoint& p) {
    std::uint64_t bits = 0;
    for (const std::int64_t x : p) bits = bits << 21 | std::uint64_t(x + kGridEnd);
    return bits;
}

} // namespace

GridPoint FractureCells::on_grid(const Vec3d& point) const {
    const Vec3d q = warp_.to_grid(point);
    GridPoint grid;
    for (int axis = 0; axis < 3; ++axis)
        grid[axis] = std::int64_t(std::llround(std::clamp(q[axis], -CrackWarp::kGridHalf, CrackWarp::kGridHalf)));
    return grid;
}

Result<FractureCells> FractureCells::create(std::span<const Vec3d> seeds, std::span<const double> weights,
                                            const CrackWarpOptions& options, const RunContext& context) {
    if (seeds.empty()) return Error{ErrorCode::unsuitable, "A fracture needs a seed at least."};
    if (seeds.size() > kMostSeeds)
        return Error{ErrorCode::unsuitable, "A fracture has 100,000 seeds at most; ask for fewer pieces."};
    if (!weights.empty() && weights.size() != seeds.size())
        return Error{ErrorCode::unsuitable, "A fracture has one weight a seed, or none."};
    for (const Vec3d& seed : seeds)
        if (!seed.allFinite()) return Error{ErrorCode::unsuitable, "A seed of the fracture is not a finite point."};

    FractureCells cells{CrackWarp(options)};
    GridSeeds& grid = cells.grid_;
    grid.count = static_cast<Index>(seeds.size());
    std::unordered_set<std::uint64_t> taken;
    constexpr std::int64_t kHeaviest = std::int64_t(1) << 36;
    for (std::size_t k = 0; k < seeds.size(); ++k) {
        const GridPoint p = cells.on_grid(seeds[k]);
        const double weight = weights.empty() ? 0 : weights[k] * cells.warp_.scale() * cells.warp_.scale();
        if (!(std::abs(weight) <= double(kHeaviest)))
            return Error{ErrorCode::unsuitable, "A seed's weight is beyond the square of the box's extent."};
        // A seed on another's point is the lightest there can be: it gets no cell.
        const std::int64_t w = taken.insert(packed(p)).second ? std::int64_t(std::llround(weight)) : -2 * kHeaviest;
        grid.points.push_back(p);
        grid.square.push_back(p[0] * p[0] + p[1] * p[1] + p[2] * p[2] - w);
    }
    for (int axis = 0; axis < 3; ++axis)
        for (const int side : {1, -1}) {
            GridPoint ghost = {0, 0, 0};
            ghost[axis] = side * kGhostDistance;
            grid.points.push_back(ghost);
            grid.square.push_back(kGhostDistance * kGhostDistance);
        }

    Result<std::vector<VoronoiCell>> diagram = voronoi_cells(grid, context);
    if (!diagram) return diagram.error();
    cells.cells_ = std::move(*diagram);
    cells.first_ = kNoIndex;
    for (Index k = 0; k < grid.count; ++k) {
        for (const CellFace& face : cells.cells_[k])
            if (!grid.is_ghost(face.neighbour)) cells.neighbours_.items.push_back(face.neighbour);
        cells.neighbours_.offsets.push_back(static_cast<Index>(cells.neighbours_.items.size()));
        if (cells.first_ == kNoIndex && !cells.cells_[k].empty()) cells.first_ = k;
    }
    return cells;
}

Status FractureCells::merge(std::vector<Index> piece_of_cell) {
    if (piece_of_cell.size() != count())
        return Error{ErrorCode::usage, "Cells become pieces by one number for each of them."};
    std::vector<bool> is_taken(count(), false);
    Index pieces = 0;
    for (const Index piece : piece_of_cell) {
        if (piece >= count()) return Error{ErrorCode::usage, "There are no more pieces than cells."};
        is_taken[piece] = true;
        pieces = std::max(pieces, piece + 1);
    }
    if (std::find(is_taken.begin(), is_taken.begin() + pieces, false) != is_taken.begin() + pieces)
        return Error{ErrorCode::usage, "Every piece has a cell."};
    pieces_ = std::move(piece_of_cell);
    piece_count_ = pieces;
    return Success{};
}

Index FractureCells::cell_at(const GridPoint& point, Index near) const {
    Index best = near < count() && !cells_[near].empty() ? near : first_;
    std::int64_t least = grid_.power(best, point);
    // Greedy steps reach the cell: a cell that no neighbour beats is the one.
    for (bool moved = true; moved;) {
        moved = false;
        for (const Index other : neighbours_[best]) {
            const std::int64_t power = grid_.power(other, point);
            if (power < least || (power == least && other < best)) {
                least = power;
                best = other;
                moved = true;
                break;
            }
        }
    }
    return best;
}

} // namespace filigree
