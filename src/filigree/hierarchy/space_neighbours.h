// For each vertex of a driver the vertices around it in space that tell how the matter there is deformed.
#pragma once

#include "filigree/context.h"
#include "filigree/mesh.h"
#include "filigree/mesh/edges.h"

namespace filigree {

enum class NeighbourKind {
    in_space,
    along_surface, ///< only those that are reached along the surface from nearby: cloth and skin
};

/// For each vertex 24 of the nearest and, in space, 8 of every eighth vertex, which see past a flat place; fewer where
/// there are no more. Ascending in distance within both, none at the vertex's own place and at most one a place. From
/// other connected parts only where the vertex's own has too few; and none that lies across a gap, where the surface
/// neither leads to it nearby nor has matter between. normals: one a vertex, zero where it has no face. Same lists for
/// any thread count. Cost O(V log V).
IndexLists space_neighbours(const Mesh& mesh, std::span<const Vec3f> normals, NeighbourKind kind,
                            const RunContext& context);

} // namespace filigree
