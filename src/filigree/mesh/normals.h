// Vertex normals from positions.
#pragma once

#include "filigree/core/run_context.h"
#include "filigree/mesh/mesh.h"

namespace filigree {

/// Unit vertex normals, one a vertex: the faces' normals weighted by area and angle-free (sum of cross products,
/// polygons by Newell's formula). Zero for a vertex without a face of positive area. Cost O(corners), deterministic.
/// positions: V points for the faces of `mesh` (mesh.positions or a deformed copy).
std::vector<Vec3f> vertex_normals(const Mesh& mesh, std::span<const Vec3f> positions, const RunContext& context);
/// The same for triangles.
std::vector<Vec3f> vertex_normals(std::span<const Triangle> triangles, std::span<const Vec3f> positions,
                                  const RunContext& context);

} // namespace filigree
