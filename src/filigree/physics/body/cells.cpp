#include "filigree/physics/body/make_cells.h"

#include "filigree/core/parallel_for.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace filigree {

namespace {

using LatticeIndex = Cells::LatticeIndex;

bool comes_before(const LatticeIndex& a, const LatticeIndex& b) {
    return std::tie(a[2], a[1], a[0]) < std::tie(b[2], b[1], b[0]);
}

std::vector<Cells::Run> find_runs(const std::vector<LatticeIndex>& cells) {
    std::vector<Cells::Run> runs;
    for (std::size_t c = 0; c < cells.size(); ++c) {
        const bool continues = c > 0 && cells[c - 1][2] == cells[c][2] && cells[c - 1][1] == cells[c][1] &&
                               cells[c - 1][0] + 1 == cells[c][0];
        if (continues)
            ++runs.back().count;
        else
            runs.push_back({Index(c), 1, {}});
    }
    return runs;
}

/// One of the four rows of corners that a run of cells has.
struct CornerRow {
    LatticeIndex first;
    Index run;
    std::uint8_t row;
};

/// Corners, and where each run's rows of them begin: the union of all rows' intervals along x.
void make_corners(Cells& cells) {
    std::vector<CornerRow> rows;
    rows.reserve(4 * cells.runs.size());
    for (std::size_t r = 0; r < cells.runs.size(); ++r) {
        const LatticeIndex& first = cells.cells[cells.runs[r].first_cell];
        for (unsigned row = 0; row < 4; ++row)
            rows.push_back({{first[0], std::uint16_t(first[1] + (row & 1)), std::uint16_t(first[2] + (row >> 1))},
                            Index(r),
                            std::uint8_t(row)});
    }
    std::sort(rows.begin(), rows.end(), [](const CornerRow& a, const CornerRow& b) {
        if (a.first != b.first) return comes_before(a.first, b.first);
        return a.run < b.run;
    });
    for (const CornerRow& row : rows) {
        Cells::Run& run = cells.runs[row.run];
        unsigned next = row.first[0]; // the first corner of this row that is not there yet
        const unsigned end = next + run.count + 1;
        if (!cells.corners.empty()) {
            const LatticeIndex& last = cells.corners.back();
            if (last[2] == row.first[2] && last[1] == row.first[1] && last[0] >= next) next = last[0] + 1u;
        }
        run.rows[row.row] = Index(cells.corners.size() - (next - row.first[0]));
        for (; next < end; ++next) cells.corners.push_back({std::uint16_t(next), row.first[1], row.first[2]});
    }
}

} // namespace

Cells lattice_cells(std::vector<LatticeIndex> indices, double spacing, const Vec3d& origin) {
    std::sort(indices.begin(), indices.end(), comes_before);
    indices.erase(std::unique(indices.begin(), indices.end()), indices.end());
    Cells cells;
    cells.spacing = spacing;
    cells.origin = origin;
    cells.cells = std::move(indices);
    cells.runs = find_runs(cells.cells);
    make_corners(cells);

    const std::size_t count = cells.cells.size();
    cells.cell_corners.resize(count);
    for (const Cells::Run& run : cells.runs)
        for (Index c = 0; c < run.count; ++c)
            for (unsigned corner = 0; corner < 8; ++corner)
                cells.cell_corners[run.first_cell + c][corner] = run.rows[corner >> 1] + c + (corner & 1);
    cells.fraction.assign(count, 1.0f);
    cells.centroid.resize(count);
    for (std::size_t c = 0; c < count; ++c) {
        const LatticeIndex& index = cells.cells[c];
        const Vec3d centre(index[0] + 0.5, index[1] + 0.5, index[2] + 0.5);
        cells.centroid[c] = (origin + spacing * centre).cast<float>();
    }
    return cells;
}

Cells box_cells(std::size_t nx, std::size_t ny, std::size_t nz, double spacing, const Vec3d& origin) {
    std::vector<LatticeIndex> indices;
    indices.reserve(nx * ny * nz);
    for (std::size_t k = 0; k < nz; ++k)
        for (std::size_t j = 0; j < ny; ++j)
            for (std::size_t i = 0; i < nx; ++i)
                indices.push_back({std::uint16_t(i), std::uint16_t(j), std::uint16_t(k)});
    return lattice_cells(std::move(indices), spacing, origin);
}

Index Cells::find_cell(int i, int j, int k) const {
    constexpr int kMost = 65535;
    if (i < 0 || j < 0 || k < 0 || i > kMost || j > kMost || k > kMost) return kNoIndex;
    const LatticeIndex index = {std::uint16_t(i), std::uint16_t(j), std::uint16_t(k)};
    const auto found = std::lower_bound(cells.begin(), cells.end(), index, comes_before);
    return found != cells.end() && *found == index ? Index(found - cells.begin()) : kNoIndex;
}

