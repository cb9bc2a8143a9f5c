#include "filigree/physics/contact/cell_normals.h"

#include "filigree/physics/fem/cell_lanes.h"

namespace filigree {

namespace {

using cell_kernel::CellLanes, cell_kernel::Vectors3;

static_assert(Vectors::kPadding > cell_kernel::kPadding);

struct NormalJob {
    std::span<const Cells::Run> runs;
    const Vectors &positions, &at_rest;
    Vectors& turned;
};

/// Of N cells: the cofactor of their slope (up to a factor above 0) times their normals, of unit length.
template <int N>
FILIGREE_INLINE Vectors3<N> turn(const NormalJob& job, const Cells::Run& run, Index i) {
    using L = CellLanes<N>;
    using Float = typename L::Float;
    cell_kernel::CellSums<N> sums;
    cell_kernel::transform<N>(job.positions, run.rows, i, sums);
    const auto* X = sums.X;
    const std::size_t cell = std::size_t{run.first_cell} + i;
    const Vectors3<N> area = L::load(job.at_rest.x.data() + cell) * cross(X[2], X[4]) +
                             L::load(job.at_rest.y.data() + cell) * cross(X[4], X[1]) +
                             L::load(job.at_rest.z.data() + cell) * cross(X[1], X[2]);
    const Float size = L::square_root(dot(area, area));
    return (size > 0.0f ? 1.0f / size : Float{}) * area;
}

/// Writes the first `count` lanes.
template <int N>
FILIGREE_INLINE void store_first(float* to, typename LaneTypes<N>::Float x, Index count) {
    if (count >= N) return Lanes<N>::store(to, x);
    for (Index k = 0; k < count; ++k) to[k] = x[k];
}

template <int N>
FILIGREE_INLINE void turn_runs(const NormalJob& job) {
    for (const Cells::Run& run : job.runs)
        for (Index i = 0; i < run.count; i += N) {
            const Vectors3<N> normal = turn<N>(job, run, i);
            const std::size_t cell = std::size_t{run.first_cell} + i;
            store_first<N>(job.turned.x.data() + cell, normal.x, run.count - i);
            store_first<N>(job.turned.y.data() + cell, normal.y, run.count - i);
            store_first<N>(job.turned.z.data() + cell, normal.z, run.count - i);
        }
}

#if defined(FILIGREE_HAS_WIDTHS)
FILIGREE_AVX512 void turn_runs_avx512(const NormalJob& job) { turn_runs<16>(job); }
FILIGREE_AVX2 void turn_runs_avx2(const NormalJob& job) { turn_runs<8>(job); }
#endif

} // namespace

void turn_cell_normals(std::span<const Cells::Run> runs, const Vectors& positions, const Vectors& at_rest,
                       Vectors& turned) {
    const NormalJob job{runs, positions, at_rest, turned};
#if defined(FILIGREE_HAS_WIDTHS)
    if (widest_vectors() == VectorWidth::bytes64) return turn_runs_avx512(job);
    if (widest_vectors() == VectorWidth::bytes32) return turn_runs_avx2(job);
#endif
    turn_runs<4>(job);
}

} // namespace filigree
