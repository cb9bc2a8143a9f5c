// Signs of small determinants, exactly: in doubles with a bound on their error; else in 128-bit integers; else as sums
// of doubles that do not overlap.
//
// Based on: [Shewchuk 1997], two_sum, expansion sums and products, and the form of the filters. We have one exact stage
// where he has three: coordinates on a dyadic grid, which make most ties, are decided by the integers before it.
#include "filigree/sample/exact_sign.h"

#include "filigree/core/exact_arithmetic.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace filigree::exact {

namespace {

// Rounding errors of the filters, as multiples of the sum of absolute products. [Shewchuk 1997] has (3 + 16u)u and
// (7 + 56u)u with u = 2^-53. Differences of numbers not below 2^-300 are not below 2^-352, so products of two do not
// underflow, and of three lose at most 2^-1075 each, which the absolute part covers.
constexpr double kBound2 = 3.4e-16, kBound3 = 8.9e-16;
constexpr double kUnderflow = 0x1p-1060;

int sign_of(double x) { return (x > 0) - (x < 0); }

__extension__ using Int128 = __int128;
int sign_of(Int128 x) { return (x > 0) - (x < 0); }

/// The numbers times the power of two that brings the largest just below 2^Bits; false when they are not integers then.
template <int Bits, std::size_t N>
bool to_integers(const std::array<double, N>& numbers, std::array<std::int64_t, N>& integers) {
    double largest = 0;
    for (const double x : numbers) largest = std::max(largest, std::abs(x));
    if (!(largest > 0)) return integers.fill(0), largest == 0;
    const double scale = std::ldexp(1.0, Bits - 1 - std::ilogb(largest));
    for (std::size_t i = 0; i < N; ++i) {
        const double scaled = numbers[i] * scale;
        if (!(std::abs(scaled) < double(std::int64_t{1} << Bits))) return false; // not a number
        integers[i] = static_cast<std::int64_t>(scaled);
        if (static_cast<double>(integers[i]) != scaled) return false;
    }
    return true;
}

/// A sum of doubles, ascending in size, none of which overlaps another; none is zero.
template <std::size_t Capacity>
struct Expansion {
    std::array<double, Capacity> terms;
    std::size_t count = 0;

    void add(double term) {
        if (term != 0) terms[count++] = term;
    }
    int sign() const { return count == 0 ? 0 : sign_of(terms[count - 1]); }
};

Expansion<2> difference(double a, double b) {
    const ExactPair d = exact_sum(a, -b);
    Expansion<2> result;
    result.add(d.low);
    result.add(d.high);
    return result;
}

/// The sum, by merging the terms in ascending size (fast_expansion_sum in [Shewchuk 1997]).
template <std::size_t N, std::size_t M>
Expansion<N + M> sum(const Expansion<N>& e, const Expansion<M>& f) {
    std::size_t i = 0, j = 0;
    const auto next = [&] {
        const bool from_e = j == f.count || (i < e.count && std::abs(e.terms[i]) < std::abs(f.terms[j]));
        return from_e ? e.terms[i++] : f.terms[j++];
    };
    Expansion<N + M> result;
    if (e.count + f.count == 0) return result;
    double carry = next();
    while (i + j < e.count + f.count) {
        const ExactPair s = exact_sum(carry, next());
        result.add(s.low);
        carry = s.high;
    }
    result.add(carry);
    return result;
}

template <std::size_t N>
Expansion<2 * N> product(const Expansion<N>& e, double factor) {
    Expansion<2 * N> result;
    double carry = 0;
    for (std::size_t i = 0; i < e.count; ++i) {
        const ExactPair p = exact_product(e.terms[i], factor);
        const ExactPair low = exact_sum(carry, p.low);
        result.add(low.low);
        const ExactPair high = exact_ordered_sum(p.high, low.high);
        result.add(high.low);
        carry = high.high;
    }
    result.add(carry);
    return result;
}

template <std::size_t N>
Expansion<4 * N> product(const Expansion<N>& e, const Expansion<2>& f) {
    Expansion<2 * N> low, high;
    if (f.count > 0) low = product(e, f.terms[0]);
    if (f.count > 1) high = product(e, f.terms[1]);
    return sum(low, high);
}

template <std::size_t N>
Expansion<N> negative(Expansion<N> e) {
    for (std::size_t i = 0; i < e.count; ++i) e.terms[i] = -e.terms[i];
    return e;
}

/// a d - b c
Expansion<16> minor(const Expansion<2>& a, const Expansion<2>& b, const Expansion<2>& c, const Expansion<2>& d) {
    return sum(product(a, d), negative(product(b, c)));
}

/// Sign of (bx - ax)(cy - ay) - (by - ay)(cx - ax).
int orient2d(double ax, double ay, double bx, double by, double cx, double cy, Tally* tally) {
    const double left = (bx - ax) * (cy - ay), right = (by - ay) * (cx - ax);
    const double determinant = left - right;
    const double permanent = std::abs(left) + std::abs(right);
    if (std::abs(determinant) > kBound2 * permanent + kUnderflow) return sign_of(determinant);
    if (permanent == 0) return 0; // products do not underflow: a factor of each is exactly zero

    std::array<std::int64_t, 6> n; // differences below 2^62, products below 2^124
    if (to_integers<61, 6>({ax, ay, bx, by, cx, cy}, n)) {
        if (tally) ++tally->integers;
        return sign_of(Int128(n[2] - n[0]) * (n[5] - n[1]) - Int128(n[3] - n[1]) * (n[4] - n[0]));
    }
    if (tally) ++tally->expansions;
    return minor(difference(bx, ax), difference(by, ay), difference(cx, ax), difference(cy, ay)).sign();
}

int orient3d_expansions(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d) {
    std::array<Expansion<2>, 3> u, v, w;
    for (int i = 0; i < 3; ++i) {
        const auto axis = static_cast<std::size_t>(i);
        u[axis] = difference(b[i], a[i]);
        v[axis] = difference(c[i], a[i]);
        w[axis] = difference(d[i], a[i]);
    }
    const auto x = product(minor(u[1], u[2], v[1], v[2]), w[0]);
    const auto y = product(minor(u[2], u[0], v[2], v[0]), w[1]);
    const auto z = product(minor(u[0], u[1], v[0], v[1]), w[2]);
    return sum(sum(x, y), z).sign();
}

} // namespace

