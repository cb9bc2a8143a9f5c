#include "filigree/reference/reference_plan.h"

#include "filigree/core/large_memory.h"
#include "filigree/core/parallel_for.h"

#include <Eigen/Geometry>
#include <cassert>
#include <cmath>
#include <cstring>
#include <new>
#include <utility>

namespace filigree::reference {
namespace {

// Grids above this are written past the caches, which they would only flush.
constexpr std::size_t kStreamBytes = std::size_t{16} << 20;
constexpr std::size_t kPointsPerTask = 65536;
constexpr std::align_val_t kLargePage{kHugePage}, kLine{sizeof(Line)};
std::align_val_t alignment_of(std::size_t bytes) {
    return bytes >= 2 * static_cast<std::size_t>(kLargePage) ? kLargePage : kLine;
}

/// Right-angled axes that turn with a base quad: along its rows, and its normal. Any, where the quad has no direction.
Mat3f base_axes(const Grid& driver, std::size_t patch) {
    const auto corner = [&](std::size_t i, std::size_t j) {
        const Point<float> p = driver.at(patch, i, j);
        return Vec3d(p.x, p.y, p.z);
    };
    Vec3d x = corner(1, 0) - corner(0, 0) + corner(1, 1) - corner(0, 1);
    Vec3d y = corner(0, 1) - corner(0, 0) + corner(1, 1) - corner(1, 0);
    constexpr double kNoDirection = 1e-12; // of positions of about one
    if (x.norm() < kNoDirection) x = y.norm() < kNoDirection ? Vec3d(Vec3d::UnitX()) : y.unitOrthogonal();
    x.normalize();
    y -= x * x.dot(y);
    if (y.norm() < kNoDirection) y = x.unitOrthogonal();
    y.normalize();
    Mat3d axes;
    axes << x, y, x.cross(y);
    return axes.cast<float>();
}

/// A row writer that goes into a Grid.
struct GridSink {
    Grid& grid;

    struct Writer {
        Grid& grid;
        void write(const float* row, std::size_t pitch, std::size_t patch, std::size_t j) {
            for (std::size_t c = 0; c < 3; ++c)
                std::memcpy(grid.row(patch, j) + c * grid.pitch(), row + c * pitch, grid.pitch() * sizeof(float));
        }
    };
    Writer writer(std::size_t, std::size_t) const { return {grid}; }
    void set(std::size_t patch, std::size_t i, std::size_t j, const Point<float>& p) const { grid.set(patch, i, j, p); }
};

/// A row writer that goes into the caller's array, which it scales back, past the caches when it is large.
struct ArraySink {
    std::span<Vec3f> positions;
    std::size_t side; ///< points along a patch
    float from_unit;

    /// Rows must come in order and without gaps.
    class Writer {
    public:
        Writer(float* to, std::size_t row_points, float from_unit, bool streams)
            : to_(to), count_(row_points), from_unit_(from_unit), streams_(streams),
              buffer_(3 * (row_points + kLanes) + 2 * kLanes) {
            const std::size_t misaligned = reinterpret_cast<std::uintptr_t>(to) / sizeof(float) % kLanes;
            head_ = streams && misaligned ? kLanes - misaligned : 0;
        }
        ~Writer() {
            copy_out(pending_, 0);
            if (streams_) finish_streaming();
        }
        void write(const float* row, std::size_t pitch, std::size_t, std::size_t) {
            interleave(row, pitch, count_, from_unit_, buffer_.data() + pending_);
            pending_ += 3 * count_;
            if (!streams_) return copy_out(pending_, 0);
            if (pending_ < head_ + kLanes) return;
            const std::size_t lines = (pending_ - head_) / kLanes;
            std::memcpy(to_, buffer_.data(), head_ * sizeof(float));
            stream_lines(buffer_.data() + head_, lines, to_ + head_);
            const std::size_t done = head_ + lines * kLanes;
            std::memmove(buffer_.data(), buffer_.data() + done, (pending_ - done) * sizeof(float));
            to_ += done;
            pending_ -= done;
            head_ = 0;
        }

