// A body's cells as matter that points may be inside of: which cell holds a point now, where that was at rest, and how
// deep below the surface. Private to the layer.
#pragma once

#include "filigree/physics/body.h"

#include <array>
#include <optional>

namespace filigree {

/// Maps points of the world into a deformed body's rest space, where its distance field says depth and direction
/// [Fisher 2001, McAdams 2011].
class Matter {
public:
    /// body: outlives this. Positions are those of the corners of its cells: of the particles, or of Body::corners.
    explicit Matter(const Body& body);
    /// A rigid body is one cell that goes on as far as one likes.
    bool is_rigid() const { return is_rigid_; }

    /// Of a rigid body: all that may touch, in local coordinates of cell 0.
    const Vec3f& rigid_low() const { return rigid_low_; }
    const Vec3f& rigid_high() const { return rigid_high_; }

    /// A point in a cell: local coordinates are 0 .. 1 inside, and go on linearly outside.
    struct Place {
        Index cell = kNoIndex;
        Vec3f local = Vec3f::Constant(0.5f);
    };
    using Weights = std::array<float, 8>;
    /// Trilinear, of a rigid body linear; they sum to 1.
    Weights weights(const Place& place) const;
    const std::array<Index, 8>& corners(Index cell) const { return body_.cells.cell_corners[cell]; }
    Vec3f mean(const Place& place, const Vectors& values) const; ///< of the corners' values, by their weights

    void add(const Place& place, const Vec3f& value, Vectors& values) const; ///< to the corners, by their weights

    /// The place of a point, by Newton's method from `place` on, from cell to neighbouring cell. `inverse`: of the
    /// derivative by local coordinates, 1/m. False where cells are inverted or flat, or the walk does not end.
    bool locate(const Vectors& positions, const Vec3f& point, Place& place, Mat3f& inverse) const;

    /// The place of a point in place.cell, from its middle on. False where the point lies further outside of the cell
    /// than `around` (cells), or the cell is inverted or flat on the way. Not of a rigid body.
    bool locate_in_cell(const Vectors& positions, const Vec3f& point, Place& place, float around = 0) const;

    /// Derivative of local coordinates by position, 1/m.
    Mat3f inverse_derivative(const Vectors& positions, const Place& place) const;

    float volume_ratio(const Vectors& positions, Index cell) const; ///< of the cell's middle, now to rest

    /// Where a place lies beside the surface.
    struct Depth {
        float depth;  ///< m, along the normal; below 0 outside
        Vec3f normal; ///< unit, outward, in the world
        Vec3f rest;   ///< the normal at rest
    };
    /// entry: unit, at rest; the normal where the point came in, or zero. A point that is past the middle of a thin
    /// part goes back the way it came.
    std::optional<Depth> depth(const Place& place, const Mat3f& inverse, const Vec3f& entry) const;

    Vec3f rest_position(const Place& place) const; ///< m
    /// A cell's map about its middle. Of a crushed cell's the inverse may not be finite.
    struct Linear {
        Vec3f middle;  ///< m
        Mat3f inverse; ///< 1/m
        Vec3f local(const Vec3f& point) const { return Vec3f::Constant(0.5f) + inverse * (point - middle); }
    };
    Linear linear(const Vectors& positions, Index cell) const;
    /// Whether two cells are the same piece of matter: one is reached from the other in two steps between neighbours.
    bool are_together(Index a, Index b) const;
    /// Calls visit(cell, way) for those that are the same piece of matter as a cell; way: to them at rest, in cells.
    template <class Visit>
    void each_together(Index cell, const Visit& visit) const {
        const auto& at = body_.cells.cells[cell];
        for (int n = 0; n < 125; ++n) {
            if (!(together_[cell][n / 64] >> (n % 64) & 1)) continue;
            const int i = n % 5 - 2, j = n / 5 % 5 - 2, k = n / 25 - 2;
            visit(cell_at(at[0] + i, at[1] + j, at[2] + k), Vec3f(float(i), float(j), float(k)));
        }
    }
    /// Whether two places of the surface are the two sides of a thin part. Their normals at rest; way: from the first
    /// place to the other.
    static bool are_sides_of_thin_part(const Vec3f& normal, const Vec3f& other, const Vec3f& way) {
        constexpr float kOpposed = -0.5f;
        return normal.dot(other) < kOpposed && way.dot(normal) < 0;
    }
    static constexpr float kElsewhere = 0.2f;      ///< spacings at rest between a point and where it comes in ...
    static constexpr float kStillElsewhere = 0.1f; ///< ... and until it counts as out
    /// Whether a place is not a surface point's own: its cell is not the same piece of matter, or it is at rest more
    /// than so many spacings from the point.
    bool is_elsewhere(Index surface_point, const Place& place, float spacings) const {
        if (!are_together(cell_of_point_[surface_point], place.cell)) return true;
        const float least = spacings * float(body_.spacing());
        return (rest_position(place) - body_.surface.points.rest[surface_point]).squaredNorm() > least * least;
    }
    /// The same, or one is three cells from the other and reached in three steps.
    bool are_in_three_steps(Index a, Index b) const;
    Index cell_at(int i, int j, int k) const; ///< kNoIndex where there is none
    /// The cell that a surface point is of, or that carries it.
    Index cell_of_point(std::size_t surface_point) const { return cell_of_point_[surface_point]; }
    /// Whether a surface point is of a part that has no cells of its own, and is carried by some that may be far away.
    bool is_loose(std::size_t surface_point) const { return is_loose_[surface_point]; }
    const Body& body() const { return body_; }

private:
    bool newton_step(const Vectors& positions, const Vec3f& point, Place& place, Mat3f& inverse, bool& converged) const;
    std::optional<Index> neighbour(Index cell, Vec3f& local) const;
    void find_rigid_box();
    void find_together();
    void spread_joined(Index middle, int n, const std::array<bool, 125>& exists, std::array<bool, 125>& reached) const;
    void find_cells_of_points();
    Index carrying_cell(std::size_t surface_point) const;

    const Body& body_;
    const bool is_rigid_;
    Vec3f rigid_low_ = Vec3f::Zero(), rigid_high_ = Vec3f::Zero();
    std::array<int, 3> counts_{0, 0, 0};
    std::vector<Index> grid_;                            ///< cell at each lattice index, kNoIndex where there is none
    std::vector<std::array<std::uint64_t, 2>> together_; ///< of each cell: bits of the 5^3 cells around it
    std::vector<Index> cell_of_point_;
    std::vector<std::uint8_t> is_loose_; ///< of each surface point
};

} // namespace filigree
