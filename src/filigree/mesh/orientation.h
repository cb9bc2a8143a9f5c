// Turning triangles so that neighbours run the same way round.
#pragma once

#include "filigree/mesh.h"

#include <cstdint>

namespace filigree {

/// Components whose neighbours cannot all agree, as of a band with half a turn: as far as they can, or left alone.
enum class OneSided { turned, left };

/// Which triangles to turn over so that neighbours agree: a byte each, 1 to turn. A component keeps the way that three
/// quarters of its area have; where neither has so much, it gets a positive volume. neighbour: of each half-edge
/// (mesh/edges.h) the one along the same edge, whichever way it runs, or kNoIndex. Cost O(F).
std::vector<std::uint8_t> triangles_to_turn(std::span<const Triangle> triangles, std::span<const Index> neighbour,
                                            std::span<const Vec3f> positions, OneSided one_sided);

/// Turns triangles over so that they agree with those they share an edge with, where no third one has it. Nothing is
/// turned where two faces that lie on one another meet at an edge, nor of what has one side. Returns how many were
/// turned. Cost O(F).
std::size_t orient(std::span<Triangle> triangles, std::span<const Vec3f> positions);

} // namespace filigree
