// For each vertex of a driver the vertices around it in space that tell how the matter there is deformed.
#pragma once

#include "filigree/context.h"
#include "filigree/mesh.h"
#include "filigree/mesh/edges.h"

namespace filigree {

/// For each vertex: 24 of the nearest vertices, and 8 of every eighth vertex, which see past a flat place; fewer where
/// there are no more. Both ascend in distance; there is none at the vertex's own place and at most one at any place.
/// Other connected parts count only where the vertex's own part has too few. A vertex across a gap does not count: the
/// surface has to lead to it nearby, or matter has to be between. normals: one a vertex, zero where it has no face. The
/// same lists for any number of threads. Cost O(V log V).
IndexLists space_neighbours(const Mesh& mesh, std::span<const Vec3f> normals, const RunContext& context);

} // namespace filigree
