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

/// Makes every stored normal belong to one vertex: a value that corners of several vertices share (all corners of a
/// flat side, say) is copied for each further one, behind the others. Returns the vertex of each value, kNoIndex for a
/// value that no corner uses. Cost O(corners).
std::vector<Index> split_shared_normals(Mesh& mesh);

} // namespace filigree
