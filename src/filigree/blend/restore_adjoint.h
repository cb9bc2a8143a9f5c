// The adjoint of restoring: from what a function of the restored vertices changes by, to what it changes by with the
// pose.
#pragma once

#include "filigree/context.h"
#include "filigree/result.h"
#include "filigree/strip.h"

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace filigree {

/// How a restored vertex depends on the pose: p' = sum b_i (c_i' + A_i d_i), d_i = p - (m + c_i) / 2, m = sum b_i c_i,
/// with the three vertices of its cell. Linear, and the same for all poses.
struct VertexBonds {
    std::vector<Triangle> cells;                ///< driver vertices, one triple a vertex of the mesh
    std::vector<std::array<double, 3>> weights; ///< b_i: they sum to 1
    std::vector<std::array<Vec3d, 3>> offsets;  ///< d_i, model units
};
/// Of all vertices of the finest level, in its order. Cost O(V).
VertexBonds vertex_bonds(const Model& model);

/// Derivatives by the pose of a driver: of a number by the positions (g_i = dL / dc_i') and by the gradients
/// (G_i = dL / dA_i, row by column).
struct PoseDerivative {
    std::vector<Vec3f> positions;
    std::vector<Mat3f> gradients;
};

/// Multiplies with the transposed matrix of restoring, again and again. With the vertices' derivative v_p = dL / dp':
///     g_i = sum b_i v_p,   G_i = sum b_i v_p d_i^T
/// over the vertices p of the cells around i. Sums of a cell are in float, sixteen side by side; the rest in double.
/// The same bytes for any number of threads and any processor. About as fast as restoring.
class RestoreAdjoint {
public:
    /// Refers to nothing of the model later. level: as of RestoreOptions. Cost O(V). Errors: usage (no such level).
    static Result<RestoreAdjoint> create(const Model& model, std::optional<unsigned> level, const RunContext& context);
    RestoreAdjoint(RestoreAdjoint&&) noexcept;
    RestoreAdjoint& operator=(RestoreAdjoint&&) noexcept;
    ~RestoreAdjoint();

    std::size_t vertex_count() const; ///< of the level

    /// vertices: dL / dp', one a vertex of the level; finite. Cost O(V). Errors: mismatch (another number), cancelled.
    Result<PoseDerivative> apply(std::span<const Vec3f> vertices, const RunContext& context) const;

private:
    struct Content;
    explicit RestoreAdjoint(std::unique_ptr<Content> content);
    std::unique_ptr<Content> content_;
};

} // namespace filigree
