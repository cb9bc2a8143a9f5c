// From a mesh to cells. Everything here is in model units; only the finished cells are in metres.
#include "filigree/physics/mesh_cells.h"

#include "filigree/core/parallel_for.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <optional>
#include <string>
#include <tuple>
#include <utility>

namespace filigree {

namespace {

using LatticeIndex = Cells::LatticeIndex;

constexpr double kMostCells = 0x1p26;
constexpr std::size_t kEnoughTouches = std::size_t{1} << 25; // points that say where in their cells a sheet runs
constexpr double kMostGridCells = 0x1p30;                    // of the box, one byte each
constexpr std::size_t kMostAlong = 16383;                    // times four samples: what scan_inside takes on an axis
// Samples a cell along each axis: a closed mesh is scanned at a nanosecond each, a winding number takes microseconds.
constexpr unsigned kSamples = 4, kWindingSamples = 2;
constexpr double kMostWindings = 0x1p20; // beyond, one sample a cell
constexpr double kWindingAccuracy = 0.03;
constexpr std::size_t kSlabBytes = std::size_t{1} << 27;
constexpr double kWhole = 1e-6;      // relative: sides this close to whole numbers of cells are
constexpr double kOnFace = 1e-5;     // cells: a vertex this close to a cell lies in it
constexpr double kSheetReach = 0.05; // the same for points of large triangles
constexpr double kLooseFraction = 0.02;
constexpr double kCountTolerance = 0.02, kFitTolerance = 0.15;

std::string number(double x) {
    char text[32];
    std::snprintf(text, sizeof text, "%.4g", x);
    return text;
}

/// A regular grid of cubes around the mesh.
struct Grid {
    double spacing = 0;
    Vec3d origin;
    std::array<std::size_t, 3> counts;

    std::size_t index(std::size_t i, std::size_t j, std::size_t k) const { return (k * counts[1] + j) * counts[0] + i; }
};

/// The grid with this spacing, centred on the box; sides that are whole numbers of cells get just those.
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
        const double coarser = std::max(std::cbrt(cells / kMostGridCells), longest / double(kMostAlong));
        return Error{ErrorCode::unsuitable, "A spacing of " + number(spacing * scale) +
                                                " m divides the body's box into too many cells; give at least " +
                                                number(1.05 * spacing * coarser * scale) + " m."};
    }
    return grid;
}

/// Points at the centres of the n^3 cubes of each cell, layers k_begin .. k_end - 1 of cells. Rounded to few bits, so
/// that the scan's exact decisions are quick.
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

struct Samples {
    unsigned count = 0;
    std::array<unsigned, 3> sums = {}; ///< of the samples' places in the cell, counted from 0
};

/// Adds up to four samples, in the bits of `row`, in row (y, z) of the cell.
void add_samples(Samples& samples, unsigned row, unsigned y, unsigned z) {
    const auto count = unsigned(std::popcount(row));
    samples.count += count;
    samples.sums[0] += (row >> 1 & 1) + 2 * (row >> 2 & 1) + 3 * (row >> 3 & 1);
    samples.sums[1] += count * y;
    samples.sums[2] += count * z;
}

/// A cell before it is one of many.
struct Draft {
    LatticeIndex index;
    float fraction;
    Vec3f centroid;
    bool added = false;
};

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

