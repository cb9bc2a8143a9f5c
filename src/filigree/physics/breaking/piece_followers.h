// Points that go along with pieces of a body: each is carried as it is by the whole body, by its own piece's copies of
// the corners. Private to the layer.
#pragma once

#include "filigree/physics/breaking/cracks.h"

namespace filigree {

/// What goes along with one piece. A corner that the piece has no copy of is where the copy of another piece is, as
/// long as both are tied nearby; after that it goes on as its own nearest copy does.
struct PieceFollower {
    /// How a corner is reached by way of another piece: copies of the corner nearest to it that both have, and the
    /// other's copy of the corner itself. Numbers into BrokenBody::copies.
    struct Bridge {
        Index own, other, there;
    };
    struct Source {
        Index own = kNoIndex; ///< the piece's corner there, else its nearest
        bool is_copy = false;
        Index first_bridge = 0, last_bridge = 0;
    };
    Index piece = 0;
    std::vector<Index> points; ///< of the attachment
    Embedding embedding;       ///< of these, in the corners below
    Vectors rest;
    std::vector<Source> sources; ///< one a corner
    std::vector<Bridge> bridges; ///< nearest first
};

/// pieces: of each point.
std::vector<PieceFollower> make_followers(const BrokenBody& body, const Embedding& in_whole,
                                          std::span<const Index> pieces);
/// As Simulation::attached, of a body that has broken.
void move_followers(std::span<const PieceFollower> followers, const Cracks& cracks, std::span<const BodyState> bodies,
                    std::span<Vec3f> points, std::span<Mat3f> gradients, const RunContext& context);

} // namespace filigree
