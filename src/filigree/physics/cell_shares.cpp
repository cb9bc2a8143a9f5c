#include "filigree/physics/cell_shares.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

/// A neighbour of a cell, and how much of the cell's matter counts there.
struct CellShare {
    Index cell;
    double share;
};

/// The up to seven neighbours towards the centroid of what a cell holds, by trilinear weights.
std::array<CellShare, 7> shares_of(const Cells& cells, std::size_t c) {
    const auto& index = cells.cells[c];
    const Vec3d centre = cells.origin + cells.spacing * (Vec3d(index[0], index[1], index[2]) + Vec3d::Constant(0.5));
    const Vec3d off = (cells.centroid[c].cast<double>() - centre) / cells.spacing;
    std::array<CellShare, 7> shares;
    for (unsigned corner = 1; corner < 8; ++corner) {
        std::array<int, 3> at = {index[0], index[1], index[2]};
        double share = 1;
        for (unsigned axis = 0; axis < 3; ++axis) {
            const double way = std::min(std::abs(off[axis]), 0.5);
            const bool beside = corner >> axis & 1;
            share *= beside ? way : 1 - way;
            if (beside) at[axis] += off[axis] < 0 ? -1 : 1;
        }
        const Index other = share > 0 ? cells.find_cell(at[0], at[1], at[2]) : kNoIndex;
        shares[corner - 1] = {other, other == kNoIndex ? 0 : share};
    }
    return shares;
}

} // namespace

void share_with_neighbours(Cells& cells) {
    std::vector<double> fraction(cells.fraction.begin(), cells.fraction.end());
    for (std::size_t c = 0; c < cells.cells.size(); ++c) {
        const double own = cells.fraction[c], spare = own - double(Cells::kLeastFraction);
        if (own >= 1 || spare <= 0) continue;
        const std::array<CellShare, 7> shares = shares_of(cells, c);
        double given = 0;
        for (const CellShare& share : shares) given += share.share * own;
        if (!(given > 0)) continue;
        const double part = std::min(1.0, spare / given);
        fraction[c] -= part * given;
        for (const CellShare& share : shares)
            if (share.cell != kNoIndex) fraction[share.cell] += part * share.share * own;
    }
    cells.fraction.assign(fraction.begin(), fraction.end());
}

} // namespace filigree
