// Vertices in another order: what is near in space lies together, so that restoring streams through memory.
#pragma once

#include "filigree/context.h"
#include "filigree/core/lists.h"
#include "filigree/mesh.h"

#include <span>
#include <vector>

namespace filigree {

/// The vertices along Morton's curve over the mesh's box, 1,024 steps an axis; at one place as they come. The mesh
/// is not checked. Cost O(V).
std::vector<Index> order_by_place(const Mesh& mesh, const RunContext& context);

/// The mesh whose vertex i was vertex order[i]; order has each vertex once. Faces, and attributes of faces and corners,
/// stay in their order. inverse_order (core/lists.h) undoes it. The mesh is not checked. Cost O(size).
Mesh with_vertex_order(Mesh mesh, std::span<const Index> order, const RunContext& context);

} // namespace filigree
