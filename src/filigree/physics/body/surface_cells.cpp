// Cells that no sample found: for the vertices and large triangles of sheets and spikes.
#include "filigree/physics/body/occupied_cells.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace filigree::mesh_cells {

namespace {

constexpr std::size_t kEnoughTouches = std::size_t{1} << 25; // points that say where in their cells a sheet runs
constexpr double kOnFace = 1e-5;     // spacings: a vertex that is no further from a cell than this counts as in it
constexpr double kSheetReach = 0.05; // spacings: the same for points of large triangles

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

/// Cells without a sample inside that hold a vertex or a part of a large triangle.
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

} // namespace

void add_surface_cells(const MeshToFill& mesh, const Grid& grid, std::vector<Draft>& cells) {
    SurfaceCells added(grid, cells);
    for (std::size_t v = 0; v < mesh.used.size(); ++v)
        if (mesh.used[v]) added.cover(mesh.positions[v].cast<double>(), kOnFace);
    if (mesh.longest_edge > 0.5 * grid.spacing)
        for (const Triangle& triangle : mesh.welded.triangles)
            walk_triangle(mesh.corners_of(triangle), 0.5 * grid.spacing,
                          [&](const Vec3d& p) { added.cover(p, kSheetReach); });
    const std::vector<Draft> found = added.take();
    cells.insert(cells.end(), found.begin(), found.end());
    std::sort(cells.begin(), cells.end(), [](const Draft& a, const Draft& b) {
        return std::tie(a.index[2], a.index[1], a.index[0]) < std::tie(b.index[2], b.index[1], b.index[0]);
    });
}

} // namespace filigree::mesh_cells
