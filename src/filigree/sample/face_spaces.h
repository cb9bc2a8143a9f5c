// Surfaces with edges of three triangles and more: faces that are there twice, and the spaces that faces divide.
#pragma once

#include "filigree/mesh/edges.h"

#include <cstdint>

namespace filigree {

struct RepeatedFaces {
    std::vector<std::uint8_t> left_out;    ///< of each triangle: 1 where it does not count
    std::vector<std::uint8_t> all_of_part; ///< of each triangle: 1 where all of its part is there equally often
};
/// Triangles that do not count because their faces have the same vertices as others. Parts (faces that hang
/// together over edges) with an even number of triangles at each edge keep one of an odd number; if all of a part is
/// there equally often, and in the others, one of any number. faces: each triangle's, ascending. edges:
/// edges_of the triangles. Cost O(F).
RepeatedFaces repeated_faces(std::span<const Triangle> triangles, std::span<const Index> faces,
                             const IndexLists& edges);

/// Of each triangle 1, or -1, where all spaces that its part divides have winding numbers of 0 and more, or of 0 and
/// less, not all of them 0: the part is solids that touch or cross and look outwards, or inwards. 0: not so, or the
/// part is not closed, or its triangles do not cancel at each edge. Cost as sides_of_patches.
std::vector<std::int8_t> winding_signs(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                                       const IndexLists& edges);

/// Patches of faces: neighbours over edges of two triangles, which agree in direction.
struct Patches {
    std::vector<Index> of; ///< of each triangle
    std::size_t count = 0;
    std::vector<Index> part;                  ///< of each patch
    std::vector<std::uint8_t> part_is_open;   ///< of each part: leave it alone
    std::vector<std::uint8_t> part_is_odd;    ///< some edge has an odd number of triangles
    std::vector<std::uint8_t> part_is_simple; ///< no edge has more than two
};

/// Whether what lies before and behind each patch is inside.
struct PatchSides {
    std::vector<std::uint8_t> before, behind; ///< of each patch
    std::vector<std::uint8_t> part_is_known;  ///< of each part that is neither open nor simple: spaces could be told
};

/// triangles: those of a patch run the same way round. Cost O(F) and, at an edge of d triangles, O(d log d).
PatchSides sides_of_patches(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                            const IndexLists& edges, const Patches& patches);

} // namespace filigree
