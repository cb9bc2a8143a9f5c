// Faces turned away from what is inside: the one answer to "inside" that all of Filigree takes.
#pragma once

#include "filigree/sample.h"

#include <cstdint>
#include <string>

namespace filigree {

enum class FaceTurn : std::uint8_t { kept, turned, left_out };

/// Decides for each triangle of a welded surface (mesh/surface.h) whether it looks away from the inside:
///
/// - In a part without open edges, and in one whose cones over open edges (border_cones.h) have less than 0.6 of its
///   area, neighbours agree, and faces look outwards.
/// - Where edges have three triangles and more, the spaces that faces divide are told apart by the angles around those
///   edges. If all edges have an even number of triangles, spaces beside each other are in turn outside and inside;
///   else all closed ones are inside, and walls between them are left out. Of faces that are there twice one counts or
///   none, so that the number of triangles at each edge stays even where it was.
/// - A part that lies in an odd number of others is a cavity: its faces look inwards.
/// - Neighbours of other parts agree as far as mesh/orientation.h makes them. Where such parts together enclose a
///   volume of which all looks inwards, all are turned.
///
/// Cost O(F). Deterministic.
/// faces: the face of each triangle, ascending.
std::vector<FaceTurn> outward_turns(std::span<const Triangle> triangles, std::span<const Index> faces,
                                    std::span<const Vec3f> positions, OutwardReport& report);

} // namespace filigree
