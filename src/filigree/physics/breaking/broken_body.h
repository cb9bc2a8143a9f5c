// A body cut into pieces: a body for each piece, and what holds the pieces together. Nothing here moves.
#pragma once

#include "filigree/core/lists.h"
#include "filigree/physics/world.h"

namespace filigree {

/// What pieces hold each other by in one cell.
struct CrackFacet {
    std::array<Index, 2> pieces; ///< ascending
    std::array<Index, 2> cells;  ///< of the pieces' bodies
    Index cell;                  ///< of the whole body
    Vec3f normal;                ///< unit, at rest, from the first piece to the second
    float area;                  ///< m^2, inside the body
    std::array<float, 8> shares; ///< of the area at the cell's corners; they sum to 1
    std::array<Index, 8> links;  ///< at those corners
};

/// What holds two pieces' copies of one corner together.
struct CrackLink {
    std::array<Index, 2> pieces; ///< ascending
    std::array<Index, 2> copies; ///< of the corner, one of each piece: numbers into BrokenBody::copies
    Index corner;                ///< of the whole body
    float area;                  ///< m^2: the corner's share of the facets around, all links together the facets' area
};

/// A corner of a piece's body.
struct CornerCopy {
    Index piece, corner;
};

/// Every cell of the whole body has a copy for each piece in it, with that piece's fraction of its mass and stiffness
/// (kLeastFraction at least); so do its corners (virtual nodes [Molino 2004]). Tied together the copies are the whole
/// body.
struct BrokenBody {
    std::shared_ptr<const Body> whole;
    std::vector<std::shared_ptr<const Body>> pieces;  ///< those that have matter
    std::vector<Index> piece_of_number;               ///< of the partition's numbers: index in `pieces`, or kNoIndex
    std::vector<Index> number_of_piece;               ///< the way back
    std::vector<std::vector<Index>> corners_of_whole; ///< of each piece: its corners' corners of the whole
    std::vector<std::vector<Index>> cells_of_whole;   ///< ... its cells' cells
    std::vector<Index> copy_offsets;                  ///< of each corner of the whole, into ...
    std::vector<CornerCopy> copies;                   ///< ... its copies, ascending by piece
    std::vector<CrackFacet> facets;
    std::vector<CrackLink> links; ///< ascending by corner
    IndexLists facets_of_link;    ///< in the cells around its corner
    IndexLists links_beside;      ///< those of a common piece at the corner itself and at the 26 around
    /// Of each piece, the number of its surface's points that lie on the body's surface; those after it lie on cracks.
    std::vector<Index> outer_points;
    /// Of each link, surface points that come to light when it breaks: in turn pieces and points.
    IndexLists points_of_link;

    std::span<const CornerCopy> copies_of(Index corner) const {
        return std::span(copies).subspan(copy_offsets[corner], copy_offsets[corner + 1] - copy_offsets[corner]);
    }
    /// The piece that a point at rest goes with.
    Index piece_at(const Vec3d& rest_point) const;
    Partition partition;
};

} // namespace filigree
