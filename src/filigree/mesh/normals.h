// Normals from positions: of faces, weighted by area, and of vertices.
#pragma once

#include "filigree/context.h"
#include "filigree/mesh.h"

#include <Eigen/Geometry>

namespace filigree {

/// Twice the area vector of a face of three corners or more: along its normal, and twice as long as its area. Newell's
/// formula, from the first corner so that a small face far from the origin keeps its digits.
inline Vec3d doubled_area_vector(std::span<const Vec3f> positions, std::span<const Index> face) {
    const Vec3d first = positions[face[0]].cast<double>();
    Vec3d sum = Vec3d::Zero(), previous = positions[face[1]].cast<double>() - first;
    for (std::size_t i = 2; i < face.size(); ++i) {
        const Vec3d current = positions[face[i]].cast<double>() - first;
        sum += previous.cross(current);
        previous = current;
    }
    return sum;
}

/// Unit vertex normals, one a vertex: the faces' normals weighted by area and angle-free (sum of cross products,
/// polygons by Newell's formula). Zero for a vertex without a face of positive area. Cost O(corners), deterministic.
/// positions: V points for the faces of `mesh` (mesh.positions or a deformed copy). The mesh is not checked.
std::vector<Vec3f> vertex_normals(const Mesh& mesh, std::span<const Vec3f> positions, const RunContext& context);
/// The same for triangles.
std::vector<Vec3f> vertex_normals(std::span<const Triangle> triangles, std::span<const Vec3f> positions,
                                  const RunContext& context);

/// Makes every stored normal belong to one vertex: a value that corners of several vertices share (all corners of a
/// flat side, say) is copied for each further one, behind the others. Returns the vertex of each value, kNoIndex for a
/// value that no corner uses. The mesh is not checked. Cost O(corners).
std::vector<Index> split_shared_normals(Mesh& mesh);

} // namespace filigree
