#include "filigree/physics/breaking/piece_regions.h"

#include "filigree/core/parallel_for.h"

#include <algorithm>
#include <unordered_map>

namespace filigree {

namespace {

constexpr int kBisections = 13;

/// Kuhn's six tetrahedra of a cube, as bits of its corners, each with a positive volume. Neighbouring cubes cut their
/// common side alike.
constexpr std::array<std::array<int, 4>, 6> kTetrahedra = {
    {{0, 1, 3, 7}, {0, 2, 6, 7}, {0, 4, 5, 7}, {0, 3, 2, 7}, {0, 6, 4, 7}, {0, 5, 1, 7}}};

} // namespace

PieceGrid::PieceGrid(const Cells& cells, const Partition& partition, const RunContext& context)
    : cells_(cells), partition_(partition), extents_(partition.count) {
    for (const auto& cell : cells.cells)
        for (int axis = 0; axis < 3; ++axis)
            counts_[axis] = std::max(counts_[axis], 2 * (int(cell[axis]) + 1) + 2 * kMargin + 1);
    std::vector<std::uint8_t> near(index(0, 0, counts_[2]), 0);
    for (const auto& cell : cells.cells)
        for (int k = -2; k <= 4; ++k)
            for (int j = -2; j <= 4; ++j)
                for (int i = -2; i <= 4; ++i)
                    near[index(2 * cell[0] + kMargin + i, 2 * cell[1] + kMargin + j, 2 * cell[2] + kMargin + k)] = 1;
    pieces_.assign(near.size(), kNoIndex);
    const auto row_of = [&](std::size_t row) {
        return std::pair(int(row % std::size_t(counts_[1])), int(row / std::size_t(counts_[1])));
    };
    const std::size_t rows = std::size_t(counts_[1]) * std::size_t(counts_[2]);
    parallel_for(context, rows, 8, [&](std::size_t begin, std::size_t end) {
        for (std::size_t row = begin; row < end; ++row) {
            const auto [j, k] = row_of(row);
            for (int i = 0; i < counts_[0]; ++i)
                if (near[index(i, j, k)]) pieces_[index(i, j, k)] = partition.piece_at(point(i, j, k));
        }
    });
    for (auto& extent : extents_) extent = {counts_, {-1, -1, -1}};
    for (std::size_t row = 0; row < rows; ++row) {
        const auto [j, k] = row_of(row);
        for (int i = 0; i < counts_[0]; ++i) {
            const Index piece = pieces_[index(i, j, k)];
            if (piece == kNoIndex) continue;
            auto& [low, high] = extents_[piece];
            const std::array<int, 3> at = {i, j, k};
            for (int axis = 0; axis < 3; ++axis) {
                low[axis] = std::min(low[axis], at[axis]);
                high[axis] = std::max(high[axis], at[axis]);
            }
        }
    }
}

bool PieceGrid::is_pure(Index cell) const {
    const auto& at = cells_.cells[cell];
    const Index first = at_centre(cell);
    for (int n = 0; n < 27; ++n)
        if (pieces_[index(2 * at[0] + kMargin + n % 3, 2 * at[1] + kMargin + n / 3 % 3, 2 * at[2] + kMargin + n / 9)] !=
            first)
            return false;
    return true;
}

Index PieceGrid::at_centre(Index cell) const {
    const auto& at = cells_.cells[cell];
    return pieces_[index(2 * at[0] + kMargin + 1, 2 * at[1] + kMargin + 1, 2 * at[2] + kMargin + 1)];
}

/// Where between two points, 0 to 1, the piece ends. The same seen from the piece on the other side.
double PieceGrid::crossing(Index piece, const Vec3d& from, const Vec3d& to, Index at_from, Index at_to) const {
    if (at_from == kNoIndex || at_to == kNoIndex) return 0.5;
    const bool starts_inside = at_from == piece;
    double low = 0, high = 1;
    for (int step = 0; step < kBisections; ++step) {
        const double middle = 0.5 * (low + high);
        const bool inside = partition_.piece_at(from + middle * (to - from)) == piece;
        (inside == starts_inside ? low : high) = middle;
    }
    return 0.5 * (low + high);
}

PieceGrid::Region PieceGrid::region(Index piece) const {
    Region region;
    std::unordered_map<std::uint64_t, Index> crossings; // of edges: the lower grid point, and which way
    const auto [low, high] = extents_[piece];
    for (int k = low[2] - 1; k <= high[2]; ++k)
        for (int j = low[1] - 1; j <= high[1]; ++j)
            for (int i = low[0] - 1; i <= high[0]; ++i) {
                std::array<Index, 8> label;
                int inside = 0;
                for (int c = 0; c < 8; ++c) {
                    label[c] = pieces_[index(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2))];
                    inside += label[c] == piece;
                }
                if (inside == 0 || inside == 8) continue;
                const auto lattice = [](int g) { return (g - kMargin) >> 1; };
                const Index cell = cells_.find_cell(lattice(i), lattice(j), lattice(k));
                const auto vertex = [&](int a, int b) { // on the edge between two corners
                    const int from = std::min(a, b), to = std::max(a, b);
                    const auto grid = [&](int c) { return std::array{i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)}; };
                    const auto p = grid(from), q = grid(to);
                    const std::uint64_t key = 8 * std::uint64_t(index(p[0], p[1], p[2])) + std::uint64_t(to - from);
                    const auto [found, is_new] = crossings.try_emplace(key, Index(region.positions.size()));
                    if (is_new) {
                        const Vec3d start = point(p[0], p[1], p[2]), end = point(q[0], q[1], q[2]);
                        const double t = crossing(piece, start, end, label[from], label[to]);
                        region.positions.push_back((start + t * (end - start)).cast<float>());
                    }
                    return found->second;
                };
                const auto add = [&](Index a, Index b, Index c) {
                    region.triangles.push_back({a, b, c});
                    region.cells.push_back(cell);
                };
                for (const auto& corners : kTetrahedra) {
                    std::array<int, 4> order = {0, 1, 2, 3}; // those inside first, by an even permutation
                    int count = 0;
                    const auto is_in = [&](int n) { return label[corners[order[n]]] == piece; };
                    for (int n = 0; n < 4; ++n) count += is_in(n);
                    if (count == 0 || count == 4) continue;
                    int swaps = 0;
                    for (int n = 0, first = 0; n < 4; ++n)
                        if (is_in(n)) {
                            if (n != first) {
                                std::swap(order[n], order[first]);
                                ++swaps;
                            }
                            ++first;
                        }
                    // The odd one out stays in its place; an odd number of swaps turns the others.
                    if (swaps % 2) count == 1 ? std::swap(order[2], order[3]) : std::swap(order[0], order[1]);
                    const int a = corners[order[0]], b = corners[order[1]], c = corners[order[2]],
                              d = corners[order[3]];
                    if (count == 1)
                        add(vertex(a, b), vertex(a, c), vertex(a, d));
                    else if (count == 3)
                        add(vertex(d, a), vertex(d, b), vertex(d, c));
                    else {
                        add(vertex(a, c), vertex(a, d), vertex(b, d));
                        add(vertex(a, c), vertex(b, d), vertex(b, c));
                    }
                }
            }
    return region;
}

} // namespace filigree
