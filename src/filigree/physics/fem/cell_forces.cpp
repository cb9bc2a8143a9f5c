// Based on: Smith, de Goes, Kim, Stable neo-Hookean flesh simulation, 2018 (the energy). Elastic forces of whole cells:
// what two cells beside each other along x add to a corner meets in a register.
#include "filigree/core/parallel_for.h"
#include "filigree/physics/fem/cell_kernel.h"
#include "filigree/physics/fem/cell_lanes.h"

#include <algorithm>
#include <cassert>
#include <limits>

namespace filigree::cell_kernel {

namespace {

/// What a slab found about its cells, N at a time; the extremes are one number in the end.
template <int N>
struct Extremes {
    using Float = typename LaneTypes<N>::Float;
    Float rate = {}; ///< over Factors::rate
    Float damping = {};
    Float J = Float{} + 1e30f;
    Float I = {};
};

/// Largest eigenvalue of the energy density's second derivative in F, over bulk: with the singular values s of F, c of
/// its cofactor, q and e the first and second derivatives of its volume part in J, a = 2 shear / (I + 1)^2 its part
/// along s is
///     a s s^T + e c c^T + q M,  M_12 = s_3 ..., plus shear I / (I + 1),
/// of which trace and Frobenius norm are polynomials in I, |c|^2 and J, and bound the largest eigenvalue (exactly,
/// where the two others are equal, as at rest). Across s it is at most |q| s_1. Bending adds to a by its shares (at
/// most 2/3), has what it resists by itself (with r of bent_energy, shares of 500 r^2 + 2000 r I_bent), and hangs
/// together with the rest by a |F| |B| at most. A cell that is further inverted than it may come back by in a step has
/// no crush to come.
template <int N>
FILIGREE_INLINE typename LaneTypes<N>::Float
stiffness_bound(const Factors& f, const CellShape<N>& shape, typename LaneTypes<N>::Float I,
                typename LaneTypes<N>::Float inverse_I1, typename LaneTypes<N>::Float q,
                typename LaneTypes<N>::Float over, typename LaneTypes<N>::Float hard) {
    using Float = typename LaneTypes<N>::Float;
    using L = CellLanes<N>;
    const Float crush = shape.J < -kCrushSoon ? Float{} : crush_of<N>(shape.J - kCrushSoon);
    const Float e = 1.0f + (2.0f * hard) * crush;
    const Float c2 = ((dot(shape.cofactor[0], shape.cofactor[0]) + dot(shape.cofactor[1], shape.cofactor[1])) +
                      dot(shape.cofactor[2], shape.cofactor[2])) *
                     (f.inverse_size2 * f.inverse_size2) * e;
    const Float a = (2 * f.shear_ratio) * inverse_I1 * inverse_I1;
    const Float aI = a * shape.I_linear;
    const Float trace = aI + c2;
    const Float norm2 = ((aI * aI + c2 * c2) + 2.0f * q * q * shape.I_linear) +
                        (a * shape.J * (18.0f * e * shape.J + 12.0f * q) + 4.0f * e * q * shape.J * shape.I_linear);
    const Float spread = (2.0f / 3.0f) * (norm2 - trace * trace * (1.0f / 3.0f));
    const Float along = trace * (1.0f / 3.0f) + L::square_root(spread > 0.0f ? spread : Float{});
    const Float across = L::magnitude(q) * L::square_root(shape.I_linear); // s_1 <= sqrt(I)
    const Float bent =
        (f.shear_ratio * kBentStiffness) * over * ((2.0f / 3.0f) * over + (16.0f / 9.0f) * (kBentFrom + over)) +
        a * ((2.0f / 3.0f) * shape.I_bent);
    const Float both = a * (0.05f * shape.I_linear + 3.4f * shape.I_bent);
    return f.shear_ratio * I * inverse_I1 + (L::most(L::most(along, across), bent) + both);
}

/// What forces and the bound on stiffness depend on, of N cells.
template <int N>
struct CellLoad {
    using Float = typename LaneTypes<N>::Float;
    CellShape<N> shape;
    Float I, inverse_I1;
    Float q;    ///< derivative of the volume's energy by J, over bulk
    Float over; ///< r of bent_energy
    Float hard; ///< crush_stiffness
    FILIGREE_INLINE CellLoad(const Factors& f, const CellSums<N>& sums, Float fraction)
        : shape(shape_of<N>(sums, f.inverse_size)) {
        using L = CellLanes<N>;
        I = shape.I_linear + shape.I_bent;
        inverse_I1 = 1.0f / (I + 1.0f);
        const Float crush = crush_of<N>(shape.J);
        hard = f.crush * (L::most(fraction, Float{} + kLeastCrushed) / fraction);
        q = (shape.J - f.rest_ratio) - hard * crush * crush;
        over = L::least(L::most(shape.I_bent - kBentFrom, Float{}), Float{} + kBentMost);
    }
    FILIGREE_INLINE Float stiffness(const Factors& f) const {
        const Float bound = stiffness_bound<N>(f, shape, I, inverse_I1, q, over, hard);
        return bound <= 3e38f ? bound : Float{} + std::numeric_limits<float>::infinity();
    }
};

/// Which numbers cells have of their own: those of CellNumbers.
enum class CellKind { same, varied, grown };

/// Numbers a cell: Plan's. Those that its kind does not have are null.
struct CellNumbers {
    const float *fraction, *stiffness, *pace;
    std::array<const float*, Plan::Growth::kNumbers> growth;
};

/// The inverse of N cells' stretches G: their energy is that of F G^-1.
template <int N>
struct BackStretch {
    using Float = typename LaneTypes<N>::Float;
    Float xx, yy, zz, xy, xz, yz, bent;
    FILIGREE_INLINE BackStretch(const CellNumbers& cells, std::size_t cell) {
        using L = CellLanes<N>;
        const auto& of = cells.growth;
        xx = L::load(of[0] + cell), yy = L::load(of[1] + cell), zz = L::load(of[2] + cell);
        xy = L::load(of[3] + cell), xz = L::load(of[4] + cell), yz = L::load(of[5] + cell);
        bent = L::load(of[Plan::Growth::kBent] + cell);
    }
    /// Of sums; and, as it is symmetric, of derivatives by them.
    FILIGREE_INLINE void apply(Vectors3<N>* X) const {
        const Vectors3<N> x = X[1], y = X[2], z = X[4];
        X[1] = (xx * x + xy * y) + xz * z;
        X[2] = (xy * x + yy * y) + yz * z;
        X[4] = (xz * x + yz * y) + zz * z;
        for (const int m : {3, 5, 6, 7}) X[m] = bent * X[m];
    }
};

/// Moves sums to where damping has forces computed. Returns the time that cells are damped by, s.
template <int N, CellKind Kind>
FILIGREE_INLINE typename LaneTypes<N>::Float
look_ahead(const Factors& f, const CellLoad<N>& now, typename LaneTypes<N>::Float stiffness, const Vectors& velocities,
           const Cells::Run& run, Index i, const CellNumbers& cells, CellSums<N>& sums) {
    using L = CellLanes<N>;
    using Float = typename L::Float;
    CellSums<N> v;
    transform<N>(velocities, run.rows, i, v);
    if constexpr (Kind == CellKind::grown) BackStretch<N>(cells, run.first_cell + i).apply(v.X);
    const Float usual = f.seconds * (stiffness > f.stiffest ? f.stiffest / stiffness : Float{} + 1.0f);
    const Float flat = 1.0f - now.shape.J * (1 / InternalDamping::kDampedBelow);
    const Float seconds = L::most(usual, f.crushed_seconds * L::least(L::most(flat, Float{}), Float{} + 1.0f));
    Float squares = {};
    for (int m = 1; m < 8; ++m) squares = squares + dot(v.X[m], v.X[m]);
    const Float way = seconds * (L::square_root(squares) * f.inverse_size);
    const Float ahead = way > kMostAhead ? seconds * (kMostAhead / way) : seconds;
    for (int m = 1; m < 8; ++m) sums.X[m] = sums.X[m] + ahead * v.X[m];
    return seconds;
}

struct Motion {
    const Vectors& positions;
    const Vectors* velocities; ///< of internal damping
};

/// What the cells on the left of a block's first corners add to them: sums over x of the right corners' forces, for
/// y, z and both.
template <int N>
struct Carry {
    Vectors3<N> right[4];
};

/// Forces of cells i .. i + N - 1 of a run (of which the first `count` are meant where Tail), added to corners i ..
/// i + N - 1.
template <int N, bool Damped, CellKind Kind, bool Tail>
FILIGREE_INLINE void add_forces(const Factors& f, const Motion& motion, const Cells::Run& run, Index i, Index count,
                                const CellNumbers& cells, float* const* sums, Carry<N>& carry, Extremes<N>& extremes) {
    using L = CellLanes<N>;
    using Float = typename L::Float;
    using Int = typename L::Int;
    CellSums<N> s;
    transform<N>(motion.positions, run.rows, i, s);
    if constexpr (Kind == CellKind::grown) BackStretch<N>(cells, run.first_cell + i).apply(s.X);
    const Float filled = L::load(cells.fraction + run.first_cell + i);
    CellLoad<N> load(f, s, filled);
    Float share = filled, pace = {};
    if constexpr (Kind != CellKind::same) {
        share = filled * L::load(cells.stiffness + run.first_cell + i);
        pace = L::load(cells.pace + run.first_cell + i);
    }
    const auto stiffness_of = [&](const CellLoad<N>& of) __attribute__((always_inline)) {
        if constexpr (Kind != CellKind::same)
            return pace * of.stiffness(f);
        else
            return of.stiffness(f);
    };
    Float stiffness = stiffness_of(load), seconds = {};
    const Float J = load.shape.J, I_now = load.I;
    if constexpr (Damped) {
        seconds = look_ahead<N, Kind>(f, load, stiffness, *motion.velocities, run, i, cells, s);
        load = CellLoad<N>(f, s, filled);
        stiffness = L::most(stiffness, stiffness_of(load));
    }
    const CellShape<N>& shape = load.shape;

    const Float linear = share * (load.I * load.inverse_I1) * f.shear_force;
    const Float volume = share * load.q * f.volume_force;
    const Float bending = linear + share * (kBentStiffness * f.shear_force) * (load.over * load.over);
    const Float bent = bending * (2.0f / 3.0f), last = bending * (1.0f / 3.0f);
    Vectors3<N> P[8]; // derivatives of the energy by X
    P[1] = linear * s.X[1] + volume * shape.cofactor[0];
    P[2] = linear * s.X[2] + volume * shape.cofactor[1];
    P[4] = linear * s.X[4] + volume * shape.cofactor[2];
    P[3] = bent * s.X[3];
    P[5] = bent * s.X[5];
    P[6] = bent * s.X[6];
    P[7] = last * s.X[7];
    if constexpr (Kind == CellKind::grown) BackStretch<N>(cells, run.first_cell + i).apply(P);

    if constexpr (Tail) {
        const Int mask = L::first(count);
        for (int m = 1; m < 8; ++m) P[m] = {L::keep(mask, P[m].x), L::keep(mask, P[m].y), L::keep(mask, P[m].z)};
        extremes.rate = L::most(extremes.rate, L::keep(mask, stiffness));
        extremes.damping = L::most(extremes.damping, L::keep(mask, seconds * stiffness));
        extremes.I = L::most(extremes.I, L::keep(mask, I_now));
        extremes.J = L::least(extremes.J, mask ? J : extremes.J);
    } else {
        extremes.rate = L::most(extremes.rate, stiffness);
        extremes.damping = L::most(extremes.damping, seconds * stiffness);
        extremes.I = L::most(extremes.I, I_now);
        extremes.J = L::least(extremes.J, J);
    }

    // Along x: corner i has the left force of cell i and the right one of cell i - 1.
    const Vectors3<N> right[4] = {(Float{} - 1.0f) * P[1], Vectors3<N>{} - (P[2] + P[3]), Vectors3<N>{} - (P[4] + P[5]),
                                  Vectors3<N>{} - (P[6] + P[7])};
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
template <int N, bool Damped, CellKind Kind>
FILIGREE_INLINE void add_run(const Factors& f, const Motion& motion, const Cells::Run& run, Index i,
                             const CellNumbers& cells, float* const* sums, Carry<N>& carry, Extremes<N>& extremes) {
    for (; i + N <= run.count; i += N)
        add_forces<N, Damped, Kind, false>(f, motion, run, i, N, cells, sums, carry, extremes);
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
            add_run<N / 2, Damped, Kind>(f, motion, run, i, cells, sums, half_carry, half);
            extremes.rate = L::most(extremes.rate, L::twice(half.rate));
            extremes.damping = L::most(extremes.damping, L::twice(half.damping));
            extremes.I = L::most(extremes.I, L::twice(half.I));
            extremes.J = L::least(extremes.J, L::twice(half.J));
            return;
        }
    add_forces<N, Damped, Kind, true>(f, motion, run, i, rest, cells, sums, carry, extremes);
}

struct ForceJob {
    const Plan& plan;
    Motion motion;
    Factors factors;
    Sums& sums;
    std::span<ElasticReport> reports; ///< one a slab
};

template <int N, bool Damped, CellKind Kind>
FILIGREE_INLINE void add_slabs(const ForceJob& job, std::size_t begin, std::size_t end) {
    const Plan& plan = job.plan;
    const Factors& factors = job.factors;
    CellNumbers cells{plan.fraction.data(), plan.stiffness.data(), plan.pace.data(), {}};
    if constexpr (Kind == CellKind::grown) {
        std::ranges::transform(plan.growth.numbers, cells.growth.begin(), [](const auto& of) { return of.data(); });
        cells.stiffness = cells.growth[Plan::Growth::kShare];
        cells.pace = plan.growth.pace.data();
    }
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
            add_run<N, Damped, Kind>(factors, job.motion, run, 0, cells, sums, carry, extremes);
        }
        ElasticReport& report = job.reports[index];
        float rate = 0, damping = 0, J = extremes.J[0], I = 0;
        for (int lane = 0; lane < N; ++lane) {
            rate = std::max(rate, extremes.rate[lane]);
            damping = std::max(damping, extremes.damping[lane]);
            J = std::min(J, extremes.J[lane]);
            I = std::max(I, extremes.I[lane]);
        }
        report.squared_frequency = rate * factors.rate;
        report.damping_rate = damping * factors.rate;
        report.least_volume_ratio = J;
        report.most_stretch = std::sqrt(I / 3);
    }
}

