#include "filigree/physics/meshfree/meshfree_stress.h"

namespace filigree::meshfree {

namespace {

FILIGREE_INLINE StressLanes greater(StressLanes a, StressLanes b) { return a > b ? a : b; }
FILIGREE_INLINE StressLanes square_root(StressLanes x) { // x >= 0
    typedef std::int32_t Ints __attribute__((vector_size(4 * kStressBlock)));
    x += 1e-30f;
    StressLanes y = (StressLanes)(0x5f3759df - ((Ints)x >> 1));
    for (int step = 0; step < 3; ++step) y = y * (1.5f - 0.5f * x * y * y);
    return x * y;
}

/// Matrices of kStressBlock particles, [row][column].
struct LaneMatrix {
    StressLanes m[3][3];
};
FILIGREE_INLINE LaneMatrix product(const LaneMatrix& a, const LaneMatrix& b) {
    LaneMatrix r;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) r.m[i][j] = a.m[i][0] * b.m[0][j] + a.m[i][1] * b.m[1][j] + a.m[i][2] * b.m[2][j];
    return r;
}
FILIGREE_INLINE LaneMatrix cofactor(const LaneMatrix& a) {
    LaneMatrix r;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            r.m[i][j] = a.m[(i + 1) % 3][(j + 1) % 3] * a.m[(i + 2) % 3][(j + 2) % 3] -
                        a.m[(i + 1) % 3][(j + 2) % 3] * a.m[(i + 2) % 3][(j + 1) % 3];
    return r;
}
/// A bound of the largest eigenvalue of A^T A: of numbers with mean m and variance v none is above m + sqrt(2 v).
FILIGREE_INLINE StressLanes largest_square(const LaneMatrix& a) {
    StressLanes diagonal[3], off = {};
    for (int i = 0; i < 3; ++i) {
        diagonal[i] = a.m[0][i] * a.m[0][i] + a.m[1][i] * a.m[1][i] + a.m[2][i] * a.m[2][i];
        const int j = (i + 1) % 3;
        const StressLanes o = a.m[0][i] * a.m[0][j] + a.m[1][i] * a.m[1][j] + a.m[2][i] * a.m[2][j];
        off += o * o;
    }
    const StressLanes mean = (diagonal[0] + diagonal[1] + diagonal[2]) * (1 / 3.f);
    StressLanes spread = 2 * off;
    for (const StressLanes& d : diagonal) spread += (d - mean) * (d - mean);
    return mean + square_root(spread * (2 / 3.f));
}

/// From F of a block's particles to B, in place.
FILIGREE_INLINE BlockResult stress_block(const BlockArrays& arrays, std::size_t first, std::size_t count,
                                         Columns* gradients) {
    LaneMatrix F{}, D{}, M{};
    StressLanes volume = {}, mu = {}, L = {}, g0 = {}, z = {};
    for (std::size_t l = 0; l < count; ++l) {
        const std::size_t i = first + l;
        for (int a = 0; a < 3; ++a)
            for (int r = 0; r < 3; ++r) F.m[r][a][l] = gradients[l].c[a][r];
        if (arrays.inverse)
            for (int a = 0; a < 3; ++a)
                for (int r = 0; r < 3; ++r) D.m[r][a][l] = arrays.inverse[i](r, a);
        const auto& m = arrays.inverse_moment[i];
        constexpr int kPlace[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
        for (int a = 0; a < 3; ++a)
            for (int r = 0; r < 3; ++r) M.m[r][a][l] = m[std::size_t(kPlace[r][a])];
        volume[l] = arrays.volume[i];
        mu[l] = arrays.moduli[i].mu;
        L[l] = arrays.moduli[i].L;
        g0[l] = arrays.moduli[i].g0;
        z[l] = arrays.moduli[i].z;
    }
    const LaneMatrix Fe = arrays.inverse ? product(F, D) : F;
    const LaneMatrix cof = cofactor(Fe);
    const StressLanes J = Fe.m[0][0] * cof.m[0][0] + Fe.m[0][1] * cof.m[0][1] + Fe.m[0][2] * cof.m[0][2];
    StressLanes I = {};
    for (int r = 0; r < 3; ++r)
        for (int a = 0; a < 3; ++a) I += Fe.m[r][a] * Fe.m[r][a];
    const StressLanes inverse = 1 / (I + 1);
    const StressLanes shear = mu * (1 - inverse), pressure = L * (J - g0);
    LaneMatrix P;
    for (int r = 0; r < 3; ++r)
        for (int a = 0; a < 3; ++a) P.m[r][a] = volume * (shear * Fe.m[r][a] + pressure * cof.m[r][a]);
    if (arrays.inverse) {
        LaneMatrix transposed;
        for (int r = 0; r < 3; ++r)
            for (int a = 0; a < 3; ++a) transposed.m[r][a] = D.m[a][r];
        P = product(P, transposed);
    }
    const LaneMatrix A = product(P, M);
    for (std::size_t l = 0; l < count; ++l)
        for (int a = 0; a < 3; ++a) {
            Float4 column = {};
            for (int r = 0; r < 3; ++r) column[r] = A.m[r][a][l] - z[l] * F.m[r][a][l];
            column[3] = z[l];
            gradients[l].c[a] = column;
        }

    // For changes v g^T: shear (g.g') I and pressure [F (g x g')] are a rotation's parts, so the larger counts; then
    // L (cof g)(cof g')^T, and what the logarithm adds.
    const StressLanes zero = {};
    const StressLanes stretch = largest_square(Fe);
    const StressLanes size = pressure > zero ? pressure : -pressure;
    StressLanes stiffness =
        greater(shear, size * square_root(stretch)) + L * largest_square(cof) + 2 * mu * inverse * inverse * stretch;
    if (arrays.inverse) stiffness *= largest_square(D);
    return {stiffness, J, I};
}

void stress_plain(const BlockArrays& arrays, std::size_t first, std::size_t count, Columns* gradients,
                  BlockResult& result) {
    result = stress_block(arrays, first, count, gradients);
}
#if defined(__x86_64__)
__attribute__((target("avx2"))) void stress_avx2(const BlockArrays& arrays, std::size_t first, std::size_t count,
                                                 Columns* gradients, BlockResult& result) {
    result = stress_block(arrays, first, count, gradients);
}
#endif

} // namespace

StressLoop widest_stress() {
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2")) return stress_avx2;
#endif
    return stress_plain;
}

} // namespace filigree::meshfree
