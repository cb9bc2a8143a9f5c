// Where pieces of a body meet: a partition of space looked at on a grid of half a cell. Private to the layer.
#pragma once

#include "filigree/physics/body.h"
#include "filigree/physics/world.h"

namespace filigree {

/// Which piece is at each point of a grid of half a cell, a cell wider than the body; kNoIndex far from its cells.
class PieceGrid {
public:
    static constexpr int kMargin = 3; ///< half cells around the lattice

    PieceGrid(const Cells& cells, const Partition& partition, const RunContext& context);

    struct Region {
        std::vector<Vec3f> positions; ///< m
        std::vector<Triangle> triangles;
        std::vector<Index> cells; ///< of each triangle; kNoIndex: where the body has none
    };
    /// The closed border of a piece's part of space, by marching tetrahedra; corners lie on the border to 1e-4 of a
    /// cell. Where two pieces meet both borders have the same bytes. Empty for a piece that no grid point is in.
    Region region(Index piece) const;

    /// Whether all of the cell's grid points are of one piece.
    bool is_pure(Index cell) const;
    Index at_centre(Index cell) const; ///< the piece there

private:
    std::size_t index(int i, int j, int k) const {
        return (std::size_t(k) * std::size_t(counts_[1]) + std::size_t(j)) * std::size_t(counts_[0]) + std::size_t(i);
    }
    Vec3d point(int i, int j, int k) const {
        return cells_.origin + 0.5 * cells_.spacing * Vec3d(i - kMargin, j - kMargin, k - kMargin);
    }
    double crossing(Index piece, const Vec3d& from, const Vec3d& to, Index at_from, Index at_to) const;

    const Cells& cells_;
    const Partition& partition_;
    std::array<int, 3> counts_ = {0, 0, 0};
    std::vector<Index> pieces_;                              ///< of each grid point
    std::vector<std::array<std::array<int, 3>, 2>> extents_; ///< of each piece: lowest and highest grid point
};

} // namespace filigree
