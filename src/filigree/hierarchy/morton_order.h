// Places as numbers, so that what is near in space is mostly near in them.
#pragma once

#include "filigree/core/types.h"

#include <algorithm>
#include <array>
#include <cstdint>

namespace filigree {

/// The bits of a place's coordinates in turn, from the highest on [Morton 1966]: 10 an axis.
class MortonOrder {
public:
    static constexpr std::uint32_t kBits = 10, kSteps = 1u << kBits;

    explicit MortonOrder(const Box& box) : low_(box.min.cast<float>()) {
        const double longest = box.size().maxCoeff();
        to_steps_ = longest > 0 ? float((kSteps - 1) / longest) : 0;
    }

    /// Of steps along an axis, every third bit.
    static std::uint32_t spread(std::uint32_t steps) {
        std::uint32_t bits = 0;
        for (std::uint32_t bit = 0; bit < kBits; ++bit) bits |= (steps >> bit & 1) << (3 * bit);
        return bits;
    }

    /// Whole steps from the box's corner; outside it those of its side.
    std::array<std::uint32_t, 3> steps(const Vec3f& place) const {
        std::array<std::uint32_t, 3> steps{};
        for (int axis = 0; axis < 3; ++axis)
            steps[std::size_t(axis)] =
                std::uint32_t(std::clamp((place[axis] - low_[axis]) * to_steps_, 0.0f, float(kSteps - 1)));
        return steps;
    }
    std::uint32_t key(const Vec3f& place) const {
        const auto [x, y, z] = steps(place);
        return spread(x) | spread(y) << 1 | spread(z) << 2;
    }

private:
    Vec3f low_;
    float to_steps_ = 0;
};

} // namespace filigree
