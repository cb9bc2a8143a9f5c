// Colours between sRGB, which every interface of ours speaks, and linear light.
#pragma once

#include "filigree/core/math.h"

#include <algorithm>
#include <cmath>

namespace filigree {

/// IEC 61966-2-1, for one channel; clamped to 0 to 1.
inline double linear_from_srgb(double c) {
    c = std::clamp(c, 0.0, 1.0);
    return c <= 0.04045 ? c / 12.92 : math::pow((c + 0.055) / 1.055, 2.4);
}
inline double srgb_from_linear(double c) {
    c = std::clamp(c, 0.0, 1.0);
    return c <= 0.04045 / 12.92 ? c * 12.92 : 1.055 * math::pow(c, 1 / 2.4) - 0.055;
}

} // namespace filigree