using ForceFunction = void (*)(const ForceJob&, std::size_t, std::size_t);

#if defined(FILIGREE_HAS_WIDTHS)
template <bool Damped, CellKind Kind>
FILIGREE_AVX512 void add_slabs_avx512(const ForceJob& job, std::size_t begin, std::size_t end) {
    add_slabs<16, Damped, Kind>(job, begin, end);
}
template <bool Damped, CellKind Kind>
FILIGREE_AVX2 void add_slabs_avx2(const ForceJob& job, std::size_t begin, std::size_t end) {
    add_slabs<8, Damped, Kind>(job, begin, end);
}
#endif
template <bool Damped, CellKind Kind>
void add_slabs_plain(const ForceJob& job, std::size_t begin, std::size_t end) {
    add_slabs<4, Damped, Kind>(job, begin, end);
}

template <bool Damped, CellKind Kind>
ForceFunction force_function(int lanes) {
#if defined(FILIGREE_HAS_WIDTHS)
    if (lanes == 16) return add_slabs_avx512<Damped, Kind>;
    if (lanes == 8) return add_slabs_avx2<Damped, Kind>;
#endif
    assert(lanes == 4);
    return add_slabs_plain<Damped, Kind>;
}

template <CellKind Kind>
ForceFunction force_function(int lanes, bool is_damped) {
    return is_damped ? force_function<true, Kind>(lanes) : force_function<false, Kind>(lanes);
}

