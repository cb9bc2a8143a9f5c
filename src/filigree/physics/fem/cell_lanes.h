// Ours: lattice cells in lanes. A cell's eight corners give eight sums X_m with the signs of a Walsh-Hadamard transform
// (m = 1, 2, 4: the edges' sums along x, y, z; the others bend the cell), in which
//     I = sum kappa_m |X_m|^2 / (4h)^2,  kappa = 1 for m = 1, 2, 4;  2/3 for 3, 5, 6;  1/3 for 7
//     J = det(X_1, X_2, X_4) / (4h)^3
// are exact. Lanes are cells beside each other along x: their corners are four rows, read as they lie. Nothing is
// gathered, and no order depends on the number of lanes. There is no fused multiply-add (the build turns contraction
// off), so every width gives the same bytes. Private to the library.
#pragma once

#include "filigree/core/lanes.h"
#include "filigree/physics/fem/cell_kernel.h"

#include <cmath>
#include <utility>

namespace filigree::cell_kernel {

inline constexpr std::size_t kPadding = 16; ///< floats behind what a loop needs: it reads and writes whole registers

template <int N>
struct CellLanes : Lanes<N> {
    using typename LaneTypes<N>::Float;
    using typename LaneTypes<N>::Int;

    static FILIGREE_INLINE void add(float* p, Float x) { Lanes<N>::store(p, Lanes<N>::load(p) + x); }

    /// -1 in the first `count` lanes, 0 in the others.
    static FILIGREE_INLINE Int first(Index count) {
        return iota(std::make_integer_sequence<int, N>{}) < Int{} + static_cast<std::int32_t>(count);
    }
    /// -1 in lanes 0, 2, 4 ... if `even`, else in the others.
    static FILIGREE_INLINE Int every_other(bool even) {
        return (iota(std::make_integer_sequence<int, N>{}) & 1) == Int{} + (even ? 0 : 1);
    }
    /// x where the mask is set, 0 elsewhere, whatever x is.
    static FILIGREE_INLINE Float keep(Int mask, Float x) { return (Float)((Int)x & mask); }

    /// The last lane of `before`, then all of `x` but its last.
    static FILIGREE_INLINE Float shift_in(Float before, Float x) {
        return shift_in(before, x, std::make_integer_sequence<int, N>{});
    }
    /// Lanes 0, 2, 4 ... of a and b end to end; `Odd`: 1, 3, 5 ...
    template <bool Odd>
    static FILIGREE_INLINE Float half_of(Float a, Float b) {
        return half_of<Odd>(a, b, std::make_integer_sequence<int, N>{});
    }

    static FILIGREE_INLINE Float least(Float a, Float b) { return b < a ? b : a; }
    static FILIGREE_INLINE Float most(Float a, Float b) { return b > a ? b : a; }
    static FILIGREE_INLINE Float magnitude(Float x) { return (Float)((Int)x & 0x7fffffff); }

    static FILIGREE_INLINE Float square_root(Float x) {
#if defined(__x86_64__) &&                                                                                             \
    !defined(__clang__) // the vector types have no such operation; rounding is the same everywhere
        Float y;
        if constexpr (N == 4)
            asm("sqrtps %1, %0" : "=x"(y) : "x"(x));
        else
            asm("vsqrtps %1, %0" : "=v"(y) : "v"(x));
        return y;
#else
        for (int lane = 0; lane < N; ++lane) x[lane] = std::sqrt(x[lane]);
        return x;
#endif
    }

