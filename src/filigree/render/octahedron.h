// Directions in 32 bits, as the shaders unpack them.
#pragma once

#include "filigree/types.h"

#include <cmath>
#include <cstdint>
#include <limits>

namespace filigree {

/// A direction on an octahedron unfolded to a square [Meyer et al. 2010]: 2 x 16 bits, x in the low half, to 0.003
/// degrees. The one pair that no direction has, -32768 twice, stands for the zero normal.
inline std::uint32_t octahedral(const Vec3f& n) {
    constexpr std::uint32_t kZero = 0x80008000u;
    const float sum = n.cwiseAbs().sum();
    if (!(sum > 0 && sum <= std::numeric_limits<float>::max())) return kZero;
    float x = n.x() / sum, y = n.y() / sum;
    if (n.z() < 0) {
        const float folded_x = std::copysign(1 - std::abs(y), x);
        y = std::copysign(1 - std::abs(x), y);
        x = folded_x;
    }
    const auto bits = [](float value) {
        return static_cast<std::uint16_t>(static_cast<std::int16_t>(std::round(32767 * value)));
    };
    return std::uint32_t{bits(x)} | std::uint32_t{bits(y)} << 16;
}

} // namespace filigree