/// Calls visit(point) for points of a triangle no more than `step` apart, along rows beside its longest side; for none
/// where the triangle is that small itself.
template <class Visit>
void walk_triangle(const std::array<Vec3d, 3>& corners, double step, const Visit& visit) {
    int longest = 0;
    double length = 0;
    for (int side = 0; side < 3; ++side)
        if (const double l = (corners[(side + 1) % 3] - corners[side]).norm(); l > length) {
            length = l;
            longest = side;
        }
    if (length <= step) return;
    const Vec3d a = corners[longest], b = corners[(longest + 1) % 3], c = corners[(longest + 2) % 3];
    const double height = (b - a).cross(c - a).norm() / length;
    const auto rows = std::size_t(std::ceil(height / step));
    for (std::size_t row = 0; row <= rows; ++row) {
        const double t = rows == 0 ? 0 : double(row) / double(rows);
        const Vec3d begin = a + t * (c - a), end = b + t * (c - b);
        const auto points = std::size_t(std::ceil((end - begin).norm() / step));
        for (std::size_t p = 0; p <= points; ++p)
            visit(Vec3d(points == 0 ? begin : begin + double(p) / double(points) * (end - begin)));
    }
}

/// Cells that no sample is in, but a vertex, or a part of a large triangle.
class SurfaceCells {
public:
    SurfaceCells(const Grid& grid, const std::vector<Draft>& occupied)
        : grid_(grid), state_(grid.counts[0] * grid.counts[1] * grid.counts[2], kEmpty) {
        for (const Draft& cell : occupied) state_[grid.index(cell.index[0], cell.index[1], cell.index[2])] = kOccupied;
    }

    /// Adds the cell of a point that is further than `reach` cells from all that are there.
    void cover(const Vec3d& point, double reach) {
        const Vec3d at = (point - grid_.origin) / grid_.spacing;
        std::array<std::size_t, 3> cell, low, high;
        for (int axis = 0; axis < 3; ++axis) {
            cell[axis] = clamped(at[axis], axis);
            low[axis] = clamped(at[axis] - reach, axis);
            high[axis] = clamped(at[axis] + reach, axis);
        }
        const std::size_t index = grid_.index(cell[0], cell[1], cell[2]);
        if (state_[index] == kOccupied || is_full()) return;
        if (state_[index] == kAdded && touches_.size() >= kEnoughTouches) return;
        if (state_[index] == kEmpty) {
            for (std::size_t k = low[2]; k <= high[2]; ++k)
                for (std::size_t j = low[1]; j <= high[1]; ++j)
                    for (std::size_t i = low[0]; i <= high[0]; ++i)
                        if (state_[grid_.index(i, j, k)] != kEmpty) return;
            state_[index] = kAdded;
            ++added_;
        }
        touches_.push_back({index, point.cast<float>()});
    }

    /// More cells than there may be: no more are added.
    bool is_full() const { return double(added_) > kMostCells; }

    /// The added cells, in no order; each at the mean of the points in it.
    std::vector<Draft> take() {
        std::stable_sort(touches_.begin(), touches_.end(),
                         [](const Touch& a, const Touch& b) { return a.cell < b.cell; });
        std::vector<Draft> cells;
        for (std::size_t first = 0, last; first < touches_.size(); first = last) {
            const std::size_t cell = touches_[first].cell;
            Vec3d sum = Vec3d::Zero();
            for (last = first; last < touches_.size() && touches_[last].cell == cell; ++last)
                sum += touches_[last].point.cast<double>();
            const std::size_t row = cell / grid_.counts[0];
            cells.push_back({{std::uint16_t(cell % grid_.counts[0]), std::uint16_t(row % grid_.counts[1]),
                              std::uint16_t(row / grid_.counts[1])},
                             Cells::kLeastFraction,
                             (sum / double(last - first)).cast<float>(),
                             true});
        }
        return cells;
    }

private:
    enum : std::uint8_t { kEmpty, kOccupied, kAdded };
    struct Touch {
        std::size_t cell;
        Vec3f point;
    };
    std::size_t clamped(double at, int axis) const {
        return std::size_t(std::clamp(std::floor(at), 0.0, double(grid_.counts[axis] - 1)));
    }

    const Grid& grid_;
    std::vector<std::uint8_t> state_;
    std::vector<Touch> touches_;
    std::size_t added_ = 0;
};

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

/// Whether each cell stays: those of groups that are not much smaller than the largest.
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

