// Tips of thin parts: where the surface sticks out of the quads, and a vertex of the grid held at each.
#pragma once

#include "filigree/remesh/manifold_surface.h"
#include "filigree/remesh/patch_grid.h"

namespace filigree {

/// The surface's vertices that are furthest from the quads, for each region beyond the bound the furthest one, and in
/// regions that go on for more than that distance further ones. Vertices on features and borders are none: curves hold
/// themselves. twins: opposite_half_edges of the surface; kinds, distances: of its vertices, distances and bound in
/// model units. Cost O(V).
std::vector<Index> find_tips(const ManifoldSurface& surface, std::span<const Index> twins,
                             std::span<const VertexKind> kinds, std::span<const float> distances, double bound);

/// Puts a vertex of the grid to each of the tips, the closest one along the surface's edges, and holds it there: relax
/// then draws its neighbours up the thin part instead of letting the quads slide down from it. Needs a grid as sampled:
/// one that has slid down has no vertex near. leash: how far untangling may take it from there, above 0. Returns how
/// many found one.
std::size_t hold_tips(const ManifoldSurface& surface, std::span<const Index> twins, std::span<const Index> tips,
                      double leash, PatchGrid& grid);

} // namespace filigree