    private:
        void copy_out(std::size_t floats, std::size_t left) {
            std::memcpy(to_, buffer_.data(), floats * sizeof(float));
            to_ += floats;
            pending_ = left;
        }
        float* to_;
        std::size_t count_;
        float from_unit_;
        bool streams_;
        std::vector<float> buffer_;
        std::size_t pending_ = 0, head_ = 0; // floats in the buffer; floats up to the first whole line
    };
    Writer writer(std::size_t patch, std::size_t j) const {
        return {positions[(patch * side + j) * side].data(), side, from_unit, positions.size_bytes() >= kStreamBytes};
    }
    void set(std::size_t patch, std::size_t i, std::size_t j, const Point<float>& p) const {
        positions[(patch * side + j) * side + i] = from_unit * Vec3f(p.x, p.y, p.z);
    }
};

} // namespace

void* allocate_large_pages(std::size_t bytes) {
    void* data = ::operator new(bytes, alignment_of(bytes));
    if (alignment_of(bytes) == kLargePage) ask_for_huge_pages(data, bytes);
    return data;
}
void free_large_pages(void* data, std::size_t bytes) { ::operator delete(data, alignment_of(bytes)); }

int exponent_of(float extent) { return extent > 0 && std::isfinite(extent) ? std::ilogb(extent) + 1 : -126; }

float extent_of(std::span<const Vec3f> positions) {
    float extent = 0;
    for (const Vec3f& p : positions) extent = std::max(extent, p.cwiseAbs().maxCoeff());
    return extent;
}

/// Vertex at point k of 2^levels along a side.
Index side_vertex(const RegularPatches& patches, Index half, std::size_t k) {
    const std::size_t n = patches.side(), p = half / 4;
    switch (half % 4) {
    case 0:
        return patches.at(p, k, 0);
    case 1:
        return patches.at(p, n, k);
    case 2:
        return patches.at(p, n - k, n);
    default:
        return patches.at(p, 0, n - k);
    }
}

BaseEdges find_base_edges(const RegularPatches& patches) {
    // The vertex in a side's middle is on no other edge, while base quads may share both ends of two.
    std::vector<std::pair<Index, Index>> sides(4 * patches.patch_count());
    for (Index h = 0; h < sides.size(); ++h) sides[h] = {side_vertex(patches, h, patches.side() / 2), h};
    std::sort(sides.begin(), sides.end());
    std::vector<Index> twins(sides.size(), kNoIndex);
    for (std::size_t s = 0; s + 1 < sides.size(); ++s)
        if (sides[s].first == sides[s + 1].first) {
            twins[sides[s].second] = sides[s + 1].second;
            twins[sides[s + 1].second] = sides[s].second;
        }
    BaseEdges edges;
    edges.edge_of.resize(sides.size());
    for (Index h = 0; h < sides.size(); ++h) {
        if (twins[h] < h) {
            edges.edge_of[h] = edges.edge_of[twins[h]];
            continue;
        }
        edges.edge_of[h] = static_cast<Index>(edges.halves.size());
        edges.halves.push_back(h);
        edges.twins.push_back(twins[h]);
    }
    return edges;
}

Point<float> loose_point(const Point<float>& from, const Mat3f& axes, const Vec3f& offset) {
    const Vec3f moved = axes * offset;
    return {from.x + moved.x(), from.y + moved.y(), from.z + moved.z()};
}

Basis<float> edge_basis(int references, const References<float>& r, bool both_sides) {
    return references == 3   ? reference::edge_basis<3>(r, both_sides)
           : references == 4 ? reference::edge_basis<4>(r, both_sides)
                             : reference::edge_basis<6>(r, both_sides);
}
Basis<float> centre_basis(int references, const References<float>& r) {
    return references == 3 ? reference::centre_basis<3>(r) : reference::centre_basis<4>(r);
}

/// Cell (i, j)'s references for the point on its lower edge.
References<float> along_references(const Grid& grid, std::size_t patch, std::size_t i, std::size_t j) {
    References<float> r{
        {grid.at(patch, i, j), grid.at(patch, i + 1, j)}, {grid.at(patch, i, j + 1), grid.at(patch, i + 1, j + 1)}, {}};
    if (j > 0) r.behind[0] = grid.at(patch, i, j - 1), r.behind[1] = grid.at(patch, i + 1, j - 1);
    return r;
}
/// For the point on its left edge, which runs down so that the cell lies on its left.
References<float> upwards_references(const Grid& grid, std::size_t patch, std::size_t i, std::size_t j) {
    References<float> r{
        {grid.at(patch, i, j + 1), grid.at(patch, i, j)}, {grid.at(patch, i + 1, j + 1), grid.at(patch, i + 1, j)}, {}};
    if (i > 0) r.behind[0] = grid.at(patch, i - 1, j + 1), r.behind[1] = grid.at(patch, i - 1, j);
    return r;
}
/// For point k of a base edge between coarse points k and k + 1.
References<float> side_references(const Grid& grid, const BaseEdges& edges, std::size_t edge, std::size_t k) {
    const Side side(grid, edges.halves[edge]);
    References<float> r{{side.at(k, 0), side.at(k + 1, 0)}, {side.at(k, 1), side.at(k + 1, 1)}, {}};
    if (edges.twins[edge] != kNoIndex) {
        const Side twin(grid, edges.twins[edge]);
        const std::size_t m = grid.cells();
        r.behind[0] = twin.at(m - k, 1);
        r.behind[1] = twin.at(m - k - 1, 1);
    }
    return r;
}

Basis<float> cell_basis(int references, const Grid& grid, CellPoint kind, std::size_t patch, std::size_t i,
                        std::size_t j) {
    if (kind == CellPoint::centre) return centre_basis(references, along_references(grid, patch, i, j));
    return edge_basis(
        references,
        kind == CellPoint::along ? along_references(grid, patch, i, j) : upwards_references(grid, patch, i, j), true);
}

Plan::Plan(const ReferenceDetail& detail, HeightLaw law)
    : detail_(detail), law_(law), references_(static_cast<int>(detail.references)),
      rest_exponent_(exponent_of(detail.extent)), edges_(find_base_edges(detail.patches)) {
    for (const auto& quad : detail.patches.base)
        driver_vertices_.insert(driver_vertices_.end(), quad.begin(), quad.end());
    driver_slots_ = driver_vertices_;
    std::sort(driver_vertices_.begin(), driver_vertices_.end());
    driver_vertices_.erase(std::unique(driver_vertices_.begin(), driver_vertices_.end()), driver_vertices_.end());
    for (Index& slot : driver_slots_)
        slot = static_cast<Index>(std::lower_bound(driver_vertices_.begin(), driver_vertices_.end(), slot) -
                                  driver_vertices_.begin());
}

std::size_t Plan::cell_record(std::size_t m, std::size_t patch, std::size_t i, std::size_t j, CellPoint kind) const {
    const std::size_t rows_before = j == 0 ? 0 : (2 * m - 1) + (j - 1) * (3 * m - 1);
    const std::size_t cells_before = i == 0 ? 0 : j == 0 ? 2 * i - 1 : 3 * i - 1;
    const std::size_t kinds_before = kind == CellPoint::along     ? 0
                                     : kind == CellPoint::upwards ? j > 0
                                                                  : (j > 0) + (i > 0);
    return edges_.halves.size() * m + patch * (3 * m * m - 2 * m) + rows_before + cells_before + kinds_before;
}

std::size_t Plan::record_count(std::size_t m) const {
    return edges_.halves.size() * m + patches().patch_count() * (3 * m * m - 2 * m);
}

void Plan::fold_level(const Grid& rest, const RunContext& context) {
    const std::size_t m = std::size_t{1} << levels_.size();
    const auto records = std::span(detail_.records).subspan(folded_records_, record_count(m));
    Level& level = levels_.emplace_back();
    fold_edges(level, records, rest, context);
    fold_cells(level, records, rest, context);
    fold_loose(level, folded_records_, records.size(), m);
    folded_records_ += records.size();
}

void Plan::fold_edges(Level& level, std::span<const Vec3f> records, const Grid& rest, const RunContext& context) const {
    const std::size_t m = std::size_t{1} << (levels_.size() - 1), width = block_width(m), floats = edge_floats(law_);
    level.edges.resize(edges_.halves.size() * m * floats / kLanes + 2);
    float* code = first_float(level.edges);
    parallel_for(
        context, edges_.halves.size(), std::max<std::size_t>(1, kPointsPerTask / m), [&](auto begin, auto end) {
            for (std::size_t edge = begin; edge < end; ++edge)
                for (std::size_t k = 0; k < m; ++k) {
                    float* to = code + (edge * m + k / width * width) * floats + k % width;
                    const Vec3f& record = records[edge_record(m, edge, k)];
                    to[0] = record.x(), to[width] = record.y(), to[2 * width] = std::ldexp(record.z(), -rest_exponent_);
                    if (law_ != HeightLaw::keep)
                        to[3 * width] = rest_size(edge_basis(references_, side_references(rest, edges_, edge, k),
                                                             edges_.twins[edge] != kNoIndex),
                                                  law_);
                }
        });
}

void Plan::fold_cells(Level& level, std::span<const Vec3f> records, const Grid& rest, const RunContext& context) const {
    const std::size_t m = std::size_t{1} << (levels_.size() - 1), width = block_width(m);
    const std::size_t floats = cell_floats(references_, law_), rows = patches().patch_count() * m;
    level.cells.resize(rows * m * floats / kLanes + 2);
    float* code = first_float(level.cells);
    const auto fold_cell = [&](std::size_t p, std::size_t i, std::size_t j, float* to) {
        for (const CellPoint kind : {CellPoint::along, CellPoint::upwards, CellPoint::centre}) {
            // Points on the patch's sides are the edges'.
            if ((kind == CellPoint::along && j == 0) || (kind == CellPoint::upwards && i == 0)) continue;
            const Vec3f& record = records[cell_record(m, p, i, j, kind)];
            float* slot = to + 3 * static_cast<std::size_t>(kind) * width;
            slot[0] = record.x(), slot[width] = record.y(), slot[2 * width] = std::ldexp(record.z(), -rest_exponent_);
        }
        for (std::size_t k = 0; k < cell_sizes(references_, law_); ++k)
            to[(9 + k) * width] = rest_size(cell_basis(references_, rest, static_cast<CellPoint>(k), p, i, j), law_);
    };
    parallel_for(context, rows, std::max<std::size_t>(1, kPointsPerTask / m), [&](auto begin, auto end) {
        for (std::size_t row = begin; row < end; ++row)
            for (std::size_t i = 0; i < m; ++i)
                fold_cell(row / m, i, row % m, code + (row * m + i / width * width) * floats + i % width);
    });
}

void Plan::fold_loose(Level& level, std::size_t first, std::size_t count, std::size_t m) const {
    const std::size_t edge_records = edges_.halves.size() * m, patch_records = 3 * m * m - 2 * m;
    auto loose = std::lower_bound(detail_.loose.begin(), detail_.loose.end(), first);
    for (; loose != detail_.loose.end() && *loose < first + count; ++loose) {
        const Vec3f& record = detail_.records[*loose];
        LoosePoint point{};
        for (Eigen::Index c = 0; c < 3; ++c) point.offset[c] = std::ldexp(record[c], -rest_exponent_);
        std::size_t number = *loose - first;
        if (number < edge_records) {
            point.edge = number / m;
            point.i = number % m;
            point.patch = edges_.halves[point.edge] / 4;
            level.loose_on_edges.push_back(point);
            continue;
        }
        number -= edge_records;
        point.patch = number / patch_records;
        number %= patch_records;
        if (number >= 2 * m - 1) {
            point.j = 1 + (number - (2 * m - 1)) / (3 * m - 1);
            number = (number - (2 * m - 1)) % (3 * m - 1);
        }
        const std::size_t kinds = point.j > 0 ? 3 : 2; // of all cells but the row's first, which has one less
        point.i = (number + 1) / kinds;
        const std::size_t kind = number + 1 - point.i * kinds - (point.i == 0);
        // Counted from the back, since the centre is always there.
        point.kind = static_cast<CellPoint>(point.i == 0 ? (kinds == 3 ? 2 * kind : 2) : kind + (3 - kinds));
        level.loose_in_cells.push_back(point);
    }
}

PlacedDriver Plan::begin(std::span<const Vec3f> driver, bool with_axes, Grid& grid) const {
    assert(driver.size() == driver_vertices_.size());
    const int exponent = std::max(rest_exponent_, exponent_of(extent_of(driver)));
    PlacedDriver placed;
    placed.to_unit = std::ldexp(1.0f, -exponent);
    placed.from_unit = std::ldexp(1.0f, exponent);
    placed.scaling.law = law_;
    placed.scaling.height = std::ldexp(1.0f, rest_exponent_ - exponent);
    const int area_exponent = 2 * (rest_exponent_ - exponent);
    placed.scaling.size = law_ == HeightLaw::volume         ? std::ldexp(1.0f, area_exponent)
                          : law_ == HeightLaw::proportional ? std::min(std::ldexp(1.0f, -area_exponent), kHugeRatio)
                                                            : placed.scaling.height;
    grid.resize(patches().patch_count(), 1);
    for (std::size_t slot = 0; slot < driver_slots_.size(); ++slot) {
        const Vec3f p = placed.to_unit * driver[driver_slots_[slot]];
        const std::size_t corner = slot % 4;
        grid.set(slot / 4, corner == 1 || corner == 2, corner >= 2, {p.x(), p.y(), p.z()});
    }
    for (std::size_t patch = 0; with_axes && patch < patches().patch_count(); ++patch)
        placed.axes.push_back(base_axes(grid, patch));
    return placed;
}

void Plan::refine_edges(const Level& level, const PlacedDriver& placed, const Grid& coarse, std::vector<float>& edges,
                        const RunContext& context) const {
    const std::size_t m = coarse.cells(), width = block_width(m), blocks = edges_.halves.size() * (m / width);
    edges.resize(3 * edges_.halves.size() * m);
    const auto refine_block = [&](std::size_t block) {
        const std::size_t edge = block * width / m, k0 = block * width % m;
        EdgeRun run{
            {}, edges_.twins[edge] != kNoIndex, first_float(level.edges) + block * width * edge_floats(law_), width};
        for (std::size_t lane = 0; lane < width; ++lane) {
            const References<float> r = side_references(coarse, edges_, edge, k0 + lane);
            const Point<float> points[6] = {r.ends[0], r.ends[1], r.beyond[0], r.beyond[1], r.behind[0], r.behind[1]};
            for (std::size_t k = 0; k < 6; ++k) {
                run.references[k][lane] = points[k].x;
                run.references[6 + k][lane] = points[k].y;
                run.references[12 + k][lane] = points[k].z;
            }
        }
        float points[3][kLanes];
        refine_edge(run, references_, placed.scaling, points);
        float* to = edges.data() + 3 * (edge * m + k0);
        for (std::size_t lane = 0; lane < width; ++lane, to += 3)
            for (std::size_t c = 0; c < 3; ++c) to[c] = points[c][lane];
    };
    parallel_for(context, blocks, kPointsPerTask / width, [&](auto begin, auto end) {
        for (std::size_t block = begin; block < end; ++block) refine_block(block);
    });
    for (const LoosePoint& loose : level.loose_on_edges) {
        const Point<float> p = loose_point(Side(coarse, edges_.halves[loose.edge]).at(loose.i, 0),
                                           placed.axes[loose.patch], placed.scaling.height * loose.offset);
        float* to = edges.data() + 3 * (loose.edge * m + loose.i);
        to[0] = p.x, to[1] = p.y, to[2] = p.z;
    }
}

const float* Plan::edge_point(const std::vector<float>& edges, std::size_t m, Index half, std::size_t k) const {
    const Index edge = edges_.edge_of[half];
    return edges.data() + 3 * (edge * m + (edges_.halves[edge] == half ? k : m - 1 - k));
}

template <class Sink>
void Plan::refine_cells(const Level& level, const PlacedDriver& placed, const Grid& coarse,
                        const std::vector<float>& edges, const Sink& sink, const RunContext& context) const {
    const std::size_t m = coarse.cells(), rows = patches().patch_count() * m;
    const std::size_t row_floats = m * cell_floats(references_, law_), fine_pitch = (2 * m / kLanes + 3) * kLanes;
    parallel_for(context, rows, std::max<std::size_t>(1, kPointsPerTask / (4 * m)), [&](auto begin, auto end) {
        std::vector<float> stage(6 * fine_pitch);
        float *even = stage.data(), *odd = even + 3 * fine_pitch;
        const auto set = [&](float* row, std::size_t i, const float* point) {
            for (std::size_t c = 0; c < 3; ++c) row[c * fine_pitch + i] = point[c];
        };
        auto writer = sink.writer(begin / m, 2 * (begin % m));
        for (std::size_t row = begin; row < end; ++row) {
            const std::size_t p = row / m, j = row % m;
            const Index half = static_cast<Index>(4 * p);
            const float *lower = coarse.row(p, j), *upper = coarse.row(p, j + 1);
            refine_row({j > 0 ? coarse.row(p, j - 1) : lower, lower, upper, coarse.pitch(), m,
                        first_float(level.cells) + row * row_floats, even, odd, fine_pitch},
                       references_, placed.scaling);
            for (std::size_t c = 0; c < 3; ++c) even[c * fine_pitch + 2 * m] = lower[c * coarse.pitch() + m];
            for (std::size_t k = 0; j == 0 && k < m; ++k) set(even, 2 * k + 1, edge_point(edges, m, half, k));
            writer.write(even, fine_pitch, p, 2 * j);
            set(odd, 0, edge_point(edges, m, half + 3, m - 1 - j));
            set(odd, 2 * m, edge_point(edges, m, half + 1, j));
            writer.write(odd, fine_pitch, p, 2 * j + 1);
            if (j + 1 < m) continue;
            for (std::size_t i = 0; i <= m; ++i)
                for (std::size_t c = 0; c < 3; ++c) even[c * fine_pitch + 2 * i] = upper[c * coarse.pitch() + i];
            for (std::size_t k = 0; k < m; ++k) set(even, 2 * (m - k) - 1, edge_point(edges, m, half + 2, k));
            writer.write(even, fine_pitch, p, 2 * m);
        }
    });
    for (const LoosePoint& loose : level.loose_in_cells) {
        const bool up = loose.kind != CellPoint::along, right = loose.kind != CellPoint::upwards;
        // The first reference: the cell's lower left corner, or its upper left one where the edge runs down.
        const Point<float> from = coarse.at(loose.patch, loose.i, loose.j + !right);
        sink.set(loose.patch, 2 * loose.i + right, 2 * loose.j + up,
                 loose_point(from, placed.axes[loose.patch], placed.scaling.height * loose.offset));
    }
}

template <class Sink>
void Plan::refine_into(unsigned level, const PlacedDriver& placed, const Grid& coarse, const Sink& sink,
                       std::vector<float>& edges, const RunContext& context) const {
    refine_edges(levels_[level], placed, coarse, edges, context);
    refine_cells(levels_[level], placed, coarse, edges, sink, context);
}

void Plan::refine(unsigned level, const PlacedDriver& placed, const Grid& coarse, Grid& fine, std::vector<float>& edges,
                  const RunContext& context) const {
    fine.resize(patches().patch_count(), 2 * coarse.cells());
    refine_into(level, placed, coarse, GridSink{fine}, edges, context);
}

void Plan::restore(std::span<const Vec3f> driver, unsigned level, std::span<Vec3f> positions, Work& work,
                   const RunContext& context) const {
    const PlacedDriver placed = begin(driver, !detail_.loose.empty(), work.coarse);
    const std::size_t side = (std::size_t{1} << level) + 1;
    assert(level <= levels_.size() && positions.size() == patches().patch_count() * side * side);
    const ArraySink sink{positions, side, placed.from_unit};
    if (level == 0) {
        for (std::size_t slot = 0; slot < driver_slots_.size(); ++slot) {
            const std::size_t corner = slot % 4;
            positions[slot - corner + (corner < 2 ? corner : 5 - corner)] = driver[driver_slots_[slot]];
        }
        return;
    }
    for (unsigned l = 0; l + 1 < level; ++l) {
        refine(l, placed, work.coarse, work.fine, work.edges, context);
        std::swap(work.coarse, work.fine);
    }
    refine_into(level - 1, placed, work.coarse, sink, work.edges, context);
}

std::unique_ptr<Work> Plan::take_work() const {
    const std::lock_guard lock(mutex_);
    if (idle_work_.empty()) return std::make_unique<Work>();
    auto work = std::move(idle_work_.back());
    idle_work_.pop_back();
    return work;
}

void Plan::return_work(std::unique_ptr<Work> work) const {
    const std::lock_guard lock(mutex_);
    idle_work_.push_back(std::move(work));
}

std::size_t Plan::code_bytes() const {
    std::size_t lines = 0;
    for (const Level& level : levels_) lines += level.cells.size() + level.edges.size();
    return lines * sizeof(Line);
}

} // namespace filigree::reference
