// The reference code's records laid out for restoring, and the levels they refine. Internal to reference_code.cpp.
//
// A level is refined patch by patch, row by row, with all its records in the order of use. Points on the edges of the
// base mesh are refined once, before the patches on their sides take copies; so nothing cracks, and the patches do not
// wait for each other. All positions are scaled by a power of two to about one, which keeps squares in float's range.
#pragma once

#include "filigree/reference/reference_code.h"
#include "filigree/reference/reference_kernel.h"

#include <mutex>

namespace filigree::reference {

void* allocate_large_pages(std::size_t bytes);
void free_large_pages(void* data, std::size_t bytes);

/// Large arrays on large pages where the system has them: read and written once a restore, they otherwise spend a fifth
/// of the time on looking pages up (1025^2 x 6, measured).
template <class T>
struct LargePages {
    using value_type = T;
    LargePages() = default;
    template <class U>
    LargePages(const LargePages<U>&) {}

    T* allocate(std::size_t count) { return static_cast<T*>(allocate_large_pages(count * sizeof(T))); }
    void deallocate(T* data, std::size_t count) { free_large_pages(data, count * sizeof(T)); }
    bool operator==(const LargePages&) const = default;
};

struct alignas(64) Line {
    float floats[kLanes];
};
/// Floats from a line's start, with a line to read into after the last.
using Code = std::vector<Line, LargePages<Line>>;
/// The lines as floats end to end. (From the array of one line no index may reach into the next.)
inline float* first_float(Code& code) { return reinterpret_cast<float*>(code.data()); }
inline const float* first_float(const Code& code) { return reinterpret_cast<const float*>(code.data()); }

/// Positions of one level, patch by patch and row by row; a row is its x, then its y, then its z.
class Grid {
public:
    void resize(std::size_t patch_count, std::size_t cells) {
        cells_ = cells;
        floats_.resize(3 * patch_count * pitch() * pitch() + 2 * kSlack);
    }
    std::size_t cells() const { return cells_; }
    std::size_t pitch() const { return cells_ + 1; }
    float* row(std::size_t patch, std::size_t j) { return floats_.data() + offset(patch, j); }
    const float* row(std::size_t patch, std::size_t j) const { return floats_.data() + offset(patch, j); }
    Point<float> at(std::size_t patch, std::size_t i, std::size_t j) const { return read(row(patch, j) + i); }
    void set(std::size_t patch, std::size_t i, std::size_t j, const Point<float>& p) {
        float* x = row(patch, j) + i;
        x[0] = p.x, x[pitch()] = p.y, x[2 * pitch()] = p.z;
    }
    Point<float> read(const float* x) const { return {x[0], x[pitch()], x[2 * pitch()]}; }

private:
    static constexpr std::size_t kSlack = 2 * kLanes; // the kernel reads around rows
    std::size_t offset(std::size_t patch, std::size_t j) const { return kSlack + 3 * pitch() * (patch * pitch() + j); }
    std::size_t cells_ = 0;
    std::vector<float, LargePages<float>> floats_;
};

/// A patch's side as a walk over its grid, in the direction of the base quad's half-edge.
class Side {
public:
    Side(const Grid& grid, Index half) : grid_(grid) {
        const auto m = grid.cells();
        const auto pitch = static_cast<std::ptrdiff_t>(grid.pitch());
        const std::ptrdiff_t steps[4] = {1, 3 * pitch, -1, -3 * pitch};
        const Index side = half % 4;
        start_ = grid.row(half / 4, side == 2 || side == 3 ? m : 0) + (side == 1 || side == 2 ? m : 0);
        step_ = steps[side];
        inward_ = steps[(side + 1) % 4];
    }
    Point<float> at(std::size_t k, int depth) const {
        return grid_.read(start_ + static_cast<std::ptrdiff_t>(k) * step_ + depth * inward_);
    }

private:
    const Grid& grid_;
    const float* start_;
    std::ptrdiff_t step_, inward_;
};

/// The edges of the base mesh. An edge belongs to the lower of its half-edges.
struct BaseEdges {
    std::vector<Index> halves;  ///< of each edge, its own half-edge
    std::vector<Index> twins;   ///< of each edge, the other half-edge or kNoIndex
    std::vector<Index> edge_of; ///< of each half-edge
};

BaseEdges find_base_edges(const RegularPatches& patches);

/// Vertex at point k of 2^levels along a side.
Index side_vertex(const RegularPatches& patches, Index half, std::size_t k);

/// The references of the point on the lower edge of cell (i, j), of that on its left edge (which runs down, so that the
/// cell lies on its left), and of point k of a base edge, between its coarse points k and k + 1.
References<float> along_references(const Grid& grid, std::size_t patch, std::size_t i, std::size_t j);
References<float> upwards_references(const Grid& grid, std::size_t patch, std::size_t i, std::size_t j);
References<float> side_references(const Grid& grid, const BaseEdges& edges, std::size_t edge, std::size_t k);

Basis<float> edge_basis(int references, const References<float>& r, bool both_sides);
Basis<float> centre_basis(int references, const References<float>& r);

/// Kinds of coded points in a cell, in the order of their records.
enum class CellPoint { along, upwards, centre };
Basis<float> cell_basis(int references, const Grid& grid, CellPoint kind, std::size_t patch, std::size_t i,
                        std::size_t j);

/// Where a driver is scaled from and to, and the law's factors for it.
struct PlacedDriver {
    float to_unit = 1, from_unit = 1;
    Scaling scaling;
    std::vector<Mat3f> axes; ///< of each base quad, when asked for
};

/// Arrays of one restore, kept for the next: fresh pages cost as much as the arithmetic.
struct Work {
    Grid coarse, fine;
    std::vector<float> edges; ///< of the current level, three floats a point
    std::vector<Vec3f> grids; ///< of ReferenceRestorer::restore
};

/// A detail's records, folded for one law into the order and shape that the kernel reads, level by level.
class Plan {
public:
    Plan(const ReferenceDetail& detail, HeightLaw law);

