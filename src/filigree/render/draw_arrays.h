// A mesh in the shape a GPU draws: triangles over vertices that each have one normal and one UV.
#pragma once

#include "filigree/render.h"

namespace filigree {

struct DrawArrays {
    std::vector<Index> vertex;       ///< the mesh vertex of each draw vertex
    std::vector<Vec3f> normals;      ///< unit, one a draw vertex; zero where the faces have no area
    std::vector<Vec2f> uvs;          ///< empty or one a draw vertex
    std::vector<Triangle> triangles; ///< of draw vertices, by material
    std::vector<std::uint8_t> edges; ///< one a triangle: bit k is set where side k (from corner k to the next) is an
                                     ///< edge of the polygon
    struct Part {
        Index material = kNoIndex; ///< in mesh.materials.names
        Index first = 0, count = 0;
    };
    std::vector<Part> parts; ///< runs of triangles of one material
};

/// Vertices are shared wherever normal and UV agree. Vertices at the same place count as one for smoothing, so that a
/// triangle soup is smooth too. `positions` stand in for the mesh's own. Cost O(corners), and O(n^2) at a vertex of n
/// faces up to n = 256; beyond that its normals are smooth.
Result<DrawArrays> make_draw_arrays(const Mesh& mesh, std::span<const Vec3f> positions, const SurfaceOptions& options,
                                    const RunContext& context);

} // namespace filigree
