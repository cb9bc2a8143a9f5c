#include "filigree/physics/body/occupied_cells.h"
#include "filigree/core/math.h"
#include "filigree/sample/closure.h"
#include "filigree/sample/inside_scan.h"

#include "filigree/core/parallel_for.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <tuple>
#include <utility>

namespace filigree::mesh_cells {

namespace {

constexpr double kMostGridCells = 0x1p30; // of the box, one byte each
constexpr std::size_t kMostAlong = 16383; // times four samples: what scan_inside takes on an axis
// Samples a cell along each axis: a closed mesh is scanned at a nanosecond each, a winding number takes microseconds.
constexpr unsigned kSamples = 4, kWindingSamples = 2;
// Where cells are few, how full those are that were found is looked at more closely: they are what bends.
constexpr unsigned kCloserSamples = 8;
constexpr double kMostCloserPoints = 0x1p24;
constexpr double kMostWindings = 0x1p20; // beyond, one sample a cell
constexpr double kWindingAccuracy = 0.03;
constexpr std::size_t kSlabBytes = std::size_t{1} << 27;
constexpr double kWhole = 1e-6; // relative: sides this close to whole numbers of cells are

struct Samples {
    unsigned count = 0;
    std::array<unsigned, 3> sums = {}; ///< of the samples' places in the cell, counted from 0
};

/// Sums of the places of the bits of each byte.
constexpr std::array<std::uint8_t, 256> kPlaceSums = [] {
    std::array<std::uint8_t, 256> sums = {};
    for (unsigned byte = 0; byte < 256; ++byte)
        for (unsigned bit = 0; bit < 8; ++bit)
            if (byte >> bit & 1) sums[byte] = std::uint8_t(sums[byte] + bit);
    return sums;
}();

/// Adds up to eight samples, in the bits of `row`, in row (y, z) of the cell.
void add_samples(Samples& samples, unsigned row, unsigned y, unsigned z) {
    const auto count = unsigned(std::popcount(row));
    samples.count += count;
    samples.sums[0] += kPlaceSums[row];
    samples.sums[1] += count * y;
    samples.sums[2] += count * z;
}

/// Cells of layers k_begin .. k_end - 1 with some of their n^3 samples inside; n divides 64.
std::vector<Draft> find_occupied(const Grid& grid, const Occupancy& occupancy, unsigned n, std::size_t k_begin,
                                 std::size_t k_end, const RunContext& context) {
    std::vector<std::vector<Draft>> layers(k_end - k_begin);
    const unsigned cells_a_word = 64 / n;
    const std::uint64_t mask = (std::uint64_t{1} << n) - 1;
    parallel_for(context, layers.size(), 1, [&](std::size_t begin, std::size_t end) {
        std::vector<Samples> row(cells_a_word * occupancy.words_per_row);
        for (std::size_t layer = begin; layer < end; ++layer)
            for (std::size_t j = 0; j < grid.counts[1]; ++j) {
                bool any = false;
                for (unsigned r = 0; r < n * n; ++r) {
                    const unsigned y = r % n, z = r / n;
                    const std::uint64_t* words =
                        &occupancy.bits[((n * layer + z) * occupancy.counts[1] + n * j + y) * occupancy.words_per_row];
                    for (std::size_t w = 0; w < occupancy.words_per_row; ++w)
                        for (std::uint64_t rest = words[w]; rest != 0;) {
                            const unsigned cell = unsigned(std::countr_zero(rest)) / n;
                            add_samples(row[cells_a_word * w + cell], unsigned(rest >> n * cell & mask), y, z);
                            rest &= ~(mask << n * cell);
                            any = true;
                        }
                }
                if (!any) continue;
                for (std::size_t i = 0; i < grid.counts[0]; ++i) {
                    const Samples samples = std::exchange(row[i], {});
                    if (samples.count == 0) continue;
                    const std::array<std::size_t, 3> index = {i, j, k_begin + layer};
                    const float fraction = float(samples.count) / float(n * n * n);
                    Draft cell{{std::uint16_t(index[0]), std::uint16_t(index[1]), std::uint16_t(index[2])},
                               std::max(fraction, Cells::kLeastFraction),
                               {}};
                    for (int axis = 0; axis < 3; ++axis) {
                        const double place = (samples.sums[axis] / double(samples.count) + 0.5) / n;
                        cell.centroid[axis] = float(grid.origin[axis] + grid.spacing * (double(index[axis]) + place));
                    }
                    layers[layer].push_back(cell);
                }
            }
    });
    std::vector<Draft> cells;
    for (const auto& layer : layers) cells.insert(cells.end(), layer.begin(), layer.end());
    return cells;
}

/// Cells of layers k_begin .. k_end - 1 with some of their n^3 samples inside.
Result<std::vector<Draft>> sample_layers(const InsideSampler& sampler, const Grid& grid, unsigned n,
                                         std::size_t k_begin, std::size_t k_end, const RunContext& context) {
    const Lattice lattice = sample_points(grid, n, k_begin, k_end);
    const Result<Occupancy> occupancy = sampler.inside(lattice, context);
    if (!occupancy) return occupancy.error();
    return find_occupied(grid, *occupancy, n, k_begin, k_end, context);
}

bool draft_precedes(const Draft& a, const Draft& b) {
    return std::tie(a.index[2], a.index[1], a.index[0]) < std::tie(b.index[2], b.index[1], b.index[0]);
}

/// Gives cells the fractions and centroids that more samples find; no cell comes or goes.
Status look_closer(const InsideSampler& sampler, const Grid& grid, std::vector<Draft>& cells,
                   const RunContext& context) {
    const Result<std::vector<Draft>> closer = sample_layers(sampler, grid, kCloserSamples, 0, grid.counts[2], context);
    if (!closer) return closer.error();
    auto found = closer->begin();
    for (Draft& cell : cells) {
        while (found != closer->end() && draft_precedes(*found, cell)) ++found;
        if (found != closer->end() && found->index == cell.index) cell = *found;
    }
    return Success{};
}

} // namespace

Lattice sample_points(const Grid& grid, unsigned n, std::size_t k_begin, std::size_t k_end) {
    const double step = grid.spacing / n, bit = std::ldexp(1.0, std::ilogb(step) - 24);
    Lattice lattice;
    lattice.spacing = std::nearbyint(step / bit) * bit;
    for (int axis = 0; axis < 3; ++axis) {
        const std::size_t begin = axis == 2 ? n * k_begin : 0, end = n * (axis == 2 ? k_end : grid.counts[axis]);
        const double first = std::nearbyint((grid.origin[axis] + step / 2) / bit) * bit;
        lattice.coordinates[axis].resize(end - begin);
        for (std::size_t i = begin; i < end; ++i)
            lattice.coordinates[axis][i - begin] = first + double(i) * lattice.spacing;
    }
    return lattice;
}

std::string number(double x) {
    char text[32];
    std::snprintf(text, sizeof text, "%.4g", x);
    return text;
}

Result<Grid> make_grid(const Box& box, double spacing, double scale) {
    Grid grid{.spacing = spacing, .origin = box.centre(), .counts = {}};
    const double largest = std::max(box.min.cwiseAbs().maxCoeff(), box.max.cwiseAbs().maxCoeff());
    const double rounding = 4 * std::numeric_limits<float>::epsilon() * largest / spacing;
    double cells = 1, longest = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const double side = box.size()[axis] / spacing;
        const bool whole = std::abs(side - std::round(side)) <= kWhole * side + rounding;
        const double count = std::max(whole ? std::round(side) : std::ceil(side), 1.0);
        cells *= count;
        longest = std::max(longest, count);
        grid.origin[axis] -= 0.5 * count * spacing;
        grid.counts[axis] = std::size_t(std::min(count, 1e9));
    }
    if (cells > kMostGridCells || longest > double(kMostAlong)) {
        const double coarser = std::max(math::cbrt(cells / kMostGridCells), longest / double(kMostAlong));
        return Error{ErrorCode::unsuitable, "A spacing of " + number(spacing * scale) +
                                                " m divides the body's box into too many cells; give at least " +
                                                number(1.05 * spacing * coarser * scale) + " m."};
    }
    return grid;
}