int orient2d(const std::array<double, 2>& a, const std::array<double, 2>& b, const std::array<double, 2>& c,
             Tally* tally) {
    return orient2d(a[0], a[1], b[0], b[1], c[0], c[1], tally);
}

int orient3d(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d, Tally* tally) {
    const double ux = b[0] - a[0], uy = b[1] - a[1], uz = b[2] - a[2];
    const double vx = c[0] - a[0], vy = c[1] - a[1], vz = c[2] - a[2];
    const double wx = d[0] - a[0], wy = d[1] - a[1], wz = d[2] - a[2];
    const double yz = uy * vz, zy = uz * vy, zx = uz * vx, xz = ux * vz, xy = ux * vy, yx = uy * vx;
    const double determinant = wx * (yz - zy) + wy * (zx - xz) + wz * (xy - yx);
    const double permanent = std::abs(wx) * (std::abs(yz) + std::abs(zy)) +
                             std::abs(wy) * (std::abs(zx) + std::abs(xz)) +
                             std::abs(wz) * (std::abs(xy) + std::abs(yx));
    if (std::abs(determinant) > kBound3 * permanent + kUnderflow) return sign_of(determinant);
    if (permanent == 0) return 0;

    std::array<std::int64_t, 12> n; // differences below 2^41, 2x2 minors below 2^83, the sum below 2^126
    if (to_integers<40, 12>({a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2], d[0], d[1], d[2]}, n)) {
        if (tally) ++tally->integers;
        const auto from_a = [&](std::size_t point, std::size_t axis) { return Int128(n[3 * point + axis] - n[axis]); };
        const auto normal = [&](std::size_t i, std::size_t j) {
            return from_a(1, i) * from_a(2, j) - from_a(1, j) * from_a(2, i);
        };
        return sign_of(from_a(3, 0) * normal(1, 2) + from_a(3, 1) * normal(2, 0) + from_a(3, 2) * normal(0, 1));
    }
    if (tally) ++tally->expansions;
    return orient3d_expansions(a, b, c, d);
}

std::array<int, 3> normal_signs(const Vec3d& a, const Vec3d& b, const Vec3d& c, Tally* tally) {
    const auto component = [&](int i, int j) { return orient2d(a[i], a[j], b[i], b[j], c[i], c[j], tally); };
    return {component(1, 2), component(2, 0), component(0, 1)};
}

int orient3d_perturbed(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d, Tally* tally) {
    if (const int side = orient3d(a, b, c, d, tally)) return side;
    for (const auto& [i, j] : {std::pair{1, 2}, std::pair{2, 0}, std::pair{0, 1}})
        if (const int component = orient2d(a[i], a[j], b[i], b[j], c[i], c[j], tally)) return component;
    return 0;
}

int crosses_along_x(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& p) {
    const auto side_of_edge = [&](const Vec3d& from, const Vec3d& to) {
        if (const int side = orient2d({from[1], from[2]}, {to[1], to[2]}, {p[1], p[2]})) return side;
        if (from[2] != to[2]) return from[2] > to[2] ? 1 : -1;
        return (to[1] > from[1]) - (to[1] < from[1]);
    };
    const int side = side_of_edge(a, b);
    if (side == 0 || side_of_edge(b, c) != side || side_of_edge(c, a) != side) return 0;
    return orient3d_perturbed(a, b, c, p) != side ? side : 0;
}

} // namespace filigree::exact
