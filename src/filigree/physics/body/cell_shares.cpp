#include "filigree/physics/body/cell_shares.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

constexpr float kLeastSecond = 0.5f; // how full a second neighbour is, whose share is below 0

/// Parts of a cell's matter, of sum 1, for the cell and the next ones along an axis.
using AxisShares = std::array<double, 3>;

/// off: of the centroid from the middle, up to half a cell. Exact in the sum and the mean; with two neighbours also in
/// the second moment of a slab at the far side, which is 1 - 2 off thick.
AxisShares axis_shares(double off, int neighbours) {
    if (neighbours == 0) return {1, 0, 0};
    if (neighbours == 1) return {1 - off, off, 0};
    const double thickness = 1 - 2 * off, narrower = (thickness * thickness - 1) / 12; // variance, less a cell's
    const double second = (off * off + narrower - off) / 2, first = off - 2 * second;
    return {1 - first - second, first, second};
}

struct CellShare {
    Index cell;
    double share;
};

/// What of a cell's matter counts in other cells; `shares` is overwritten. most: neighbours along an axis, 1 or 2.
void find_shares(const Cells& cells, std::size_t c, int most, std::vector<CellShare>& shares) {
    const auto& index = cells.cells[c];
    const Vec3d centre = cells.origin + cells.spacing * (Vec3d(index[0], index[1], index[2]) + Vec3d::Constant(0.5));
    const Vec3d off = (cells.centroid[c].cast<double>() - centre) / cells.spacing;
    const auto cell_at = [&](int i, int j, int k) {
        const auto way = [&](int axis) { return off[axis] < 0 ? -1 : 1; };
        const std::array<int, 3> to = {index[0] + i * way(0), index[1] + j * way(1), index[2] + k * way(2)};
        if (!cells.is_parted()) return cells.find_cell(to[0], to[1], to[2]);
        std::array<int, 3> at = {index[0], index[1], index[2]}; // step by step, through what hangs together
        Index last = Index(c);
        for (int axis = 0; axis < 3; ++axis)
            while (at[axis] != to[axis] && last != kNoIndex) {
                at[axis] += way(axis);
                const Index next = cells.find_cell(at[0], at[1], at[2]);
                last = next != kNoIndex && cells.are_joined(last, next) ? next : kNoIndex;
            }
        return last;
    };
    std::array<AxisShares, 3> along;
    for (int axis = 0; axis < 3; ++axis) {
        const auto next = [&](int n) { return cell_at(n * (axis == 0), n * (axis == 1), n * (axis == 2)); };
        int neighbours = 0;
        if (off[axis] != 0 && next(1) != kNoIndex) {
            const Index second = most == 2 ? next(2) : kNoIndex;
            neighbours = second != kNoIndex && cells.fraction[second] >= kLeastSecond ? 2 : 1;
        }
        along[std::size_t(axis)] = axis_shares(std::min(std::abs(off[axis]), 0.5), neighbours);
    }
    shares.clear();
    for (int k = 0; k < 3; ++k)
        for (int j = 0; j < 3; ++j)
            for (int i = 0; i < 3; ++i) {
                const double share = along[0][std::size_t(i)] * along[1][std::size_t(j)] * along[2][std::size_t(k)];
                if (i + j + k == 0 || share == 0) continue;
                if (const Index cell = cell_at(i, j, k); cell != kNoIndex) shares.push_back({cell, share});
            }
}

std::vector<double> shared_fractions(const Cells& cells, int most) {
    std::vector<double> fraction(cells.fraction.begin(), cells.fraction.end());
    std::vector<CellShare> shares;
    for (std::size_t c = 0; c < cells.cells.size(); ++c) {
        const double own = cells.fraction[c], spare = own - double(Cells::kLeastFraction);
        if (own >= 1 || spare <= 0) continue;
        find_shares(cells, c, most, shares);
        double given = 0;
        for (const CellShare& share : shares) given += share.share * own;
        if (!(given > 0)) continue;
        const double part = std::min(1.0, spare / given);
        fraction[c] -= part * given;
        for (const CellShare& share : shares) fraction[share.cell] += part * share.share * own;
    }
    return fraction;
}

} // namespace

void share_with_neighbours(Cells& cells) {
    std::vector<double> fraction = shared_fractions(cells, 2);
    for (std::size_t c = 0; c < fraction.size(); ++c)
        if (fraction[c] < 0.999 * double(Cells::kLeastFraction)) { // too small a body for shares below 0
            fraction = shared_fractions(cells, 1);
            break;
        }
    cells.fraction.assign(fraction.begin(), fraction.end());
}

} // namespace filigree
