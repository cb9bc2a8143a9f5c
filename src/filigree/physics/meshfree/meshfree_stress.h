// Stresses of meshfree particles, a block of them at a time, and the small matrices they are computed with. Private to
// the layer.
#pragma once

#include "filigree/core/lanes.h"
#include "filigree/physics/meshfree/mls_neighbours.h"

namespace filigree::meshfree {

constexpr std::size_t kStressBlock = 8; // particles that stresses are computed for at a time

/// A 3x3 matrix.
struct Columns {
    Float4 c[3]; // of a matrix; the fourth lane is unused or holds something else
};

FILIGREE_INLINE Float4 load3(const Vectors& v, std::size_t i) { return Float4{v.x[i], v.y[i], v.z[i], 0}; }
FILIGREE_INLINE Float4 times(const Columns& m, Float4 v) { return m.c[0] * v[0] + m.c[1] * v[1] + m.c[2] * v[2]; }
FILIGREE_INLINE Float4 cross(Float4 a, Float4 b) {
    const Float4 a1 = __builtin_shufflevector(a, a, 1, 2, 0, 3), b1 = __builtin_shufflevector(b, b, 1, 2, 0, 3);
    const Float4 c = a * b1 - a1 * b;
    return __builtin_shufflevector(c, c, 1, 2, 0, 3);
}
FILIGREE_INLINE float dot3(Float4 a, Float4 b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
FILIGREE_INLINE float squared_norm(const Columns& m) {
    return dot3(m.c[0], m.c[0]) + dot3(m.c[1], m.c[1]) + dot3(m.c[2], m.c[2]);
}
FILIGREE_INLINE Vec3f to_vector(Float4 a) { return {a[0], a[1], a[2]}; }
FILIGREE_INLINE Float4 to_lanes(const Vec3f& a) { return Float4{a.x(), a.y(), a.z(), 0}; }
FILIGREE_INLINE Mat3f to_matrix(const Columns& m) {
    Mat3f result;
    for (int a = 0; a < 3; ++a) result.col(a) = to_vector(m.c[a]);
    return result;
}
FILIGREE_INLINE Columns to_columns(const Mat3f& m) {
    Columns result;
    for (int a = 0; a < 3; ++a) result.c[a] = to_lanes(m.col(a));
    return result;
}

/// Elastic moduli of one particle.
struct Moduli {
    float mu, L, g0; // mu_s, L and g0 of [Smith 2018]
    float z;         // of the hourglass term
};

using StressLanes = float __attribute__((vector_size(4 * kStressBlock)));

/// Where what a block of particles has is found; arrays are padded to whole blocks.
struct BlockArrays {
    const float* volume;
    const Moduli* moduli;
    const std::array<float, 6>* inverse_moment;
    const Mat3f* inverse; // D; null: the identity
};
struct BlockResult {
    StressLanes stiffness, volume_ratio, squared; // bound of dP/dF over rank-one changes, J, |Fe|^2
};

/// From F of particles [first, first + count) to B, in place (see meshfree_elasticity.cpp). The same bytes on any
/// processor.
using StressLoop = void (*)(const BlockArrays&, std::size_t first, std::size_t count, Columns* gradients, BlockResult&);
StressLoop widest_stress();

} // namespace filigree::meshfree
