#include "filigree/physics/contact/box_sweep.h"

#include "filigree/core/lanes.h"

#include <algorithm>
#include <limits>
#include <numeric>

namespace filigree {

BoxSweep::BoxSweep(std::span<const Bounds> boxes) {
    Vec3f low = Vec3f::Constant(std::numeric_limits<float>::max()), high = -low;
    for (const Bounds& box : boxes) {
        low = low.cwiseMin(box.low);
        high = high.cwiseMax(box.high);
    }
    int along = 0;
    (high - low).maxCoeff(&along);
    sort(boxes, along, low[along], high[along]);
    for (int axis = 0; axis < 3; ++axis) {
        std::vector<float>&lows = low_[std::size_t(axis)], &highs = high_[std::size_t(axis)];
        lows.assign(boxes.size() + kAtOnce, std::numeric_limits<float>::infinity());
        highs = lows;
        for (std::size_t k = 0; k < boxes.size(); ++k) {
            lows[k] = boxes[order_[k]].low[(along + axis) % 3];
            highs[k] = boxes[order_[k]].high[(along + axis) % 3];
        }
    }
}

/// By slabs, as many as there are boxes: that is near enough to a sorted order, and sooner there.
void BoxSweep::sort(std::span<const Bounds> boxes, int along, float low, float high) {
    const std::size_t count = boxes.size();
    const double step = std::max((double{high} - double{low}) / double(count), std::numeric_limits<double>::min());
    const auto slab_of = [&](const Bounds& box) {
        const double slab = (double{box.low[along]} - double{low}) / step;
        return slab < double(count) ? std::size_t(slab) : count - 1; // also where it is not a number
    };
    std::vector<Index> offsets(count + 1, 0);
    for (const Bounds& box : boxes) ++offsets[slab_of(box) + 1];
    std::partial_sum(offsets.begin(), offsets.end(), offsets.begin());
    order_.resize(count);
    for (Index k = 0; k < count; ++k) order_[offsets[slab_of(boxes[k])]++] = k;
    slabs_.assign(count + kAtOnce, std::numeric_limits<float>::infinity());
    float least = std::numeric_limits<float>::infinity();
    for (std::size_t k = count; k-- > 0;) slabs_[k] = least = std::min(least, boxes[order_[k]].low[along]);
}

/// For several widths of vectors.
struct BoxSweep::FindNear {
    static FILIGREE_INLINE std::size_t run(const BoxSweep& sweep, std::size_t a, float around, std::uint16_t* near) {
        const auto &lows = sweep.low_, &highs = sweep.high_;
        const float *low = lows[0].data(), *low_u = lows[1].data(), *low_v = lows[2].data();
        const float *high = highs[0].data(), *high_u = highs[1].data(), *high_v = highs[2].data();
        const float from = low[a], from_u = low_u[a], from_v = low_v[a];
        const float to = high[a], to_u = high_u[a], to_v = high_v[a], *slabs = sweep.slabs_.data();
        std::size_t groups = 0;
        for (std::size_t b = a; slabs[b] - to <= around; b += kAtOnce)
            near[groups++] = std::uint16_t(bits_where<kAtOnce>([&](std::size_t k) __attribute__((always_inline)) {
                const float gap = std::max(low[b + k] - to, from - high[b + k]);
                const float gap_u = std::max(low_u[b + k] - to_u, from_u - high_u[b + k]);
                const float gap_v = std::max(low_v[b + k] - to_v, from_v - high_v[b + k]);
                return std::max(std::max(gap_u, gap_v), gap) <= around;
            }));
        return groups;
    }
    static std::size_t plain(const BoxSweep& sweep, std::size_t a, float around, std::uint16_t* near) {
        return run(sweep, a, around, near);
    }
#if defined(FILIGREE_HAS_WIDTHS)
    FILIGREE_AVX2 static std::size_t avx2(const BoxSweep& sweep, std::size_t a, float around, std::uint16_t* near) {
        return run(sweep, a, around, near);
    }
#endif
};

/// Bits of the boxes from the a-th on, kAtOnce a number; returns how many numbers.
std::size_t BoxSweep::find_near(std::size_t a, float around, std::vector<std::uint16_t>& near) const {
    near.resize(order_.size() / kAtOnce + 1);
#if defined(FILIGREE_HAS_WIDTHS)
    if (widest_vectors() >= VectorWidth::bytes32) return FindNear::avx2(*this, a, around, near.data());
#endif
    return FindNear::plain(*this, a, around, near.data());
}

} // namespace filigree
