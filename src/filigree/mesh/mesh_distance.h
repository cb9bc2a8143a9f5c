// How far one mesh is from another: vertex by vertex, or surface to surface.
#pragma once

#include "filigree/core/run_context.h"
#include "filigree/mesh/mesh.h"

#include <optional>

namespace filigree {

/// Vertex i of one mesh against vertex i of the other. Distances in model units.
struct VertexDistance {
    double rms = 0, max = 0;
    Index max_vertex = kNoIndex;
    /// Angle between vertex normals computed from the positions (not those stored), degrees; vertices without a
    /// normal in either mesh are left out.
    double normal_mean_deg = 0, normal_p95_deg = 0, normal_max_deg = 0;
    std::vector<float> per_vertex; ///< the distance of each vertex, for heat maps
};

/// Surface against surface, both ways, through samples: every vertex of a face, and points spread over the faces by
/// area.
struct SurfaceDistance {
    double hausdorff = 0;                       ///< the larger of the two maxima
    double mean_distance = 0, rms_distance = 0; ///< over the samples of both ways
    double max_a_to_b = 0, max_b_to_a = 0;
    double rms_a_to_b = 0, rms_b_to_a = 0; ///< over the samples of one way
};

struct MeshDistance {
    std::optional<VertexDistance> vertices;  ///< when both have the same number of vertices
    std::optional<SurfaceDistance> surfaces; ///< when both have faces
    double diagonal = 0;                     ///< of b's box: what fractions are taken of

    /// A distance in model units as a fraction of the diagonal; 0 where b has no extent.
    double relative(double units) const { return diagonal > 0 ? units / diagonal : 0.0; }
};

/// Vertex by vertex. Cost O(V + corners). Origins are respected. Errors: usage (check_mesh refuses one), mismatch
/// (another number of vertices).
Result<VertexDistance> vertex_distance(const Mesh& a, const Mesh& b, const RunContext& context);
/// The same for two shapes of one mesh. a, b: one position a vertex of `mesh`, whose faces give the normals. Nothing is
/// checked.
VertexDistance vertex_distance(const Mesh& mesh, std::span<const Vec3f> a, std::span<const Vec3f> b,
                               const RunContext& context);

/// a against b, vertex by vertex and surface to surface. samples: points spread over each surface besides its vertices
/// (seeded by the context). Cost O((V + samples) log F). Origins are respected. Errors: usage (check_mesh
/// refuses one), cancelled.
Result<MeshDistance> mesh_distance(const Mesh& a, const Mesh& b, std::size_t samples, const RunContext& context);

/// The distance of each of a's vertices from b's surface, model units, for heat maps. Cost O(V log F). Origins are
/// respected. Errors: usage (check_mesh refuses one), unsuitable (b has no faces), cancelled.
Result<std::vector<float>> distances_to_surface(const Mesh& a, const Mesh& b, const RunContext& context);

/// How much the edges at each vertex have changed their length: the mean over the edges of the faces at it of
/// |length in a / length in rest - 1|, over edges that have a length at rest. Cost O(corners).
/// Errors: usage (check_mesh refuses one), mismatch (the meshes do not have the same faces).
Result<std::vector<float>> edge_strains(const Mesh& a, const Mesh& rest);

} // namespace filigree
