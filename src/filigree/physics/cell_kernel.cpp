// Based on: Smith, de Goes, Kim, Stable neo-Hookean flesh simulation, 2018 (the energy); Chen et al., Vertex block
// descent, 2024 (sweeps). Ours: the lattice cell. Its eight corners give eight sums X_m with the signs of a
// Walsh-Hadamard transform (m = 1, 2, 4: the edges' sums along x, y, z; the others bend the cell), in which
//     I = sum kappa_m |X_m|^2 / (4h)^2,  kappa = 1 for m = 1, 2, 4;  2/3 for 3, 5, 6;  1/3 for 7
//     J = det(X_1, X_2, X_4) / (4h)^3
// are exact. Lanes are cells beside each other along x: their corners are four rows, read as they lie, and what two
// cells add to a corner meets in a register. Nothing is gathered, and no order depends on the number of lanes.
// There is no fused multiply-add (the build turns contraction off), so every width gives the same bytes.
#include "filigree/physics/cell_kernel.h"

#include "filigree/core/lanes.h"
#include "filigree/core/parallel_for.h"
#include "filigree/physics/vertex_block.h"

#include <cassert>
#include <cmath>
#include <utility>

namespace filigree::cell_kernel {

namespace {

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

constexpr std::size_t kPadding = 16;          ///< floats between layers in Sums: whole registers are written
constexpr std::size_t kCellsPerSlab = 512;    ///< at least: with fewer, adding slabs up takes more than it gains
constexpr std::size_t kCornersPerSweep = 512; ///< of a piece of a sweep's color

/// A vector a lane.
template <int N>
struct Vectors3 {
    typename LaneTypes<N>::Float x, y, z;
};
template <int N>
FILIGREE_INLINE Vectors3<N> operator+(const Vectors3<N>& a, const Vectors3<N>& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <int N>
FILIGREE_INLINE Vectors3<N> operator-(const Vectors3<N>& a, const Vectors3<N>& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <int N>
FILIGREE_INLINE Vectors3<N> times(const Vectors3<N>& a, typename LaneTypes<N>::Float s) {
    return {a.x * s, a.y * s, a.z * s};
}
template <int N>
FILIGREE_INLINE typename LaneTypes<N>::Float dot(const Vectors3<N>& a, const Vectors3<N>& b) {
    return (a.x * b.x + a.y * b.y) + a.z * b.z;
}
template <int N>
FILIGREE_INLINE Vectors3<N> cross(const Vectors3<N>& a, const Vectors3<N>& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

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
    shape.cofactor[0] = cross<N>(X[2], X[4]);
    shape.cofactor[1] = cross<N>(X[4], X[1]);
    shape.cofactor[2] = cross<N>(X[1], X[2]);
    const float inverse2 = inverse_size * inverse_size;
    shape.I_linear = ((dot<N>(X[1], X[1]) + dot<N>(X[2], X[2])) + dot<N>(X[4], X[4])) * inverse2;
    shape.I_bent = (((dot<N>(X[3], X[3]) + dot<N>(X[5], X[5])) + dot<N>(X[6], X[6])) * (2.0f / 3.0f) +
                    dot<N>(X[7], X[7]) * (1.0f / 3.0f)) *
                   inverse2;
    shape.J = dot<N>(X[1], shape.cofactor[0]) * (inverse2 * inverse_size);
    return shape;
}

/// Constants of a material as the loops want them; size = 4 h.
struct Factors {
    float inverse_size, inverse_size2, inverse_size3;
    float shear, bulk; ///< Pa
    float rest_ratio;
    float shear_ratio;  ///< shear / bulk
    float rate;         ///< from an eigenvalue of the energy density in F, over bulk, to 1/s^2
    float shear_force;  ///< of X: shear h / 16
    float volume_force; ///< of the cofactor: bulk h^3 / (4 h)^3
    explicit Factors(const CellMaterial& m) {
        const float size = 4 * m.spacing;
        inverse_size = 1 / size;
        inverse_size2 = inverse_size * inverse_size;
        inverse_size3 = inverse_size2 * inverse_size;
        shear = m.shear;
        bulk = m.bulk;
        rest_ratio = m.rest_ratio;
        shear_ratio = m.shear / m.bulk;
        rate = 1.0001f * 4 * m.bulk / (m.density * m.spacing * m.spacing);
        shear_force = m.shear * m.spacing / 16;
        volume_force = m.bulk / 64;
    }
};

/// What a slab found about its cells, N at a time; the extremes are one number in the end.
template <int N>
struct Extremes {
    using Float = typename LaneTypes<N>::Float;
    Float rate = {}; ///< over Factors::rate
    Float J = Float{} + 1e30f;
    Float I = {};
};

/// Largest eigenvalue of the energy density's second derivative in F, over bulk: with the singular values s of F, c of
/// its cofactor, q = J - rest_ratio, a = 2 shear / (I + 1)^2 its part along s is
///     a s s^T + c c^T + q M,  M_12 = s_3 ..., plus shear I / (I + 1),
/// of which trace and Frobenius norm are polynomials in I, |c|^2 and J, and bound the largest eigenvalue (exactly,
/// where the two others are equal, as at rest). Across s it is at most |q| s_1. Bent cells add little and are bounded
/// roughly.
template <int N>
FILIGREE_INLINE typename LaneTypes<N>::Float stiffness_bound(const Factors& f, const CellShape<N>& shape,
                                                             typename LaneTypes<N>::Float I,
                                                             typename LaneTypes<N>::Float inverse_I1) {
    using Float = typename LaneTypes<N>::Float;
    const Float c2 = ((dot<N>(shape.cofactor[0], shape.cofactor[0]) + dot<N>(shape.cofactor[1], shape.cofactor[1])) +
                      dot<N>(shape.cofactor[2], shape.cofactor[2])) *
                     (f.inverse_size2 * f.inverse_size2);
    const Float a = (2 * f.shear_ratio) * inverse_I1 * inverse_I1;
    const Float q = shape.J - f.rest_ratio;
    const Float aI = a * shape.I_linear;
    const Float trace = aI + c2;
    const Float norm2 = ((aI * aI + c2 * c2) + 2.0f * q * q * shape.I_linear) +
                        (a * shape.J * (18.0f * shape.J + 12.0f * q) + 4.0f * q * shape.J * shape.I_linear);
    const Float spread = (2.0f / 3.0f) * (norm2 - trace * trace * (1.0f / 3.0f));
    const Float along = trace * (1.0f / 3.0f) + CellLanes<N>::square_root(spread > 0.0f ? spread : Float{});
    const Float across = CellLanes<N>::magnitude(q) * ((shape.I_linear + 3.0f) * 0.28867513f); // s_1 <= sqrt(I)
    const Float bent = a * (0.05f * shape.I_linear + 4.0f * shape.I_bent);
    return (f.shear_ratio * I * inverse_I1 + CellLanes<N>::most(along, across)) + bent;
}

/// What the cells on the left of a block's first corners add to them: sums over x of the right corners' forces, for
/// y, z and both.
template <int N>
struct Carry {
    Vectors3<N> right[4];
};

/// Forces of cells i .. i + N - 1 of a run (of which the first `count` are meant where Tail), added to corners i ..
/// i + N - 1.
template <int N, bool Tail>
FILIGREE_INLINE void add_forces(const Factors& f, const Vectors& positions, const Cells::Run& run, Index i, Index count,
                                const float* fraction, float* const* sums, Carry<N>& carry, Extremes<N>& extremes) {
    using L = CellLanes<N>;
    using Float = typename L::Float;
    using Int = typename L::Int;
    CellSums<N> s;
    transform<N>(positions, run.rows, i, s);
    const CellShape<N> shape = shape_of<N>(s, f.inverse_size);
    const Float I = shape.I_linear + shape.I_bent;
    const Float inverse_I1 = 1.0f / (I + 1.0f);
    Float stiffness = stiffness_bound<N>(f, shape, I, inverse_I1);
    stiffness = stiffness <= 3e38f ? stiffness : Float{} + std::numeric_limits<float>::infinity();

    const Float share = L::load(fraction + run.first_cell + i);
    const Float linear = share * (I * inverse_I1) * f.shear_force;
    const Float volume = share * (shape.J - f.rest_ratio) * f.volume_force;
    const Float bent = linear * (2.0f / 3.0f), last = linear * (1.0f / 3.0f);
    Vectors3<N> P[8]; // derivatives of the energy by X
    P[1] = times<N>(s.X[1], linear) + times<N>(shape.cofactor[0], volume);
    P[2] = times<N>(s.X[2], linear) + times<N>(shape.cofactor[1], volume);
    P[4] = times<N>(s.X[4], linear) + times<N>(shape.cofactor[2], volume);
    P[3] = times<N>(s.X[3], bent);
    P[5] = times<N>(s.X[5], bent);
    P[6] = times<N>(s.X[6], bent);
    P[7] = times<N>(s.X[7], last);

    if constexpr (Tail) {
        const Int mask = L::first(count);
        for (int m = 1; m < 8; ++m) P[m] = {L::keep(mask, P[m].x), L::keep(mask, P[m].y), L::keep(mask, P[m].z)};
        extremes.rate = L::most(extremes.rate, L::keep(mask, stiffness));
        extremes.I = L::most(extremes.I, L::keep(mask, I));
        extremes.J = L::least(extremes.J, mask ? shape.J : extremes.J);
    } else {
        extremes.rate = L::most(extremes.rate, stiffness);
        extremes.I = L::most(extremes.I, I);
        extremes.J = L::least(extremes.J, shape.J);
    }

    // Along x: corner i has the left force of cell i and the right one of cell i - 1.
    const Vectors3<N> right[4] = {times<N>(P[1], Float{} - 1.0f), Vectors3<N>{} - (P[2] + P[3]),
                                  Vectors3<N>{} - (P[4] + P[5]), Vectors3<N>{} - (P[6] + P[7])};
    const Vectors3<N> left[4] = {P[1], P[3] - P[2], P[5] - P[4], P[7] - P[6]};
    Vectors3<N> sum[4];
    for (int u = 0; u < 4; ++u) {
        sum[u] = {left[u].x + L::shift_in(carry.right[u].x, right[u].x),
                  left[u].y + L::shift_in(carry.right[u].y, right[u].y),
                  left[u].z + L::shift_in(carry.right[u].z, right[u].z)};
        carry.right[u] = right[u];
    }
    // Along y and z: the four rows.
    const Vectors3<N> a = sum[0] - sum[2], b = sum[1] - sum[3], c = sum[0] + sum[2], d = sum[1] + sum[3];
    const Vectors3<N> force[4] = {a - b, a + b, c - d, c + d};
    for (int row = 0; row < 4; ++row) {
        const std::size_t at = std::size_t{run.rows[row]} + i;
        float* const* to = row < 2 ? sums : sums + 3;
        L::add(to[0] + at, force[row].x);
        L::add(to[1] + at, force[row].y);
        L::add(to[2] + at, force[row].z);
    }
}

/// The corner after a run whose cells fill their last block.
template <int N>
FILIGREE_INLINE void add_last_corner(const Cells::Run& run, float* const* sums, const Carry<N>& carry) {
    const auto last = [](const Vectors3<N>& v) __attribute__((always_inline)) {
        return Vec3f(v.x[N - 1], v.y[N - 1], v.z[N - 1]);
    };
    const Vec3f sum[4] = {last(carry.right[0]), last(carry.right[1]), last(carry.right[2]), last(carry.right[3])};
    const Vec3f a = sum[0] - sum[2], b = sum[1] - sum[3], c = sum[0] + sum[2], d = sum[1] + sum[3];
    const Vec3f force[4] = {a - b, a + b, c - d, c + d};
    for (int row = 0; row < 4; ++row)
        for (int axis = 0; axis < 3; ++axis)
            sums[(row < 2 ? 0 : 3) + axis][std::size_t{run.rows[row]} + run.count] += force[row][axis];
}

/// Forces of a run's cells from i on, in blocks of N and then of as few as the rest needs.
template <int N>
FILIGREE_INLINE void add_run(const Factors& f, const Vectors& positions, const Cells::Run& run, Index i,
                             const float* fraction, float* const* sums, Carry<N>& carry, Extremes<N>& extremes) {
    for (; i + N <= run.count; i += N) add_forces<N, false>(f, positions, run, i, N, fraction, sums, carry, extremes);
    const Index rest = run.count - i;
    if (rest == 0) return add_last_corner<N>(run, sums, carry);
    if constexpr (N > 4)
        if (rest <= N / 2) {
            using L = CellLanes<N>;
            Carry<N / 2> half_carry;
            for (int u = 0; u < 4; ++u)
                half_carry.right[u] = {L::last_half(carry.right[u].x), L::last_half(carry.right[u].y),
                                       L::last_half(carry.right[u].z)};
            Extremes<N / 2> half;
            add_run<N / 2>(f, positions, run, i, fraction, sums, half_carry, half);
            extremes.rate = L::most(extremes.rate, L::twice(half.rate));
            extremes.I = L::most(extremes.I, L::twice(half.I));
            extremes.J = L::least(extremes.J, L::twice(half.J));
            return;
        }
    add_forces<N, true>(f, positions, run, i, rest, fraction, sums, carry, extremes);
}

struct ForceJob {
    const Plan& plan;
    const Vectors& positions;
    Sums& sums;
    std::span<ElasticReport> reports; ///< one a slab
};

template <int N>
FILIGREE_INLINE void add_slabs(const ForceJob& job, std::size_t begin, std::size_t end) {
    const Plan& plan = job.plan;
    const Factors factors(plan.material);
    for (std::size_t index = begin; index < end; ++index) {
        const Slab& slab = plan.slabs[index];
        Vectors& to = job.sums.of_parity[index % 2];
        const std::size_t first = plan.layer_starts[slab.first_layer] + kPadding * slab.first_layer;
        const std::size_t last = plan.layer_starts[slab.last_layer + 1] + kPadding * (slab.last_layer + 1);
        for (float* p : {to.x.data(), to.y.data(), to.z.data()}) std::fill(p + first, p + last, 0.0f);

        Extremes<N> extremes;
        for (std::size_t r = slab.first_run; r < slab.last_run; ++r) {
            const Cells::Run& run = plan.cells->runs[r];
            const std::size_t shift = kPadding * plan.run_layers[r];
            float* const sums[6] = {to.x.data() + shift,
                                    to.y.data() + shift,
                                    to.z.data() + shift,
                                    to.x.data() + shift + kPadding,
                                    to.y.data() + shift + kPadding,
                                    to.z.data() + shift + kPadding};
            Carry<N> carry = {};
            add_run<N>(factors, job.positions, run, 0, plan.fraction.data(), sums, carry, extremes);
        }
        ElasticReport& report = job.reports[index];
        float rate = 0, J = extremes.J[0], I = 0;
        for (int lane = 0; lane < N; ++lane) {
            rate = std::max(rate, extremes.rate[lane]);
            J = std::min(J, extremes.J[lane]);
            I = std::max(I, extremes.I[lane]);
        }
        report.squared_frequency = rate * factors.rate;
        report.least_volume_ratio = J;
        report.most_stretch = std::sqrt(I / 3);
    }
}

struct SweepJob {
    const Plan& plan;
    Vectors& positions;
    const Descent& descent;
    std::span<const Index> rows; ///< of equal parities in j and k
};

/// A force and a block (xx yy zz xy xz yz) for each of a row's cells.
constexpr int kSystem = 9;

/// Adds what cells i .. i + N - 1 of a run do to their corner of the color: side of the run's four rows; left corners
/// in the even lanes if left_first, right ones in the others.
template <int N, bool Tail>
FILIGREE_INLINE void add_systems(const Factors& f, const Vectors& positions, const Cells::Run& run, Index i,
                                 Index count, const float* fraction, int side, bool left_first, float* systems,
                                 std::size_t stride) {
    using L = CellLanes<N>;
    using Float = typename L::Float;
    using Int = typename L::Int;
    CellSums<N> sums;
    transform<N>(positions, run.rows, i, sums);
    const auto* X = sums.X;
    const CellShape<N> shape = shape_of<N>(sums, f.inverse_size);
    const Float I = shape.I_linear + shape.I_bent;
    const Float inverse_I1 = 1.0f / (I + 1.0f);
    const Float share = L::load(fraction + run.first_cell + i);

    const Int left = L::every_other(left_first);
    const Float sx = left ? Float{} - 1.0f : Float{} + 1.0f;
    const Float sy = Float{} + ((side & 1) ? 1.0f : -1.0f), sz = Float{} + ((side & 2) ? 1.0f : -1.0f), syz = sy * sz;
    const float b = 2.0f / 3.0f, c = 1.0f / 3.0f;
    // d(I / 2)/dx (4 h)^2 and dJ/dx (4 h)^3 of the corner.
    const auto by_corner = [&](auto axis) __attribute__((always_inline)) {
        return ((sy * axis(X[2]) + sz * axis(X[4])) + b * syz * axis(X[6])) +
               sx * ((axis(X[1]) + b * (sy * axis(X[3]) + sz * axis(X[5]))) + c * syz * axis(X[7]));
    };
    const auto normal = [&](auto axis) __attribute__((always_inline)) {
        return (sx * axis(shape.cofactor[0]) + sy * axis(shape.cofactor[1])) + sz * axis(shape.cofactor[2]);
    };
    const auto ax = [](const Vectors3<N>& v) __attribute__((always_inline)) { return v.x; };
    const auto ay = [](const Vectors3<N>& v) __attribute__((always_inline)) { return v.y; };
    const auto az = [](const Vectors3<N>& v) __attribute__((always_inline)) { return v.z; };
    const Float dx = by_corner(ax), dy = by_corner(ay), dz = by_corner(az);
    const Float nx = normal(ax), ny = normal(ay), nz = normal(az);

    const Float linear = share * (I * inverse_I1) * f.shear_force;
    const Float volume = share * f.volume_force;
    const Float pressure = volume * (shape.J - f.rest_ratio);
    const Float outer = (volume * f.inverse_size3);
    const Float logarithm = (2.0f * f.shear_force * f.inverse_size2) * share * inverse_I1 * inverse_I1;
    const Float diagonal = linear * (16.0f / 3.0f);
    const Float nsx = outer * nx, nsy = outer * ny, nsz = outer * nz;
    const Float dsx = logarithm * dx, dsy = logarithm * dy, dsz = logarithm * dz;
    const Float values[kSystem] = {Float{} - (linear * dx + pressure * nx),
                                   Float{} - (linear * dy + pressure * ny),
                                   Float{} - (linear * dz + pressure * nz),
                                   diagonal + (nsx * nx + dsx * dx),
                                   diagonal + (nsy * ny + dsy * dy),
                                   diagonal + (nsz * nz + dsz * dz),
                                   nsx * ny + dsx * dy,
                                   nsx * nz + dsx * dz,
                                   nsy * nz + dsy * dz};
    for (int k = 0; k < kSystem; ++k)
        L::add(systems + k * stride + i, Tail ? L::keep(L::first(count), values[k]) : values[k]);
}

template <int N>
FILIGREE_INLINE void add_run_systems(const Factors& f, const Vectors& positions, const Cells::Run& run, Index i,
                                     const float* fraction, int side, bool left_first, float* systems,
                                     std::size_t stride) {
    for (; i + N <= run.count; i += N)
        add_systems<N, false>(f, positions, run, i, N, fraction, side, left_first, systems, stride);
    const Index rest = run.count - i;
    if (rest == 0) return;
    if constexpr (N > 4)
        if (rest <= N / 2)
            return add_run_systems<N / 2>(f, positions, run, i, fraction, side, left_first, systems, stride);
    add_systems<N, true>(f, positions, run, i, rest, fraction, side, left_first, systems, stride);
}

/// Moves vertices `v`, v + 2 ... v + 2 (N - 1) of a row, as many as there are.
template <int N>
FILIGREE_INLINE void solve_vertices(const SweepJob& job, const Row& row, Index v, const float* systems,
                                    std::size_t stride) {
    using L = CellLanes<N>;
    using Float = typename L::Float;
    using Int = typename L::Int;
    const Descent& descent = job.descent;
    const Index count = std::min<Index>(N, (row.count - v + 1) / 2);
    const std::size_t first = std::size_t{row.first_corner} + v;
    Float s[kSystem]; // of the cell before and the cell after each vertex
    for (int k = 0; k < kSystem; ++k) {
        const float* from = systems + k * stride + v;
        const Float a = L::load(from), b = L::load(from + N);
        s[k] = L::template half_of<false>(a, b) + L::template half_of<true>(a, b);
    }
    if (descent.external)
        for (Index lane = 0; lane < count; ++lane)
            if (const Index corner = static_cast<Index>(first + 2 * lane); descent.touched[corner]) {
                Vec3f force(s[0][lane], s[1][lane], s[2][lane]);
                Symmetric3 block{s[3][lane], s[4][lane], s[5][lane], s[6][lane], s[7][lane], s[8][lane]};
                descent.external->add(corner, job.positions, force, block);
                const float values[kSystem] = {force.x(), force.y(), force.z(), block.xx, block.yy,
                                               block.zz,  block.xy,  block.xz,  block.yz};
                for (int k = 0; k < kSystem; ++k) s[k][lane] = values[k];
            }
    Float inertia = {};
    for (Index lane = 0; lane < count; ++lane) inertia[lane] = descent.inertia[first + 2 * lane];
    const auto every_second = [&](const std::vector<float>& from) __attribute__((always_inline)) {
        return L::template half_of<false>(L::load(from.data() + first), L::load(from.data() + first + N));
    };
    const Float x = every_second(job.positions.x), y = every_second(job.positions.y), z = every_second(job.positions.z);
    Float dx = inertia * (every_second(descent.target.x) - x) + s[0];
    Float dy = inertia * (every_second(descent.target.y) - y) + s[1];
    Float dz = inertia * (every_second(descent.target.z) - z) + s[2];
    solve_block(s[3] + inertia, s[4] + inertia, s[5] + inertia, s[6], s[7], s[8], dx, dy, dz);
    const float most = 1e30f; // infinite and NaN are above
    const Int good = (L::magnitude(dx) <= most) & (L::magnitude(dy) <= most) & (L::magnitude(dz) <= most);
    const Float moved[3] = {x + L::keep(good, dx), y + L::keep(good, dy), z + L::keep(good, dz)};
    for (Index lane = 0; lane < count; ++lane)
        if (const std::size_t corner = first + 2 * lane; !descent.fixed[corner]) {
            job.positions.x[corner] = moved[0][lane];
            job.positions.y[corner] = moved[1][lane];
            job.positions.z[corner] = moved[2][lane];
        }
}

/// Both colors of each row, one after the other: rows of equal parities in j and k share no cell.
template <int N>
FILIGREE_INLINE void sweep_rows(const SweepJob& job, std::size_t begin, std::size_t end) {
    const Plan& plan = job.plan;
    const Factors factors(plan.material);
    // Entry c + 1 is cell c, between vertices c and c + 1; the first stays zero, and so do those without a cell.
    const std::size_t stride = plan.longest_row + 1 + 2 * kPadding;
    std::vector<float> systems(kSystem * stride);
    for (std::size_t r = begin; r < end; ++r) {
        const Row& row = plan.rows[job.rows[r]];
        for (const bool odd_x : {false, true}) {
            const Index parity = row.odd_start != odd_x ? 1 : 0; // of the color's vertices, counted along the row
            for (int k = 0; k < kSystem; ++k) std::fill_n(systems.begin() + k * stride, row.count + 1, 0.0f);
            for (std::size_t n = row.first_neighbour; n < row.last_neighbour; ++n) {
                const Neighbour& neighbour = plan.neighbours[n];
                const Cells::Run& run = plan.cells->runs[neighbour.run];
                add_run_systems<N>(factors, job.positions, run, 0, plan.fraction.data(), neighbour.side,
                                   neighbour.offset % 2 == parity, systems.data() + neighbour.offset + 1, stride);
            }
            for (Index v = parity; v < row.count; v += 2 * N) solve_vertices<N>(job, row, v, systems.data(), stride);
        }
    }
}

using ForceFunction = void (*)(const ForceJob&, std::size_t, std::size_t);
using SweepFunction = void (*)(const SweepJob&, std::size_t, std::size_t);

// Sweeps read whole registers, so past a row's end corners that another thread may be moving; those lanes are dropped.
// That is all the thread sanitizer would find.
#define FILIGREE_READS_AHEAD __attribute__((no_sanitize("thread")))

#if defined(FILIGREE_HAS_WIDTHS)
FILIGREE_AVX512 void add_slabs_avx512(const ForceJob& job, std::size_t begin, std::size_t end) {
    add_slabs<16>(job, begin, end);
}
FILIGREE_AVX2 void add_slabs_avx2(const ForceJob& job, std::size_t begin, std::size_t end) {
    add_slabs<8>(job, begin, end);
}
FILIGREE_READS_AHEAD FILIGREE_AVX512 void sweep_rows_avx512(const SweepJob& job, std::size_t begin, std::size_t end) {
    sweep_rows<16>(job, begin, end);
}
FILIGREE_READS_AHEAD FILIGREE_AVX2 void sweep_rows_avx2(const SweepJob& job, std::size_t begin, std::size_t end) {
    sweep_rows<8>(job, begin, end);
}
#endif
void add_slabs_plain(const ForceJob& job, std::size_t begin, std::size_t end) { add_slabs<4>(job, begin, end); }
FILIGREE_READS_AHEAD void sweep_rows_plain(const SweepJob& job, std::size_t begin, std::size_t end) {
    sweep_rows<4>(job, begin, end);
}

ForceFunction force_function(int lanes) {
#if defined(FILIGREE_HAS_WIDTHS)
    if (lanes == 16) return add_slabs_avx512;
    if (lanes == 8) return add_slabs_avx2;
#endif
    assert(lanes == 4);
    return add_slabs_plain;
}
SweepFunction sweep_function(int lanes) {
#if defined(FILIGREE_HAS_WIDTHS)
    if (lanes == 16) return sweep_rows_avx512;
    if (lanes == 8) return sweep_rows_avx2;
#endif
    assert(lanes == 4);
    return sweep_rows_plain;
}

/// Fills layer_starts, run_layers and slabs.
void plan_slabs(Plan& plan) {
    const Cells& cells = *plan.cells;
    for (std::size_t c = 0; c < cells.corners.size(); ++c)
        if (c == 0 || cells.corners[c][2] != cells.corners[c - 1][2]) plan.layer_starts.push_back(c);
    plan.layer_starts.push_back(cells.corners.size());
    const auto layer_of = [&](Index corner) {
        return static_cast<std::size_t>(std::upper_bound(plan.layer_starts.begin(), plan.layer_starts.end(), corner) -
                                        plan.layer_starts.begin()) -
               1;
    };
    std::size_t cell_count = 0;
    for (std::size_t r = 0; r < cells.runs.size(); ++r) {
        plan.run_layers.push_back(layer_of(cells.runs[r].rows[0]));
        const bool new_layer = r == 0 || plan.run_layers[r] != plan.run_layers[r - 1];
        if (r == 0 || (new_layer && cell_count >= kCellsPerSlab)) {
            plan.slabs.push_back({r, r, plan.run_layers[r], 0});
            cell_count = 0;
        }
        cell_count += cells.runs[r].count;
        plan.slabs.back().last_run = r + 1;
        plan.slabs.back().last_layer = plan.run_layers[r] + 1;
    }
}

/// Fills rows, neighbours, row_colors and longest_row.
void plan_rows(Plan& plan) {
    const Cells& cells = *plan.cells;
    for (std::size_t c = 0; c < cells.corners.size(); ++c) {
        const auto& [i, j, k] = cells.corners[c];
        if (c > 0 && cells.corners[c - 1] == Cells::LatticeIndex{static_cast<std::uint16_t>(i - 1), j, k}) {
            ++plan.rows.back().count;
            continue;
        }
        plan.row_colors[(j & 1) + 2 * (k & 1)].push_back(static_cast<Index>(plan.rows.size()));
        plan.rows.push_back({static_cast<Index>(c), 1, (i & 1) != 0, 0, 0});
    }
    const auto row_of = [&](Index corner) {
        return static_cast<std::size_t>(std::upper_bound(plan.rows.begin(), plan.rows.end(), corner,
                                                         [](Index c, const Row& row) { return c < row.first_corner; }) -
                                        plan.rows.begin()) -
               1;
    };
    for (const Cells::Run& run : cells.runs)
        for (const Index start : run.rows) ++plan.rows[row_of(start)].last_neighbour;
    std::size_t total = 0;
    for (Row& row : plan.rows) {
        row.first_neighbour = total;
        total += row.last_neighbour;
        row.last_neighbour = row.first_neighbour;
        plan.longest_row = std::max<std::size_t>(plan.longest_row, row.count);
    }
    plan.neighbours.resize(total);
    for (std::size_t r = 0; r < cells.runs.size(); ++r)
        for (std::uint8_t side = 0; side < 4; ++side) {
            Row& row = plan.rows[row_of(cells.runs[r].rows[side])];
            plan.neighbours[row.last_neighbour++] = {static_cast<Index>(r), cells.runs[r].rows[side] - row.first_corner,
                                                     side};
        }
}

} // namespace

CellMaterial cell_material(const Material& material, double spacing) {
    const auto [lambda, mu] = lame_parameters(material.young_modulus, material.poisson_ratio);
    const double shear = 4.0 / 3.0 * mu, bulk = lambda + 5.0 / 6.0 * mu;
    return {static_cast<float>(spacing), static_cast<float>(material.density), static_cast<float>(shear),
            static_cast<float>(bulk), static_cast<float>(1 + 0.75 * shear / bulk)};
}

Plan make_plan(const Body& body) {
    Plan plan;
    plan.cells = &body.cells;
    plan.material = cell_material(body.material, body.cells.spacing);
    plan.fraction = body.cells.fraction;
    plan.fraction.resize(plan.fraction.size() + kPadding);
    plan_slabs(plan);
    plan_rows(plan);
    return plan;
}

std::span<const int> lane_counts() {
    static constexpr int kCounts[] = {4, 8, 16};
    return std::span(kCounts).first(vector_width_count());
}

ElasticReport forces(const Plan& plan, const Vectors& positions, Vectors& forces, Sums& sums,
                     const RunContext& context) {
    static const int lanes = lane_counts().back();
    return cell_kernel::forces(plan, positions, forces, sums, lanes, context);
}

ElasticReport forces(const Plan& plan, const Vectors& positions, Vectors& forces, Sums& sums, int lanes,
                     const RunContext& context) {
    assert(positions.size() == plan.cells->corners.size() && forces.size() == positions.size());
    const std::size_t layer_count = plan.layer_starts.size() - 1;
    const std::size_t needed = positions.size() + kPadding * (layer_count + 1);
    for (Vectors& parity : sums.of_parity)
        if (parity.size() != needed) parity = Vectors(needed);

    std::vector<ElasticReport> reports(plan.slabs.size());
    const ForceJob job{plan, positions, sums, reports};
    const ForceFunction add_slabs_of = force_function(lanes);
    parallel_for(context, plan.slabs.size(), 1,
                 [&](std::size_t begin, std::size_t end) { add_slabs_of(job, begin, end); });

    // A layer between slabs has something in both arrays.
    const auto sum_layers = [&](std::size_t begin, std::size_t end) {
        const auto slab_of = [&](std::size_t layer) { // the first that has it
            return static_cast<std::size_t>(
                std::partition_point(plan.slabs.begin(), plan.slabs.end(),
                                     [&](const Slab& slab) { return slab.last_layer < layer; }) -
                plan.slabs.begin());
        };
        for (std::size_t layer = begin; layer < end; ++layer) {
            const std::size_t slab = slab_of(layer);
            const bool shared = slab + 1 < plan.slabs.size() && plan.slabs[slab + 1].first_layer <= layer;
            const std::size_t first = plan.layer_starts[layer], last = plan.layer_starts[layer + 1];
            for (const auto axis : {&Vectors::x, &Vectors::y, &Vectors::z}) {
                const float* a = (sums.of_parity[slab % 2].*axis).data() + kPadding * layer;
                const float* b = (sums.of_parity[1 - slab % 2].*axis).data() + kPadding * layer;
                float* to = (forces.*axis).data();
                if (shared)
                    for (std::size_t c = first; c < last; ++c) to[c] = a[c] + b[c];
                else
                    std::copy(a + first, a + last, to + first);
            }
        }
    };
    constexpr std::size_t kCornersPerPiece = 1 << 14;
    const std::size_t layer_grain = std::max<std::size_t>(1, kCornersPerPiece * layer_count / (positions.size() + 1));
    parallel_for(context, layer_count, layer_grain, sum_layers);

    ElasticReport report;
    if (!reports.empty()) report = reports[0];
    for (const ElasticReport& r : reports) {
        report.squared_frequency = std::max(report.squared_frequency, r.squared_frequency);
        report.least_volume_ratio = std::min(report.least_volume_ratio, r.least_volume_ratio);
        report.most_stretch = std::max(report.most_stretch, r.most_stretch);
    }
    return report;
}

void sweep(const Plan& plan, Vectors& positions, const Descent& descent, const RunContext& context) {
    static const int lanes = lane_counts().back();
    sweep(plan, positions, descent, lanes, context);
}

void sweep(const Plan& plan, Vectors& positions, const Descent& descent, int lanes, const RunContext& context) {
    assert(positions.size() == plan.cells->corners.size());
    const SweepFunction sweep_rows_of = sweep_function(lanes);
    const std::size_t grain = std::max<std::size_t>(1, kCornersPerSweep * plan.rows.size() / (positions.size() + 1));
    for (const std::vector<Index>& rows : plan.row_colors) {
        const SweepJob job{plan, positions, descent, rows};
        parallel_for(context, rows.size(), grain,
                     [&](std::size_t begin, std::size_t end) { sweep_rows_of(job, begin, end); });
    }
}

} // namespace filigree::cell_kernel
