// Gradients and forces of meshfree particles, gathered over their neighbours. Private to the layer.
#pragma once

#include "filigree/physics/meshfree/meshfree_stress.h"

#include <cmath>

namespace filigree::meshfree {

/// Melted particles closer than `distance` repel each other a little. Nothing where the body does not melt.
struct Packing {
    std::vector<float>
        of_particle;             ///< the product of two is their pair's stiffness, N/m; empty: the body does not melt
    float distance = 0;          ///< m
    float scale = 0;             ///< of_particle of a melted particle over its volume
    float squared_frequency = 0; ///< bound on what all pairs add, 1/s^2

    bool acts_on(std::size_t i) const { return !of_particle.empty() && of_particle[i] > 0; }

    /// Calls visit(unit vector away from the neighbour, m of overlap, N/m) for the neighbours that particle i is too
    /// close to.
    template <class Visit>
    FILIGREE_INLINE void for_overlaps(const MlsNeighbours& neighbours, const Float4* position, std::size_t i,
                                      const Visit& visit) const {
        for (std::size_t k = neighbours.offsets[i]; k < neighbours.offsets[i + 1]; ++k) {
            const Index j = neighbours.neighbours[k];
            const Float4 d = position[i] - position[j];
            const float squared = dot3(d, d);
            const float stiffness = of_particle[i] * of_particle[j];
            if (!(squared < distance * distance && squared > 1e-12f * distance * distance && stiffness > 0)) continue;
            const float length = std::sqrt(squared);
            visit(d * (1 / length), distance - length, stiffness);
        }
    }
};

/// F of particle i.
FILIGREE_INLINE Columns gather_gradient(const MlsNeighbours& neighbours, const Float4* position, std::size_t i) {
    const Float4 x = position[i];
    Columns sum = {};
    for (std::size_t k = neighbours.offsets[i]; k < neighbours.offsets[i + 1]; ++k) {
        const Float4 pair = neighbours.pairs[k], d = position[neighbours.neighbours[k]] - x;
        for (int a = 0; a < 3; ++a) sum.c[a] += d * pair[a];
    }
    const auto& m = neighbours.inverse_moment[i];
    Columns F = {{sum.c[0] * m[0] + sum.c[1] * m[3] + sum.c[2] * m[4],
                  sum.c[0] * m[3] + sum.c[1] * m[1] + sum.c[2] * m[5],
                  sum.c[0] * m[4] + sum.c[1] * m[5] + sum.c[2] * m[2]}};
    if (!neighbours.missing.empty())
        for (int a = 0; a < 3; ++a) F.c[a] += to_lanes(neighbours.missing[i].col(a));
    return F;
}

/// The force on particle i; stress: B of each particle, with z in the last lane.
FILIGREE_INLINE Float4 gather_force(const MlsNeighbours& neighbours, const Packing& packing, const Float4* position,
                                    const Columns* stress, std::size_t i) {
    const Columns here = stress[i];
    const Float4 x = position[i];
    Float4 force = {};
    for (std::size_t k = neighbours.offsets[i]; k < neighbours.offsets[i + 1]; ++k) {
        const Index j = neighbours.neighbours[k];
        const Float4 pair = neighbours.pairs[k];
        const Columns& there = stress[j];
        const Float4 first = here.c[0] + there.c[0]; // and z_i + z_j in the last lane
        force += first * pair[0] + (here.c[1] + there.c[1]) * pair[1] + (here.c[2] + there.c[2]) * pair[2] +
                 (position[j] - x) * (first[3] * pair[3]);
    }
    if (packing.acts_on(i))
        packing.for_overlaps(neighbours, position, i,
                             [&](Float4 away, float overlap, float stiffness) { force += stiffness * overlap * away; });
    return force;
}

} // namespace filigree::meshfree