    const ReferenceDetail& detail() const { return detail_; }
    const RegularPatches& patches() const { return detail_.patches; }
    const BaseEdges& edges() const { return edges_; }
    std::span<const Index> driver_vertices() const { return driver_vertices_; }

    /// Numbers of records, from the first of the level that refines m cells a side.
    std::size_t edge_record(std::size_t m, std::size_t edge, std::size_t k) const { return edge * m + k; }
    std::size_t cell_record(std::size_t m, std::size_t patch, std::size_t i, std::size_t j, CellPoint kind) const;
    std::size_t record_count(std::size_t m) const;

    /// Folds the records of the next level. rest: the level they refine, at rest (of no use for HeightLaw::keep).
    void fold_level(const Grid& rest, const RunContext& context);

    /// Sets the driver's grid.
    PlacedDriver begin(std::span<const Vec3f> driver, bool with_axes, Grid& grid) const;
    /// One level finer.
    void refine(unsigned level, const PlacedDriver& placed, const Grid& coarse, Grid& fine, std::vector<float>& edges,
                const RunContext& context) const;
    /// All levels from the driver to `level`, into grids as ReferenceRestorer::restore_grids has them.
    void restore(std::span<const Vec3f> driver, unsigned level, std::span<Vec3f> positions, Work& work,
                 const RunContext& context) const;

    /// Work arrays not in use by another thread.
    std::unique_ptr<Work> take_work() const;
    void return_work(std::unique_ptr<Work> work) const;

    std::size_t code_bytes() const;

private:
    struct LoosePoint {
        std::size_t patch, i, j; ///< a cell, or i along an edge
        CellPoint kind;
        std::size_t edge;
        Vec3f offset;
    };
    struct Level {
        Code edges, cells;
        std::vector<LoosePoint> loose_on_edges, loose_in_cells;
    };

    void fold_edges(Level& level, std::span<const Vec3f> records, const Grid& rest, const RunContext& context) const;
    void fold_cells(Level& level, std::span<const Vec3f> records, const Grid& rest, const RunContext& context) const;
    void fold_loose(Level& level, std::size_t first, std::size_t count, std::size_t m) const;
    void refine_edges(const Level& level, const PlacedDriver& placed, const Grid& coarse, std::vector<float>& edges,
                      const RunContext& context) const;
    template <class Sink>
    void refine_cells(const Level& level, const PlacedDriver& placed, const Grid& coarse,
                      const std::vector<float>& edges, const Sink& sink, const RunContext& context) const;
    template <class Sink>
    void refine_into(unsigned level, const PlacedDriver& placed, const Grid& coarse, const Sink& sink,
                     std::vector<float>& edges, const RunContext& context) const;
    /// Point k of a side, in the side's own direction.
    const float* edge_point(const std::vector<float>& edges, std::size_t m, Index half, std::size_t k) const;

    const ReferenceDetail& detail_;
    HeightLaw law_;
    int references_;
    int rest_exponent_;
    BaseEdges edges_;
    std::vector<Index> driver_vertices_, driver_slots_; ///< ascending; of each base corner, its place among them
    std::vector<Level> levels_;
    std::size_t folded_records_ = 0;
    mutable std::mutex mutex_;
    mutable std::vector<std::unique_ptr<Work>> idle_work_;
};

/// The power of two that takes positions of this extent to about one.
int exponent_of(float extent);
float extent_of(std::span<const Vec3f> positions);
Point<float> loose_point(const Point<float>& from, const Mat3f& axes, const Vec3f& offset);

} // namespace filigree::reference
