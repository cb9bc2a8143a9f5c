#include "filigree/physics/contact/extremes_kernel.h"

#include "filigree/core/lanes.h"

#include <algorithm>

namespace filigree {

namespace {

static_assert(Vectors::kPadding >= kExtremesPadding);

struct ExtremesJob {
    std::array<const float*, 3> values, from; ///< from: null, or taken off
    std::span<const float> counts;
    Index usual;
};

/// All axes at once: what counts is read once.
template <int N, bool has_from>
FILIGREE_INLINE Extremes extremes_by(const ExtremesJob& job) {
    using Float = typename LaneTypes<N>::Float;
    std::array<Float, 3> usual, least, most;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const float value = job.values[axis][job.usual];
        usual[axis] = Float{} + (has_from ? value - job.from[axis][job.usual] : value);
        least[axis] = most[axis] = usual[axis];
    }
    for (std::size_t i = 0; i < job.counts.size(); i += N) {
        const Float counts = Lanes<N>::load(&job.counts[i]);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            Float value = Lanes<N>::load(job.values[axis] + i);
            if constexpr (has_from) value = value - Lanes<N>::load(job.from[axis] + i);
            value = usual[axis] + counts * (value - usual[axis]);
            least[axis] = value < least[axis] ? value : least[axis];
            most[axis] = value > most[axis] ? value : most[axis];
        }
    }
    Extremes found;
    for (int axis = 0; axis < 3; ++axis) {
        const Float &lows = least[std::size_t(axis)], &highs = most[std::size_t(axis)];
        found.least[axis] = lows[0];
        found.most[axis] = highs[0];
        for (int k = 1; k < N; ++k) {
            found.least[axis] = std::min(found.least[axis], lows[k]);
            found.most[axis] = std::max(found.most[axis], highs[k]);
        }
    }
    return found;
}

template <int N>
FILIGREE_INLINE Extremes extremes_by(const ExtremesJob& job) {
    return job.from[0] ? extremes_by<N, true>(job) : extremes_by<N, false>(job);
}

#if defined(FILIGREE_HAS_WIDTHS)
FILIGREE_AVX2 Extremes extremes_avx2(const ExtremesJob& job) { return extremes_by<8>(job); }
#endif

} // namespace

Extremes extremes_of(const Vectors& values, const Vectors* from, std::span<const float> counts, Index usual) {
    ExtremesJob job{{values.x.data(), values.y.data(), values.z.data()}, {}, counts, usual};
    if (from) job.from = {from->x.data(), from->y.data(), from->z.data()};
#if defined(FILIGREE_HAS_WIDTHS)
    if (widest_vectors() >= VectorWidth::bytes32) return extremes_avx2(job);
#endif
    return extremes_by<4>(job);
}

} // namespace filigree
