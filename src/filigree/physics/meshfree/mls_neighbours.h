// Neighbours of free particles and their moving-least-squares weights [Mueller 2004].
#pragma once

#include "filigree/context.h"
#include "filigree/physics/body.h"

#include <array>
#include <span>

namespace filigree {

typedef float Float4 __attribute__((vector_size(16)));

/// Of a particle i with offsets X_ij = X_j - X_i to its neighbours j, closer than R:
///     s_ij = V_i V_j (1 - |X_ij|^2 / R^2)^3,  M_i = sum s_ij X_ij X_ij^T,  F_i = sum (x_j - x_i) (s_ij X_ij)^T M_i^-1,
/// with V relative to the cube of the spacing. s is symmetric, and so is being a neighbour. F is exact for affine
/// motions. Weights go with volumes so that forces on light particles are light.
struct MlsNeighbours {
    std::vector<Index> offsets;                       ///< particle i has pairs offsets[i] .. offsets[i + 1)
    std::vector<Index> neighbours;                    ///< ascending for each particle
    std::vector<Float4> pairs;                        ///< s X, s
    std::vector<float> weight_sum;                    ///< sum s
    std::vector<std::array<float, 6>> inverse_moment; ///< xx yy zz xy xz yz, 1/m^2
    std::vector<Vec3f> self_gradient;                 ///< -sum M^-1 s X: how F changes with the particle itself

    /// Where neighbours do not span space (a film, a string, a drop of one): directions without a gradient, in which F
    /// is the identity. Added to F; empty where all particles have gradients.
    std::vector<Mat3f> missing;

    std::size_t lonely_particles = 0; ///< that have missing directions

    std::size_t size() const { return weight_sum.size(); }
    Vec3f gradient(std::size_t particle, const Vec3f& weighted_offset) const {
        const auto& m = inverse_moment[particle];
        const Vec3f& v = weighted_offset;
        return {m[0] * v.x() + m[3] * v.y() + m[4] * v.z(), m[3] * v.x() + m[1] * v.y() + m[5] * v.z(),
                m[4] * v.x() + m[5] * v.y() + m[2] * v.z()};
    }
};

/// R is 1.74 spacings (26 neighbours on a lattice), and more for particles that would have fewer than eight neighbours
/// or none in some direction. volume: m^3. Positions must be finite. Cost O(particles log particles).
MlsNeighbours find_mls_neighbours(const Vectors& positions, std::span<const float> volume, double spacing,
                                  const RunContext& context);

} // namespace filigree
