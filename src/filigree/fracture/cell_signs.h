// Exact answers about Voronoi cells of integer seeds, without ties.
//
// Seed i's power at q is |s_i|^2 - w_i - 2 s_i . q; q is of cell i where that is least. D_ij = power_j - power_i is
// above zero throughout cell i. Each power has a different infinitesimal e_i added, e_i << e_j for i < j ([Edelsbrunner
// 1990], simulation of simplicity), so no answer is zero and all answers belong to one arrangement without
// coincidences.
#pragma once

#include "filigree/types.h"

#include <array>

namespace filigree {

using Wide = __int128;
using GridPoint = std::array<std::int64_t, 3>; ///< coordinates within +-2^18, of ghosts +-2^21

inline Vec3d to_double(const GridPoint& p) { return {double(p[0]), double(p[1]), double(p[2])}; }

/// Seeds on the integer grid; the last six are ghosts, far out along the axes, that bound every cell.
struct GridSeeds {
    std::vector<GridPoint> points;
    std::vector<std::int64_t> square; ///< |s|^2 - w, with w within +-2^36
    Index count = 0;                  ///< without the ghosts

    bool is_ghost(Index seed) const { return seed >= count; }
    std::int64_t power(Index seed, const GridPoint& q) const {
        const GridPoint& s = points[seed];
        return square[seed] - 2 * (s[0] * q[0] + s[1] * q[1] + s[2] * q[2]);
    }
    /// D_ij.
    std::int64_t margin(Index i, Index j, const GridPoint& q) const { return power(j, q) - power(i, q); }
    /// Of D_ij.
    GridPoint gradient(Index i, Index j) const {
        const GridPoint &a = points[i], &b = points[j];
        return {2 * (a[0] - b[0]), 2 * (a[1] - b[1]), 2 * (a[2] - b[2])};
    }
};

inline int sign_of(Wide x) { return (x > 0) - (x < 0); }

inline Wide determinant(const GridPoint& a, const GridPoint& b, const GridPoint& c) {
    return Wide(a[0]) * (Wide(b[1]) * c[2] - Wide(b[2]) * c[1]) - Wide(a[1]) * (Wide(b[0]) * c[2] - Wide(b[2]) * c[0]) +
           Wide(a[2]) * (Wide(b[0]) * c[1] - Wide(b[1]) * c[0]);
}

/// The sum of the components of a x b.
inline Wide cross_sum(const GridPoint& a, const GridPoint& b) {
    return Wide(a[1]) * b[2] - Wide(a[2]) * b[1] + Wide(a[2]) * b[0] - Wide(a[0]) * b[2] + Wide(a[0]) * b[1] -
           Wide(a[1]) * b[0];
}

/// The sign that a sum of infinitesimals has: that of the largest seed whose factor is not zero.
template <std::size_t N>
int sign_of_infinitesimals(std::array<std::pair<Index, int>, N> factor_signs) {
    int sign = 0;
    Index largest = 0;
    for (const auto& [seed, factor] : factor_signs)
        if (factor != 0 && (sign == 0 || seed > largest)) {
            sign = factor;
            largest = seed;
        }
    return sign;
}

/// Sign of D_ik at a vertex, from its value there.
inline int sign_at_vertex(std::int64_t d, Index i, Index k) {
    if (d != 0) return d > 0 ? 1 : -1;
    return k > i ? 1 : -1;
}

/// Sign of D_ik (b, at the edge's ends) where D_ij (a) is zero on a mesh edge.
inline int sign_on_edge(std::int64_t a0, std::int64_t a1, std::int64_t b0, std::int64_t b1, Index i, Index j, Index k) {
    const int denominator = a1 > a0 ? 1 : -1;
    if (const Wide d = Wide(b0) * a1 - Wide(b1) * a0) return sign_of(d) * denominator;
    const Wide of_j = b0 - b1, of_k = a1 - a0;
    return denominator *
           sign_of_infinitesimals<3>({{{j, sign_of(of_j)}, {k, sign_of(of_k)}, {i, sign_of(-of_j - of_k)}}});
}

/// Sign of D_il (c, at the triangle's corners) where D_ij (a) and D_ik (b) are zero in a triangle.
inline int sign_in_triangle(const GridPoint& a, const GridPoint& b, const GridPoint& c, Index i, Index j, Index k,
                            Index l) {
    const Wide of_l = cross_sum(a, b);
    if (const Wide d = determinant(a, b, c)) return sign_of(d) * sign_of(of_l);
    const Wide of_j = cross_sum(b, c), of_k = cross_sum(c, a);
    return sign_of(of_l) *
           sign_of_infinitesimals<4>(
               {{{j, sign_of(of_j)}, {k, sign_of(of_k)}, {l, sign_of(of_l)}, {i, sign_of(-of_j - of_k - of_l)}}});
}

/// Sign of D_im at the Voronoi vertex of i, j, k and l.
inline int sign_at_voronoi_vertex(const GridSeeds& seeds, Index i, Index j, Index k, Index l, Index m) {
    const GridPoint nj = seeds.gradient(i, j), nk = seeds.gradient(i, k), nl = seeds.gradient(i, l),
                    nm = seeds.gradient(i, m);
    const Wide of_m = determinant(nj, nk, nl), of_j = -determinant(nm, nk, nl), of_k = -determinant(nj, nm, nl),
               of_l = -determinant(nj, nk, nm);
    const auto constant = [&](Index seed) { return seeds.square[seed] - seeds.square[i]; };
    const Wide d = of_j * constant(j) + of_k * constant(k) + of_l * constant(l) + of_m * constant(m);
    if (d) return sign_of(d) * sign_of(of_m);
    return sign_of(of_m) * sign_of_infinitesimals<5>({{{j, sign_of(of_j)},
                                                       {k, sign_of(of_k)},
                                                       {l, sign_of(of_l)},
                                                       {m, sign_of(of_m)},
                                                       {i, sign_of(-of_j - of_k - of_l - of_m)}}});
}

/// a / b as a double that depends on the ratio alone.
inline double ratio(Wide a, Wide b) {
    Wide x = a < 0 ? -a : a, y = b < 0 ? -b : b;
    while (y != 0) {
        const Wide rest = x % y;
        x = y;
        y = rest;
    }
    return x == 0 ? 0 : double(a / x) / double(b / x);
}

} // namespace filigree
