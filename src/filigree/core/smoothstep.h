// From 0 to 1 without a corner.
#pragma once

namespace filigree {

/// 0 up to `from`, 1 from `to` on, between them a cubic without slope at either end; a step where both are equal.
inline double smoothstep(double from, double to, double x) {
    if (x >= to) return 1;
    if (x <= from) return 0;
    const double t = (x - from) / (to - from);
    return t * t * (3 - 2 * t);
}

} // namespace filigree