ForceFunction force_function(int lanes, bool is_damped, const Plan& plan) {
    if (plan.grows()) return force_function<CellKind::grown>(lanes, is_damped);
    if (!plan.stiffness.empty()) return force_function<CellKind::varied>(lanes, is_damped);
    return force_function<CellKind::same>(lanes, is_damped);
}

Factors factors_of(const Plan& plan, const InternalDamping* damping) {
    Factors factors(plan.material);
    if (!damping) return factors;
    factors.seconds = damping->seconds;
    factors.crushed_seconds = damping->crushed_seconds;
    factors.stiffest = damping->stiffest / factors.rate;
    return factors;
}

/// Forces of the corners in layers [begin, end), from what the slabs have. A layer between slabs has something in both
/// arrays.
void sum_layers(const Plan& plan, const Sums& sums, std::size_t begin, std::size_t end, Vectors& forces) {
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
}

} // namespace

ElasticReport forces(const Plan& plan, const Vectors& positions, Vectors& forces, Sums& sums, const RunContext& context,
                     const InternalDamping* damping) {
    static const int lanes = lane_counts().back();
    return cell_kernel::forces(plan, positions, forces, sums, lanes, context, damping);
}

ElasticReport forces(const Plan& plan, const Vectors& positions, Vectors& forces, Sums& sums, int lanes,
                     const RunContext& context, const InternalDamping* damping) {
    assert(positions.size() == plan.cells->corners.size() && forces.size() == positions.size());
    const std::size_t layer_count = plan.layer_starts.size() - 1;
    const std::size_t needed = positions.size() + kPadding * (layer_count + 1);
    for (Vectors& parity : sums.of_parity)
        if (parity.size() != needed) parity = Vectors(needed);

    std::vector<ElasticReport> reports(plan.slabs.size());
    const Motion motion{positions, damping ? &damping->velocities : nullptr};
    const ForceJob job{plan, motion, factors_of(plan, damping), sums, reports};
    const ForceFunction add_slabs_of = force_function(lanes, damping != nullptr, plan);
    parallel_for(context, plan.slabs.size(), 1,
                 [&](std::size_t begin, std::size_t end) { add_slabs_of(job, begin, end); });

    constexpr std::size_t kCornersPerPiece = 1 << 14;
    const std::size_t layer_grain = std::max<std::size_t>(1, kCornersPerPiece * layer_count / (positions.size() + 1));
    parallel_for(context, layer_count, layer_grain,
                 [&](std::size_t begin, std::size_t end) { sum_layers(plan, sums, begin, end, forces); });

    ElasticReport report;
    if (!reports.empty()) report = reports[0];
    for (const ElasticReport& r : reports) {
        report.squared_frequency = std::max(report.squared_frequency, r.squared_frequency);
        report.damping_rate = std::max(report.damping_rate, r.damping_rate);
        report.least_volume_ratio = std::min(report.least_volume_ratio, r.least_volume_ratio);
        report.most_stretch = std::max(report.most_stretch, r.most_stretch);
    }
    return report;
}

} // namespace filigree::cell_kernel
