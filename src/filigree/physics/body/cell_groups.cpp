// Which cells hang together, and which are thin.
#include "filigree/physics/body/occupied_cells.h"

#include "filigree/core/parallel_for.h"

#include <algorithm>
#include <numeric>

namespace filigree::mesh_cells {

namespace {

constexpr double kLooseFraction = 0.02; // of the largest group's cells

/// For each cell the first cell of its group; cells that share a corner hang together.
std::vector<Index> find_groups(const Cells& cells) {
    // Over corners: a cell joins its eight.
    std::vector<Index> parent(cells.corners.size());
    std::iota(parent.begin(), parent.end(), Index{0});
    const auto root = [&](Index c) {
        while (parent[c] != c) c = parent[c] = parent[parent[c]];
        return c;
    };
    for (const auto& corners : cells.cell_corners)
        for (int n = 1; n < 8; ++n) {
            const Index a = root(corners[0]), b = root(corners[n]);
            parent[std::max(a, b)] = std::min(a, b);
        }
    std::vector<Index> first(cells.corners.size(), kNoIndex), groups(cells.cells.size());
    for (std::size_t c = 0; c < groups.size(); ++c) {
        Index& group = first[root(cells.cell_corners[c][0])];
        if (group == kNoIndex) group = Index(c);
        groups[c] = group;
    }
    return groups;
}

} // namespace

std::vector<std::uint8_t> without_loose_parts(const Cells& cells, std::size_t& loose_parts) {
    const std::vector<Index> groups = find_groups(cells);
    std::vector<std::size_t> sizes(cells.cells.size(), 0);
    for (const Index group : groups) ++sizes[group];
    const double least = sizes.empty() ? 0 : kLooseFraction * double(*std::max_element(sizes.begin(), sizes.end()));
    std::vector<std::uint8_t> kept(groups.size());
    loose_parts = 0;
    for (std::size_t c = 0; c < groups.size(); ++c) {
        kept[c] = double(sizes[groups[c]]) >= least;
        loose_parts += groups[c] == c && !kept[c];
    }
    return kept;
}

std::size_t count_thin(const Cells& cells, const RunContext& context) {
    std::vector<std::uint8_t> thin(cells.cells.size());
    parallel_for(context, thin.size(), 1024, [&](std::size_t begin, std::size_t end) {
        for (std::size_t c = begin; c < end; ++c) {
            const int i = cells.cells[c][0], j = cells.cells[c][1], k = cells.cells[c][2];
            const auto empty = [&](int x, int y, int z) { return cells.find_cell(i + x, j + y, k + z) == kNoIndex; };
            thin[c] = (empty(-1, 0, 0) && empty(1, 0, 0)) || (empty(0, -1, 0) && empty(0, 1, 0)) ||
                      (empty(0, 0, -1) && empty(0, 0, 1));
        }
    });
    return std::size_t(std::count(thin.begin(), thin.end(), 1));
}

} // namespace filigree::mesh_cells
