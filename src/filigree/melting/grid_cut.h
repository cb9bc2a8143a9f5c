// Triangles cut by the planes of a regular grid, so that every piece lies in one cell.
#pragma once

#include "filigree/melting/block_grid.h"
#include "filigree/mesh.h"

#include <unordered_map>

namespace filigree {

/// Cuts are made once an edge and known by the edge's ends, and where a vertex lies among the planes is decided once
/// and kept as an integer: so pieces fit together whatever the coordinates round to. Only triangles are ever cut, each
/// in two or three, as no rounding makes a triangle cross a plane twice.
class GridCut {
public:
    struct Piece {
        Triangle corners; ///< counter-clockwise as the triangle it is a piece of
        GridNode cell;
        Index source;
    };
    /// A vertex between two others, at from + part * (to - from).
    struct Between {
        Index from, to;
        float part;
    };

    /// positions: of the vertices that triangles refer to; m.
    GridCut(const BlockGrid& grid, std::span<const Vec3f> positions);

    /// Adds the pieces of a triangle. Cost O(pieces).
    void cut(const Triangle& triangle, Index source);

    const std::vector<Piece>& pieces() const { return pieces_; }
    Index first_cut() const { return first_cut_; } ///< cuts' vertices follow those that were given
    Index vertex_count() const { return Index(positions_.size()); }
    const Vec3f& position(Index vertex) const { return positions_[vertex]; }
    const Between& between(Index cut) const { return between_[cut - first_cut_]; }
    /// The cut between two vertices at the lowest plane between them; kNoIndex: none was made.
    Index cut_between(Index a, Index b) const;

    /// Twice the number of the plane that the vertex lies on, or of the plane below it and 1.
    std::int32_t place(Index vertex, int axis) const { return places_[vertex][std::size_t(axis)]; }
    bool is_on_plane(Index vertex, int axis) const { return (place(vertex, axis) & 1) == 0; }
    bool are_on_one_plane(Index a, Index b, int axis) const {
        return is_on_plane(a, axis) && place(a, axis) == place(b, axis);
    }

private:
    using Place = std::array<std::int32_t, 3>;

    void cut_along(int axis, const Triangle& triangle, std::vector<Triangle>& done);
    Index make_cut(Index a, Index b, int axis, std::int32_t plane);

    const BlockGrid& grid_;
    Index first_cut_;
    std::vector<Vec3f> positions_;
    std::vector<Place> places_;
    std::vector<Between> between_;
    std::unordered_map<std::uint64_t, Index> cuts_; ///< by edge
    std::vector<Piece> pieces_;
    std::array<std::vector<Triangle>, 3> done_; ///< of the triangle at hand, by axis
    std::vector<Triangle> left_;
};

} // namespace filigree