    using Half = typename LaneTypes<N == 4 ? 4 : N / 2>::Float;
    /// The last N / 2 lanes.
    static FILIGREE_INLINE Half last_half(Float x) { return last_half(x, std::make_integer_sequence<int, N / 2>{}); }
    /// Twice the same, end to end.
    static FILIGREE_INLINE Float twice(Half x) { return twice(x, std::make_integer_sequence<int, N>{}); }

private:
    template <int... I>
    static FILIGREE_INLINE Half last_half(Float x, std::integer_sequence<int, I...>) {
        return __builtin_shufflevector(x, x, (N / 2 + I)...);
    }
    template <int... I>
    static FILIGREE_INLINE Float twice(Half x, std::integer_sequence<int, I...>) {
        return __builtin_shufflevector(x, x, (I % (N / 2))...);
    }
    template <int... I>
    static FILIGREE_INLINE Int iota(std::integer_sequence<int, I...>) {
        return Int{I...};
    }
    template <int... I>
    static FILIGREE_INLINE Float shift_in(Float before, Float x, std::integer_sequence<int, I...>) {
        return __builtin_shufflevector(before, x, (N - 1 + I)...);
    }
    template <bool Odd, int... I>
    static FILIGREE_INLINE Float half_of(Float a, Float b, std::integer_sequence<int, I...>) {
        return __builtin_shufflevector(a, b, (2 * I + (Odd ? 1 : 0))...);
    }
};

/// A vector a lane.
template <int N>
using Vectors3 = LaneVector<typename LaneTypes<N>::Float>;

/// Sums X_1 ... X_7 of N cells along one axis from their four rows. Corners are subtracted before anything is added,
/// so a body far from the origin loses no more than its positions already have.
template <int N>
FILIGREE_INLINE void transform(const float* p, const std::array<Index, 4>& rows, Index i,
                               typename LaneTypes<N>::Float* X) {
    using Float = typename LaneTypes<N>::Float;
    Float l[4], r[4];
    for (int row = 0; row < 4; ++row) {
        l[row] = Lanes<N>::load(p + rows[row] + i);
        r[row] = Lanes<N>::load(p + rows[row] + i + 1);
    }
    const Float d0 = r[0] - l[0], d1 = r[1] - l[1], d2 = r[2] - l[2], d3 = r[3] - l[3];
    const Float low = d0 + d1, high = d2 + d3, low_turn = d1 - d0, high_turn = d3 - d2;
    X[1] = low + high;
    X[3] = low_turn + high_turn;
    X[5] = high - low;
    X[7] = high_turn - low_turn;
    const Float al = l[1] - l[0], bl = l[3] - l[2], ar = r[1] - r[0], br = r[3] - r[2];
    X[2] = (al + bl) + (ar + br);
    X[6] = (bl - al) + (br - ar);
    X[4] = ((l[2] - l[0]) + (l[3] - l[1])) + ((r[2] - r[0]) + (r[3] - r[1]));
}

template <int N>
struct CellSums {
    Vectors3<N> X[8]; ///< X[0] is not used
};
template <int N>
FILIGREE_INLINE void transform(const Vectors& positions, const std::array<Index, 4>& rows, Index i, CellSums<N>& sums) {
    typename LaneTypes<N>::Float x[8], y[8], z[8];
    transform<N>(positions.x.data(), rows, i, x);
    transform<N>(positions.y.data(), rows, i, y);
    transform<N>(positions.z.data(), rows, i, z);
    for (int m = 1; m < 8; ++m) sums.X[m] = {x[m], y[m], z[m]};
}

/// What the energy of N cells depends on.
template <int N>
struct CellShape {
    using Float = typename LaneTypes<N>::Float;
    Vectors3<N> cofactor[3]; ///< of (X_1, X_2, X_4), columns
    Float I_linear, I_bent;  ///< I is their sum
    Float J;
};
template <int N>
FILIGREE_INLINE CellShape<N> shape_of(const CellSums<N>& sums, float inverse_size) {
    const auto* X = sums.X;
    CellShape<N> shape;
    shape.cofactor[0] = cross(X[2], X[4]);
    shape.cofactor[1] = cross(X[4], X[1]);
    shape.cofactor[2] = cross(X[1], X[2]);
    const float inverse2 = inverse_size * inverse_size;
    shape.I_linear = ((dot(X[1], X[1]) + dot(X[2], X[2])) + dot(X[4], X[4])) * inverse2;
    shape.I_bent =
        (((dot(X[3], X[3]) + dot(X[5], X[5])) + dot(X[6], X[6])) * (2.0f / 3.0f) + dot(X[7], X[7]) * (1.0f / 3.0f)) *
        inverse2;
    shape.J = dot(X[1], shape.cofactor[0]) * (inverse2 * inverse_size);
    return shape;
}

/// Of crushed cells: kCrushFrom - J, from 0 to what it is where a cell is flat.
template <int N>
FILIGREE_INLINE typename LaneTypes<N>::Float crush_of(typename LaneTypes<N>::Float J) {
    using Float = typename LaneTypes<N>::Float;
    return CellLanes<N>::least(CellLanes<N>::most(kCrushFrom - J, Float{}), Float{} + kCrushFrom);
}

/// Constants of a material as the loops want them; size = 4 h.
struct Factors {
    float inverse_size, inverse_size2, inverse_size3;
    float shear, bulk; ///< Pa
    float rest_ratio;
    float shear_ratio;  ///< shear / bulk
    float crush;        ///< of CellMaterial
    float rate;         ///< from an eigenvalue of the energy density in F, over bulk, to 1/s^2
    float shear_force;  ///< of X: shear h / 16
    float volume_force; ///< of the cofactor: bulk h^3 / (4 h)^3
    // Of internal damping, s; stiffest: of an eigenvalue, over bulk.
    float seconds = 0, crushed_seconds = 0, stiffest = 0;
    explicit Factors(const CellMaterial& m) {
        const float size = 4 * m.spacing;
        inverse_size = 1 / size;
        inverse_size2 = inverse_size * inverse_size;
        inverse_size3 = inverse_size2 * inverse_size;
        shear = m.shear;
        bulk = m.bulk;
        rest_ratio = m.rest_ratio;
        shear_ratio = m.shear / m.bulk;
        crush = m.crush;
        rate = 1.0001f * 4 * m.bulk / (m.density * m.spacing * m.spacing);
        shear_force = m.shear * m.spacing / 16;
        volume_force = m.bulk / 64;
    }
};

} // namespace filigree::cell_kernel