Index Cells::find_cell(const Vec3d& at) const {
    const Vec3d low = at.array().floor();
    if (!((low.array() >= 0).all() && (low.array() <= 65535).all())) return kNoIndex;
    if (!homes.empty()) {
        const LatticeIndex index = {std::uint16_t(low[0]), std::uint16_t(low[1]), std::uint16_t(low[2])};
        const Vec3d cube = (kHomesAlong * (at - low)).array().floor().min(kHomesAlong - 1.0);
        const unsigned bit = unsigned(cube[0] + kHomesAlong * (cube[1] + kHomesAlong * cube[2]));
        for (auto home = std::ranges::lower_bound(homes, index, comes_before, &Home::at);
             home != homes.end() && home->at == index; ++home)
            if (home->cubes >> bit & 1) return home->cell;
    }
    return find_cell(int(low[0]), int(low[1]), int(low[2]));
}

bool Cells::are_joined(Index cell, Index neighbour) const {
    if (!is_parted()) return true;
    for (const Index corner : cell_corners[cell])
        if (std::ranges::find(cell_corners[neighbour], corner) != cell_corners[neighbour].end()) return true;
    return false;
}

namespace {

/// corner_gradients where corners have copies.
void gradients_by_cells(const Cells& cells, const Vectors& positions, std::span<Mat3f> gradients) {
    std::ranges::fill(gradients, Mat3f::Zero());
    std::vector<float> weights(gradients.size(), 0.0f);
    const float scale = float(0.25 / cells.spacing);
    for (Index c = 0; c < cells.cells.size(); ++c) {
        Mat3f gradient = Mat3f::Zero();
        for (int corner = 0; corner < 8; ++corner)
            for (int axis = 0; axis < 3; ++axis) {
                const Vec3f p = positions[cells.cell_corners[c][corner]];
                gradient.col(axis) += corner >> axis & 1 ? p : Vec3f(-p);
            }
        gradient *= cells.fraction[c] * scale;
        for (const Index corner : cells.cell_corners[c]) {
            gradients[corner] += gradient;
            weights[corner] += cells.fraction[c];
        }
    }
    for (std::size_t corner = 0; corner < gradients.size(); ++corner) gradients[corner] *= 1 / weights[corner];
}

} // namespace

void corner_gradients(const Cells& cells, const Vectors& positions, std::span<Mat3f> gradients,
                      const RunContext& context) {
    if (cells.is_parted()) return gradients_by_cells(cells, positions, gradients);
    // Layers of cells by their k: those of even k share no corner, so they can go at the same time; then those of odd
    // k. So each corner adds up its cells in the same order whatever the number of threads.
    std::vector<std::array<std::size_t, 2>> layers[2];
    for (std::size_t r = 0; r < cells.runs.size();) {
        const std::size_t begin = r;
        const unsigned k = cells.cells[cells.runs[r].first_cell][2];
        while (r < cells.runs.size() && cells.cells[cells.runs[r].first_cell][2] == k) ++r;
        layers[k % 2].push_back({begin, r});
    }
    std::fill(gradients.begin(), gradients.end(), Mat3f::Zero());
    std::vector<float> weights(gradients.size(), 0.0f);

    const float scale = float(0.25 / cells.spacing);
    const auto add_run = [&](const Cells::Run& run) {
        // Sums over the four corners of a side of the cell: all; up in y less down in y; likewise in z.
        struct Side {
            Vec3f sum, y, z;
        };
        const auto side = [&](Index c) {
            const Vec3f a = positions[run.rows[0] + c], b = positions[run.rows[1] + c];
            const Vec3f d = positions[run.rows[2] + c], e = positions[run.rows[3] + c];
            return Side{(a + b) + (d + e), (b - a) + (e - d), (d - a) + (e - b)};
        };
        Side low = side(0);
        for (Index c = 0; c < run.count; ++c) {
            const Side high = side(c + 1);
            const float fraction = cells.fraction[run.first_cell + c];
            Mat3f gradient;
            gradient.col(0) = high.sum - low.sum;
            gradient.col(1) = high.y + low.y;
            gradient.col(2) = high.z + low.z;
            gradient *= fraction * scale;
            for (const Index row : run.rows)
                for (const Index corner : {row + c, row + c + 1}) {
                    gradients[corner] += gradient;
                    weights[corner] += fraction;
                }
            low = high;
        }
    };
    for (const auto& some : layers)
        parallel_for(context, some.size(), 1, [&](std::size_t begin, std::size_t end) {
            for (std::size_t layer = begin; layer < end; ++layer)
                for (std::size_t r = some[layer][0]; r < some[layer][1]; ++r) add_run(cells.runs[r]);
        });
    parallel_for(context, gradients.size(), 4096, [&](std::size_t begin, std::size_t end) {
        for (std::size_t c = begin; c < end; ++c) gradients[c] *= 1 / weights[c];
    });
}

} // namespace filigree
