// Polygons by their connectivity: cut into triangles, walked over, and put together again along the cuts.
#pragma once

#include "filigree/pack/connectivity_code.h"

#include <functional>
#include <optional>

namespace filigree {

/// Contexts of a SymbolWriter that faces and their map's connectivity take, from 0 on.
inline constexpr unsigned kFaceContexts = kConnectivityContexts + 16;

/// Faces over vertices that are numbered in the order in which they are met, and the map they came from.
struct WalkedFaces {
    std::vector<Index> face_offsets = {0}, corners;
    ClosedMap map;
    std::vector<Index> number;     ///< of each of the map's vertices; kNoIndex where it closes a hole
    std::size_t met = 0;           ///< vertices; those of odd faces alone and those of no face are not met
    std::vector<Index> half_edges; ///< of each corner but those of odd faces, which come last: the map's from there

    /// Of each number the first of the map's vertices that has it.
    std::vector<std::size_t> first_with_number() const;
};

/// What an encoder knows besides: where everything was.
struct EncodedFaces {
    WalkedFaces walked;
    std::vector<Index> vertex;       ///< of each number the vertex: met ones, then the others, ascending
    std::vector<Index> face;         ///< of each walked face the face
    std::vector<Index> first_corner; ///< and which of its corners is first now
};

/// Of a half-edge of a face's own triangle, which of all faces' corners it begins at.
using FaceCorner = std::function<Index(Index)>;

/// Writes a surface's map, and says in which order a reader will have it.
using MapCode = std::function<WalkedMap(const ClosedSurface&, const FaceCorner&)>;

/// Writes faces: their map by `code_map`, the rest to `out`. Corners that name a vertex twice, and what does not lie in
/// a surface, are written one by one. Cost O(F log F).
EncodedFaces encode_faces(std::span<const Index> face_offsets, std::span<const Index> corners, std::size_t vertices,
                          const MapCode& code_map, SymbolWriter& out);
/// With the map's connectivity in one piece.
EncodedFaces encode_faces(std::span<const Index> face_offsets, std::span<const Index> corners, std::size_t vertices,
                          SymbolWriter& out);

/// The faces of a map that was read before; its opposites are found where they are wanted and not there. None: damaged,
/// or more than so many vertices or corners.
std::optional<WalkedFaces> decode_faces(ClosedMap map, SymbolReader& in, std::size_t vertices, std::size_t corners);
std::optional<WalkedFaces> decode_faces(SymbolReader& in, std::size_t vertices, std::size_t corners);

/// Triangles that so many corners can have, with those that close holes.
constexpr std::size_t most_triangles(std::size_t corners) { return 2 * corners + 2; }

} // namespace filigree
