// Based on: Chen et al., Vertex block descent, 2024. Sweeps over the corners of whole cells, every second corner of a
// row at a time.
#include "filigree/core/parallel_for.h"
#include "filigree/physics/fem/cell_kernel.h"
#include "filigree/physics/fem/cell_lanes.h"
#include "filigree/physics/fem/vertex_block.h"

#include <algorithm>
#include <cassert>

namespace filigree::cell_kernel {

namespace {

constexpr std::size_t kCornersPerSweep = 512; ///< of a piece of a sweep's color

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

using SweepFunction = void (*)(const SweepJob&, std::size_t, std::size_t);

// Sweeps read whole registers, so past a row's end corners that another thread may be moving; those lanes are dropped.
// That is all the thread sanitizer would find.
#define FILIGREE_READS_AHEAD __attribute__((no_sanitize("thread")))

#if defined(FILIGREE_HAS_WIDTHS)
FILIGREE_READS_AHEAD FILIGREE_AVX512 void sweep_rows_avx512(const SweepJob& job, std::size_t begin, std::size_t end) {
    sweep_rows<16>(job, begin, end);
}
FILIGREE_READS_AHEAD FILIGREE_AVX2 void sweep_rows_avx2(const SweepJob& job, std::size_t begin, std::size_t end) {
    sweep_rows<8>(job, begin, end);
}
#endif
FILIGREE_READS_AHEAD void sweep_rows_plain(const SweepJob& job, std::size_t begin, std::size_t end) {
    sweep_rows<4>(job, begin, end);
}

SweepFunction sweep_function(int lanes) {
#if defined(FILIGREE_HAS_WIDTHS)
    if (lanes == 16) return sweep_rows_avx512;
    if (lanes == 8) return sweep_rows_avx2;
#endif
    assert(lanes == 4);
    return sweep_rows_plain;
}

} // namespace

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
