// What a surface has besides places, in a way that its levels can have it as well: texture coordinates and materials of
// wedges, colours of vertices.
#pragma once

#include "filigree/coding/closed_map.h"
#include "filigree/coding/face_code.h"
#include "filigree/coding/wedge.h"
#include "filigree/mesh.h"

namespace filigree {

/// The attributes of a map that is to be written.
struct SurfaceAttributes {
    AttributeOutline outline;
    std::vector<Wedge> wedges;
    std::vector<Index> wedge_at;   ///< of each half-edge that of its origin in its triangle; kNoIndex beside holes
    std::vector<ByteColor> colors; ///< of each vertex, or none

    bool empty() const { return outline.empty(); }
    /// Whether a half-edge lies between wedges that differ.
    bool is_seam(const ClosedMap& map, Index half_edge) const {
        const Index back = map.opposite[half_edge];
        return wedge_at[half_edge] != wedge_at[next_half_edge(back)] ||
               wedge_at[next_half_edge(half_edge)] != wedge_at[back];
    }
};

/// corner_of: of each half-edge of the mesh's own triangles, the mesh's corner at its origin.
SurfaceAttributes surface_attributes(const Mesh& mesh, const ClosedSurface& surface, const FaceCorner& corner_of);

/// What a reader has of a whole map: its wedges, and which one each corner has.
struct ReadAttributes {
    AttributeOutline outline;
    std::span<const Wedge> wedges;
    std::vector<Index> wedge_at;
    std::span<const ByteColor> colors;
};

/// A mesh's attributes out of its levels. Odd faces and vertices without faces are in none: theirs are coded apart.
struct LevelValues {
    AttributeOutline outline;
    std::size_t met = 0, walked_corners = 0; ///< vertices and corners that levels have, which come first
    CornerAttribute<Vec2f> uvs = {};
    std::vector<Vec4f> colors = {};
};
/// vertices: of the mesh, with those that were not met.
LevelValues level_values(const ReadAttributes& read, const WalkedFaces& walked, std::size_t vertices);

/// Contexts that what is coded apart takes.
inline constexpr unsigned kRestContexts = 7;
/// mesh: in the order of its code. with: outline and counts.
void encode_rest(const Mesh& mesh, const LevelValues& with, unsigned first_context, SymbolWriter& out);
/// False: damaged.
bool decode_rest(LevelValues& values, unsigned first_context, SymbolReader& in);

} // namespace filigree
