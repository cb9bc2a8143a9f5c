#include "filigree/fracture.h"

#include "filigree/core/lists.h"
#include "filigree/fracture/crack_warp.h"
#include "filigree/fracture/voronoi.h"

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

GridPoint grid_point(const CrackWarp& warp, const Vec3d& point) {
    const Vec3d q = warp.to_grid(point);
    GridPoint grid;
    for (int axis = 0; axis < 3; ++axis)
        grid[axis] = std::int64_t(std::llround(std::clamp(q[axis], -CrackWarp::kGridHalf, CrackWarp::kGridHalf)));
    return grid;
}

} // namespace

struct FractureCells::Diagram {
    explicit Diagram(const CrackWarpOptions& options) : warp(options) {}

    CrackWarp warp;
    GridSeeds grid;
    std::vector<VoronoiCell> cells;
    IndexLists neighbours;  ///< of each cell, without ghosts
    Index first = kNoIndex; ///< a cell that is not empty
};

FractureCells::FractureCells(std::shared_ptr<const Diagram> diagram) : diagram_(std::move(diagram)) {}
FractureCells::~FractureCells() = default;
FractureCells::FractureCells(const FractureCells&) = default;
FractureCells& FractureCells::operator=(const FractureCells&) = default;
FractureCells::FractureCells(FractureCells&&) noexcept = default;
FractureCells& FractureCells::operator=(FractureCells&&) noexcept = default;

Index FractureCells::count() const { return diagram_->grid.count; }
std::span<const Index> FractureCells::neighbours(Index cell) const { return diagram_->neighbours[cell]; }
const CrackWarp& FractureCells::warp() const { return diagram_->warp; }
const GridSeeds& FractureCells::grid() const { return diagram_->grid; }
const VoronoiCell& FractureCells::cell(Index seed) const { return diagram_->cells[seed]; }
GridPoint FractureCells::on_grid(const Vec3d& point) const { return grid_point(diagram_->warp, point); }

Result<FractureCells> FractureCells::create(std::span<const Vec3d> seeds, std::span<const double> weights,
                                            const CrackWarpOptions& options, const RunContext& context) {
    if (seeds.empty()) return Error{ErrorCode::unsuitable, "A fracture needs a seed at least."};
    if (seeds.size() > kMostSeeds)
        return Error{ErrorCode::unsuitable, "A fracture has 100,000 seeds at most; ask for fewer pieces."};
    if (!weights.empty() && weights.size() != seeds.size())
        return Error{ErrorCode::unsuitable, "A fracture has one weight a seed, or none."};
    for (const Vec3d& seed : seeds)
        if (!seed.allFinite()) return Error{ErrorCode::unsuitable, "A seed of the fracture is not a finite point."};

    const auto diagram = std::make_shared<Diagram>(options);
    GridSeeds& grid = diagram->grid;
    grid.count = static_cast<Index>(seeds.size());
    std::unordered_set<std::uint64_t> taken;
    constexpr std::int64_t kHeaviest = std::int64_t(1) << 36;
    for (std::size_t k = 0; k < seeds.size(); ++k) {
        const GridPoint p = grid_point(diagram->warp, seeds[k]);
        const double weight = weights.empty() ? 0 : weights[k] * diagram->warp.scale() * diagram->warp.scale();
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

    Result<std::vector<VoronoiCell>> cells = voronoi_cells(grid, context);
    if (!cells) return cells.error();
    diagram->cells = std::move(*cells);
    for (Index k = 0; k < grid.count; ++k) {
        for (const CellFace& face : diagram->cells[k])
            if (!grid.is_ghost(face.neighbour)) diagram->neighbours.items.push_back(face.neighbour);
        diagram->neighbours.offsets.push_back(static_cast<Index>(diagram->neighbours.items.size()));
        if (diagram->first == kNoIndex && !diagram->cells[k].empty()) diagram->first = k;
    }
    return FractureCells(diagram);
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
    const GridSeeds& grid = diagram_->grid;
    Index best = near < grid.count && !diagram_->cells[near].empty() ? near : diagram_->first;
    std::int64_t least = grid.power(best, point);
    // Greedy steps reach the cell: a cell that no neighbour beats is the one.
    for (bool moved = true; moved;) {
        moved = false;
        for (const Index other : diagram_->neighbours[best]) {
            const std::int64_t power = grid.power(other, point);
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
