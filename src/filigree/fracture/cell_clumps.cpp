#include "filigree/fracture/cell_clumps.h"

#include "filigree/core/disjoint_sets.h"
#include "filigree/core/random.h"

#include <array>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

namespace filigree {

namespace {

/// How many pairs of points, side by side in the matter, any two cells have between them.
std::map<std::array<Index, 2>, std::size_t> contacts_of(std::span<const Vec3d> points_inside, double spacing,
                                                        std::span<const Index> cell) {
    std::map<std::array<std::int64_t, 3>, std::vector<Index>> cubes;
    for (Index k = 0; k < points_inside.size(); ++k) {
        std::array<std::int64_t, 3> at;
        for (int axis = 0; axis < 3; ++axis) at[axis] = std::int64_t(std::floor(points_inside[k][axis] / spacing));
        cubes[at].push_back(k);
    }
    std::map<std::array<Index, 2>, std::size_t> contacts;
    for (const auto& [at, points] : cubes)
        for (int side = -1; side < 3; ++side) {
            std::array<std::int64_t, 3> beside = at;
            if (side >= 0) ++beside[side];
            const auto others = cubes.find(beside);
            if (others == cubes.end()) continue;
            for (const Index a : points)
                for (const Index b : others->second)
                    if (cell[a] != cell[b]) ++contacts[{std::min(cell[a], cell[b]), std::max(cell[a], cell[b])}];
        }
    return contacts;
}

/// Cells that hold none of the points go along with a neighbour.
void join_empty_cells(const FractureCells& cells, std::vector<bool> holds, DisjointSets& sets) {
    for (bool any = true; any;) {
        any = false;
        for (Index c = 0; c < cells.count(); ++c) {
            if (holds[c]) continue;
            for (const Index other : cells.neighbours(c))
                if (holds[other]) {
                    sets.join(c, other);
                    any = holds[c] = true;
                    break;
                }
        }
    }
}

} // namespace

std::vector<Index> cell_clumps(std::span<const Vec3d> points, double spacing, const FractureCells& cells, Index wanted,
                               std::uint64_t seed) {
    std::vector<Index> cell(points.size());
    std::vector<bool> holds(cells.count(), false);
    Index near = kNoIndex;
    for (Index k = 0; k < cell.size(); ++k) holds[cell[k] = near = cells.cell_at(points[k], near)] = true;
    std::vector<std::map<Index, std::size_t>> touching(cells.count());
    for (const auto& [pair, count] : contacts_of(points, spacing, cell)) {
        touching[pair[0]][pair[1]] = count;
        touching[pair[1]][pair[0]] = count;
    }
    DisjointSets sets(cells.count());
    std::vector<Index> size(cells.count(), 1);
    using Entry = std::tuple<Index, double, Index>; // cells, chance, clump
    std::set<Entry> order;
    const auto entry = [&](Index clump) { return Entry(size[clump], random_unit(seed + 2, clump), clump); };
    Index left = 0;
    for (Index c = 0; c < cells.count(); ++c)
        if (holds[c]) {
            order.insert(entry(c));
            ++left;
        }
    while (left > wanted && !order.empty()) {
        const Index clump = std::get<2>(*order.begin());
        order.erase(order.begin());
        Index best = kNoIndex;
        for (const auto& [other, count] : touching[clump])
            if (best == kNoIndex || std::pair(size[other], touching[clump][best]) < std::pair(size[best], count))
                best = other;
        if (best == kNoIndex) continue; // nothing touches it any more
        order.erase(entry(best));
        sets.join(clump, best);
        const Index root = sets.root(clump), gone = root == clump ? best : clump;
        size[root] += size[gone];
        touching[root].erase(gone);
        for (const auto& [other, count] : touching[gone]) {
            touching[other].erase(gone);
            if (other == root) continue;
            touching[root][other] += count;
            touching[other][root] = touching[root][other];
        }
        touching[gone].clear();
        order.insert(entry(root));
        --left;
    }
    join_empty_cells(cells, holds, sets);
    std::vector<Index> piece(cells.count(), kNoIndex), of_cell;
    Index pieces = 0;
    for (Index c = 0; c < cells.count(); ++c) {
        Index& number = piece[sets.root(c)];
        if (number == kNoIndex) number = pieces++;
        of_cell.push_back(number);
    }
    return of_cell;
}

} // namespace filigree
