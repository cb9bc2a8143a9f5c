// Gradients of a driver from its positions alone, or from positions and one ghost point a vertex.
#pragma once

#include "filigree/core/run_context.h"
#include "filigree/hierarchy/height_law.h"
#include "filigree/mesh/mesh.h"

namespace filigree {

/// How the gradient's normal column is found when only the surface is known.
enum class NormalColumn {
    fitted, ///< from the surface's curvature, pulled gently to s n': solid matter, bumps stretch with the body
    shell,  ///< s n' exactly: bumps keep their shape, for cloth and skin
};

/// Precomputed least-squares fits over the two-ring of every driver vertex. In rest coordinates (u, v, z) about the
/// vertex, z along its normal, positions are fitted by [u v z u^2 uv v^2] with a ridge on the quadratic terms; what is
/// left at run time is A_i = sum_j (c_j' - c_i') alpha_ij^T + s n_i' beta_i^T. Exact at rest, for rigid motions, and
/// with HeightLaw::proportional for uniform scale. A vertex without faces has the identity.
class GradientFit {
public:
    /// driver: the driver at rest. Cost O(V) fits of six unknowns.
    explicit GradientFit(const Mesh& driver, const RunContext& context);

    /// One gradient a vertex of the driver, whose vertices are now at `positions`; s by the law, from the areas of the
    /// one-rings. Cost O(V); same bytes for any thread count.
    std::vector<Mat3f> fit(std::span<const Vec3f> positions, NormalColumn normal_column, HeightLaw law,
                           const RunContext& context) const;
    /// The same, with the normal column given: ghosts[i] is where rest_ghosts()[i] went.
    std::vector<Mat3f> fit_to_ghosts(std::span<const Vec3f> positions, std::span<const Vec3f> ghosts,
                                     const RunContext& context) const;
    /// Replaces the normal column of given gradients by s n', n' and s from the gradients themselves.
    void make_shell(std::span<Mat3f> gradients, HeightLaw law) const;

    /// The points off the surface, a tenth of the mean edge along each vertex's normal (at the vertex where it has
    /// none).
    std::vector<Vec3f> rest_ghosts() const;

private:
    struct Weights {
        std::vector<Vec3d> alpha;      ///< one a neighbour
        std::vector<Vec3d> beta;       ///< one a vertex
        std::vector<Mat3d> rest_error; ///< identity minus the fit at rest; not zero only where the ring is degenerate
    };
    void find_rings();
    Weights solve(double normal_weight, const RunContext& context) const;
    std::vector<Mat3f> apply(const Weights& weights, std::span<const Vec3f> positions, std::span<const Vec3d> columns,
                             const RunContext& context) const;
    std::vector<double> ring_areas(std::span<const Vec3f> positions) const;

    Mesh driver_;
    std::vector<Vec3f> normals_;
    std::vector<double> rest_areas_, edge_lengths_;
    /// Two-ring of each vertex (neighbours share a face; they, and theirs), itself left out.
    std::vector<Index> ring_offsets_, ring_;
    Weights soft_, hard_;
};

} // namespace filigree