MeshToFill find_mesh_to_fill(const Mesh& mesh, const WeldedTriangles& welded) {
    MeshToFill found{mesh.positions, welded, std::vector<std::uint8_t>(mesh.vertex_count(), 0), {}};
    for (const Index vertex : mesh.corners) found.used[vertex] = 1;
    for (std::size_t v = 0; v < found.used.size(); ++v)
        if (found.used[v]) found.box.extend(mesh.positions[v].cast<double>());
    double longest = 0; // squared
    for (const Triangle& triangle : welded.triangles) {
        const auto [a, b, c] = found.corners_of(triangle);
        longest = std::max({longest, (b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
    }
    found.longest_edge = std::sqrt(longest);
    return found;
}

Error too_many_cells(const Grid& grid, double count, double scale) {
    return {ErrorCode::unsuitable, "A spacing of " + number(grid.spacing * scale) + " m gives about " + number(count) +
                                       " cells, more than 2^26; give at least " +
                                       number(1.05 * grid.spacing * math::cbrt(count / kMostCells) * scale) + " m."};
}

Result<std::vector<Draft>> sample_cells(const MeshToFill& mesh, const Grid& grid, double scale,
                                        const RunContext& context) {
    const Result<InsideSampler> sampler = InsideSampler::create(
        mesh.positions, mesh.welded, {.overlap = Overlap::merged, .accuracy = kWindingAccuracy}, context);
    if (!sampler) return sampler.error();
    const bool scans = sampler->used() == InsideMethod::scan;
    const double most = 8 * double(grid.counts[0]) * double(grid.counts[1]) * double(grid.counts[2]);
    const unsigned n = scans ? kSamples : most <= kMostWindings ? kWindingSamples : 1;
    const std::size_t bytes_a_layer = n * n * grid.counts[1] * ((n * grid.counts[0] + 63) / 64) * 8;
    const std::size_t slab = std::clamp<std::size_t>(kSlabBytes / bytes_a_layer, 1, grid.counts[2]);
    std::vector<Draft> cells;
    for (std::size_t k = 0; k < grid.counts[2]; k += slab) {
        const std::size_t end = std::min(k + slab, grid.counts[2]);
        const Result<std::vector<Draft>> found = sample_layers(*sampler, grid, n, k, end, context);
        if (!found) return found.error();
        cells.insert(cells.end(), found->begin(), found->end());
        if (double(cells.size()) > kMostCells)
            return too_many_cells(grid, double(cells.size()) * double(grid.counts[2]) / double(end), scale);
    }
    if (scans && most / 8 * math::pow(double(kCloserSamples), 3) <= kMostCloserPoints)
        if (const Status closer = look_closer(*sampler, grid, cells, context); !closer) return closer.error();
    return cells;
}

Result<std::optional<double>> exact_volume(const MeshToFill& mesh, const RunContext& context) {
    constexpr double kAcross = 64, kSameCount = 1e-3; // points along the longest side; relative
    const Closure& closure = mesh.welded.closure;
    if (!closure.is_closed() || !closure.is_oriented() || !(mesh.box.size().array() > 0).all())
        return std::optional<double>();
    const Result<Lattice> lattice = make_lattice(mesh.box, {.spacing = mesh.box.size().maxCoeff() / kAcross});
    if (!lattice) return lattice.error();
    std::array<double, 2> counts = {};
    for (const Overlap overlap : {Overlap::parity, Overlap::merged}) {
        const Result<Occupancy> inside =
            scan_inside({mesh.positions, mesh.welded.triangles}, *lattice, {.overlap = overlap}, context);
        if (!inside) return inside.error();
        counts[overlap == Overlap::merged] = double(inside->count());
    }
    if (std::abs(counts[0] - counts[1]) > kSameCount * counts[1]) return std::optional<double>();
    double six = 0;
    for (const Triangle& triangle : mesh.welded.triangles) {
        const auto [a, b, c] = mesh.corners_of(triangle);
        const Vec3d from = mesh.box.centre();
        six += (a - from).dot((b - from).cross(c - from));
    }
    return std::optional<double>(six / 6);
}

void match_volume(std::vector<Draft>& cells, double volume) {
    constexpr int kRounds = 4; // those at a limit are no help to the others
    for (int round = 0; round < kRounds; ++round) {
        double fixed = 0, free = 0;
        const auto is_free = [](const Draft& cell) {
            return cell.fraction > Cells::kLeastFraction && cell.fraction < 1;
        };
        for (const Draft& cell : cells) (is_free(cell) ? free : fixed) += double(cell.fraction);
        if (!(free > 0) || volume <= fixed) return;
        const double factor = (volume - fixed) / free;
        for (Draft& cell : cells)
            if (is_free(cell))
                cell.fraction = std::clamp(float(factor * double(cell.fraction)), Cells::kLeastFraction, 1.0f);
    }
}

} // namespace filigree::mesh_cells