/// Whether each cell has no neighbour on either side along some axis.
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

/// Makes cells of one mesh with one spacing after the other.
class CellMaker {
public:
    CellMaker(const Mesh& mesh, const WeldedTriangles& welded, double scale, const RunContext& context)
        : mesh_(mesh), welded_(welded), scale_(scale), context_(context), used_(mesh.vertex_count(), 0) {
        context_.progress = nullptr;
        for (const Index vertex : mesh.corners) used_[vertex] = 1;
        for (std::size_t v = 0; v < used_.size(); ++v)
            if (used_[v]) box_.extend(mesh.positions[v].cast<double>());
        for (const Triangle& triangle : welded.triangles) {
            const auto [a, b, c] = corners_of(triangle);
            longest_edge_ =
                std::max({longest_edge_, (b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
        }
        longest_edge_ = std::sqrt(longest_edge_);
    }

    const Box& box() const { return box_; }

    /// spacing: model units.
    Result<Cells> make(double spacing, CellReport& report) const {
        const Result<Grid> grid = make_grid(box_, spacing, scale_);
        if (!grid) return grid.error();
        Result<std::vector<Draft>> drafts = sample(*grid);
        if (!drafts) return drafts.error();
        add_surface(*grid, *drafts);
        if (context_.is_cancelled()) return cancelled_error();
        if (double(drafts->size()) > kMostCells) return too_many(*grid, double(drafts->size()));
        Cells cells = finish(*grid, *drafts);
        std::size_t loose = 0;
        const std::vector<std::uint8_t> kept = without_loose_parts(cells, loose);
        if (loose > 0) {
            std::size_t count = 0;
            for (std::size_t c = 0; c < kept.size(); ++c)
                if (kept[c]) (*drafts)[count++] = (*drafts)[c];
            drafts->resize(count);
            cells = finish(*grid, *drafts);
        }
        report = {};
        report.cells = drafts->size();
        report.loose_parts = loose;
        double volume = 0;
        for (const Draft& cell : *drafts) {
            report.whole_cells += cell.fraction == 1;
            report.added_cells += cell.added;
            volume += cell.fraction;
        }
        report.volume = volume * cells.spacing * cells.spacing * cells.spacing;
        return cells;
    }

private:
    Error too_many(const Grid& grid, double count) const {
        return {ErrorCode::unsuitable, "A spacing of " + number(grid.spacing * scale_) + " m gives about " +
                                           number(count) + " cells, more than 2^26; give at least " +
                                           number(1.05 * grid.spacing * std::cbrt(count / kMostCells) * scale_) +
                                           " m."};
    }

    Result<std::vector<Draft>> sample(const Grid& grid) const {
        const bool scans = welded_.closure.is_closed() && welded_.closure.is_oriented();
        const double most = 8 * double(grid.counts[0]) * double(grid.counts[1]) * double(grid.counts[2]);
        const unsigned n = scans ? kSamples : most <= kMostWindings ? kWindingSamples : 1;
        const std::size_t bytes_a_layer = n * n * grid.counts[1] * ((n * grid.counts[0] + 63) / 64) * 8;
        const std::size_t slab = std::clamp<std::size_t>(kSlabBytes / bytes_a_layer, 1, grid.counts[2]);
        std::vector<Draft> cells;
        for (std::size_t k = 0; k < grid.counts[2]; k += slab) {
            const std::size_t end = std::min(k + slab, grid.counts[2]);
            const Lattice lattice = sample_points(grid, n, k, end);
            const Result<Occupancy> occupancy =
                scans ? scan_inside({mesh_.positions, welded_.triangles}, lattice, Overlap::merged, context_)
                      : winding_inside(mesh_.positions, welded_.triangles, lattice, kWindingAccuracy, context_);
            if (!occupancy) return occupancy.error();
            const std::vector<Draft> found = find_occupied(grid, *occupancy, n, k, end, context_);
            cells.insert(cells.end(), found.begin(), found.end());
            if (double(cells.size()) > kMostCells)
                return too_many(grid, double(cells.size()) * double(grid.counts[2]) / double(end));
        }
        return cells;
    }

    /// Adds what vertices and large triangles need; leaves the cells in the order of `Cells`.
    void add_surface(const Grid& grid, std::vector<Draft>& cells) const {
        SurfaceCells surface(grid, cells);
        for (std::size_t v = 0; v < used_.size(); ++v)
            if (used_[v]) surface.cover(mesh_.positions[v].cast<double>(), kOnFace);
        if (longest_edge_ > 0.5 * grid.spacing)
            for (const Triangle& triangle : welded_.triangles)
                walk_triangle(corners_of(triangle), 0.5 * grid.spacing,
                              [&](const Vec3d& p) { surface.cover(p, kSheetReach); });
        const std::vector<Draft> added = surface.take();
        cells.insert(cells.end(), added.begin(), added.end());
        std::sort(cells.begin(), cells.end(), [](const Draft& a, const Draft& b) {
            return std::tie(a.index[2], a.index[1], a.index[0]) < std::tie(b.index[2], b.index[1], b.index[0]);
        });
    }

    Cells finish(const Grid& grid, const std::vector<Draft>& drafts) const {
        std::vector<LatticeIndex> indices(drafts.size());
        for (std::size_t c = 0; c < drafts.size(); ++c) indices[c] = drafts[c].index;
        Cells cells = lattice_cells(std::move(indices), grid.spacing * scale_, grid.origin * scale_);
        for (std::size_t c = 0; c < drafts.size(); ++c) {
            cells.fraction[c] = drafts[c].fraction;
            cells.centroid[c] = (drafts[c].centroid.cast<double>() * scale_).cast<float>();
        }
        return cells;
    }

    std::array<Vec3d, 3> corners_of(const Triangle& triangle) const {
        return {mesh_.positions[triangle[0]].cast<double>(), mesh_.positions[triangle[1]].cast<double>(),
                mesh_.positions[triangle[2]].cast<double>()};
    }

    const Mesh& mesh_;
    const WeldedTriangles& welded_;
    double scale_;
    RunContext context_;             ///< without progress: the spacings are counted, not what each takes
    std::vector<std::uint8_t> used_; ///< vertices of faces
    Box box_;
    double longest_edge_ = 0;
};

/// What came of a spacing.
struct Trial {
    double spacing = 0;
    double particles = 0;
    Cells cells;
    CellReport report;
};

/// Spacings by the secant rule on the logarithms, then fitted to the shortest side.
Result<Trial> find_spacing(const CellMaker& maker, std::size_t count,
                           const std::function<std::size_t(const Cells&)>& count_particles, const RunContext& context) {
    const auto try_spacing = [&](double spacing) -> Result<Trial> {
        Trial trial;
        trial.spacing = spacing;
        Result<Cells> cells = maker.make(spacing, trial.report);
        if (!cells) return cells.error();
        trial.particles = double(count_particles(*cells));
        trial.cells = std::move(cells).value();
        return trial;
    };
    const auto miss = [&](const Trial& trial) { return std::log(trial.particles / double(count)); };

    constexpr int kTrials = 6;
    const Vec3d size = maker.box().size();
    double spacing = size.maxCoeff() / 24, slope = -3;
    Trial best, last;
    for (int n = 0; n < kTrials; ++n) {
        context.report("choosing a spacing", double(n) / kTrials);
        Result<Trial> trial = try_spacing(spacing);
        if (!trial) return trial.error();
        if (n > 0 && trial->particles != last.particles)
            slope = std::clamp((miss(*trial) - miss(last)) / std::log(trial->spacing / last.spacing), -3.5, -1.0);
        const bool better = n == 0 || std::abs(miss(*trial)) < std::abs(miss(best));
        last.spacing = trial->spacing;
        last.particles = trial->particles;
        if (better) best = std::move(trial).value();
        if (std::abs(miss(best)) < kCountTolerance) break;
        const double next = std::min(last.spacing * std::exp(-miss(last) / slope), size.maxCoeff());
        if (next == last.spacing) break;
        spacing = next;
    }

    const double shortest = size.minCoeff();
    std::optional<Trial> fitted;
    for (const double cells : {std::floor(shortest / best.spacing), std::ceil(shortest / best.spacing)}) {
        if (cells < 1 || std::abs(std::log(shortest / cells / best.spacing)) > 0.2) continue;
        Result<Trial> trial = try_spacing(shortest / cells);
        if (!trial) return trial.error();
        if (std::abs(trial->particles - double(count)) <= kFitTolerance * double(count) &&
            (!fitted || std::abs(miss(*trial)) < std::abs(miss(*fitted))))
            fitted = std::move(trial).value();
    }
    return fitted ? std::move(*fitted) : std::move(best);
}

std::optional<Error> check(const CellMaker& maker, double scale, const CellOptions& options) {
    if (!std::isfinite(scale) || scale <= 0)
        return Error{ErrorCode::usage, "The scale is " + number(scale) + "; give metres a model unit, above 0."};
    if (!std::isfinite(options.spacing) || options.spacing < 0)
        return Error{ErrorCode::usage,
                     "The spacing is " + number(options.spacing) + "; give metres, above 0 (or 0 to have it chosen)."};
    const double longest = maker.box().size().maxCoeff() * scale;
    if (!(longest > 0))
        return Error{ErrorCode::unsuitable, "The mesh has no extent, so there is nothing to fill with cells."};
    if (longest < 1e-9 || longest > 1e9)
        return Error{ErrorCode::usage, "With a scale of " + number(scale) + " the body is " + number(longest) +
                                           " m long; give a scale that makes it 1e-9 to 1e9 m."};
    if (options.spacing > longest)
        return Error{ErrorCode::usage, "A spacing of " + number(options.spacing) + " m is larger than the body (" +
                                           number(longest) + " m); give less."};
    if (options.spacing == 0 && options.count == 0)
        return Error{ErrorCode::usage, "A body of 0 cells was asked for; give a count of 1 or more, or a spacing."};
    if (options.spacing == 0 && double(options.count) > kMostCells)
        return Error{ErrorCode::unsuitable, "More than 2^26 cells were asked for; give a smaller count."};
    return std::nullopt;
}

} // namespace

Result<Cells> make_cells(const Mesh& mesh, const WeldedTriangles& welded, double scale, const CellOptions& options,
                         const std::function<std::size_t(const Cells&)>& count_particles, const RunContext& context,
                         CellReport* report) {
    if (welded.triangles.empty())
        return Error{ErrorCode::unsuitable, "The mesh has no faces with an area, so no body can be made of it."};
    const CellMaker maker(mesh, welded, scale, context);
    if (const auto error = check(maker, scale, options)) return *error;
    Trial trial;
    if (options.spacing > 0) {
        Result<Cells> cells = maker.make(options.spacing / scale, trial.report);
        if (!cells) return cells.error();
        trial.cells = std::move(cells).value();
    } else {
        Result<Trial> found = find_spacing(maker, options.count, count_particles, context);
        if (!found) return found.error();
        trial = std::move(found).value();
    }
    if (report) {
        *report = trial.report;
        report->thin_cells = count_thin(trial.cells, context);
    }
    return std::move(trial.cells);
}

Result<Cells> make_cells(const Mesh& mesh, double scale, const CellOptions& options, const RunContext& context,
                         CellReport* report) {
    return make_cells(
        mesh, weld_triangles(mesh), scale, options, [](const Cells& cells) { return cells.cells.size(); }, context,
        report);
}

} // namespace filigree
