// Gradients and forces of meshfree particles, gathered over their neighbours. Private to the layer.
#pragma once

#include "filigree/physics/meshfree/meshfree_stress.h"

namespace filigree::meshfree {

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
FILIGREE_INLINE Float4 gather_force(const MlsNeighbours& neighbours, const Float4* position, const Columns* stress,
                                    std::size_t i) {
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
    return force;
}

} // namespace filigree::meshfree
