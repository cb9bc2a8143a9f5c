// Places as numbers: places with numbers near each other are near in space [Morton 1966].
#pragma once

#include "filigree/types.h"

#include <algorithm>
#include <array>
#include <cstdint>

namespace filigree {

/// The lower 21 bits of x, two zeros between each.
constexpr std::uint64_t spread_bits(std::uint64_t x) {
    x &= 0x1fffff;
    x = (x | x << 32) & 0x001f00000000ffff;
    x = (x | x << 16) & 0x001f0000ff0000ff;
    x = (x | x << 8) & 0x100f00f00f00f00f;
    x = (x | x << 4) & 0x10c30c30c30c30c3;
    return (x | x << 2) & 0x1249249249249249;
}
/// The bits of three coordinates in turn, those of z highest; 21 bits of each.
constexpr std::uint64_t morton_key(std::uint64_t x, std::uint64_t y, std::uint64_t z) {
    return spread_bits(x) | spread_bits(y) << 1 | spread_bits(z) << 2;
}

/// Places of a box on a lattice of 1,024 steps along its longest side: their keys fit into 32 bits.
class MortonOrder {
public:
    static constexpr std::uint32_t kBits = 10, kSteps = 1u << kBits;

    explicit MortonOrder(const Box& box) : low_(box.min.cast<float>()) {
        const double longest = box.size().maxCoeff();
        to_steps_ = longest > 0 ? float((kSteps - 1) / longest) : 0;
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
        return static_cast<std::uint32_t>(morton_key(x, y, z));
    }

private:
    Vec3f low_;
    float to_steps_ = 0;
};

} // namespace filigree
