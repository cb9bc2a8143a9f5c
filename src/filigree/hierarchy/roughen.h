// A mesh made rough for meshoptimizer, so that its simplification spreads vertices over flat and straight parts too.
#pragma once

#include "filigree/types.h"

#include <span>
#include <vector>

namespace filigree {

/// The positions, each moved along its vertex's normal by a random part of the edges there.
///
/// Collapses along a flat or straight part cost no quadric error, so such a part keeps a few needles that run along its
/// whole length, and no pose can bend those. On a rough surface a collapse costs about the square of its length, as
/// collapse_edges prices it. Vertices that stand out from their neighbours by as much already stay where they are.
///
/// names: of each vertex, what its random number hangs on; empty: its own number. keeps: 1 for each vertex that must
/// not move, or empty. Vertices without a triangle stay. Cost O(V + F).
std::vector<Vec3f> roughened(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                             std::span<const Index> names = {}, std::span<const std::uint8_t> keeps = {});

} // namespace filigree
