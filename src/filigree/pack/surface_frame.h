// Where a vertex is, as steps in a frame of the surface from where it is expected. Doubles, by operations that IEEE 754
// rounds alike on every machine and in the order that stands here: all read the same places.
#pragma once

#include "filigree/pack/geometry_code.h"
#include "filigree/pack/integer_frame.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>

namespace filigree {

using Reals = std::array<double, 3>;

inline Reals reals(const FinePlace& p) { return {double(p[0]), double(p[1]), double(p[2])}; }
inline Reals operator-(const Reals& a, const Reals& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline Reals operator*(const Reals& a, double b) { return {a[0] * b, a[1] * b, a[2] * b}; }
inline Reals cross(const Reals& a, const Reals& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline double dot(const Reals& a, const Reals& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// To the nearest, halves up, no farther than kFarthest.
inline std::int32_t to_fine(double x) {
    constexpr double kAbove = 2.0 * kFarthest; // so that what is cut off is below
    x = std::min(std::max(x, double(-kFarthest)), double(kFarthest));
    return std::int32_t(x + (kAbove + 0.5)) - std::int32_t(kAbove);
}

/// Of unit length: the normal, and two directions across it. Both lengths are computed side by side.
struct SurfaceFrame {
    std::array<Reals, 3> axes = {Reals{1, 0, 0}, Reals{0, 1, 0}, Reals{0, 0, 1}};

    SurfaceFrame() = default;
    SurfaceFrame(const Reals& normal, const Reals& ahead) {
        constexpr double kLeastSine = 1e-10; // squared; below, rounding would turn the side
        const Reals side = cross(normal, ahead);
        const double normal_square = dot(normal, normal), side_square = dot(side, side);
        if (!(side_square > kLeastSine * (normal_square * dot(ahead, ahead)))) return;
        const Reals n = normal * (1 / std::sqrt(normal_square)), s = side * (1 / std::sqrt(side_square));
        axes = {n, cross(s, n), s};
    }
};

/// 1 / n, for means of a few.
inline constexpr std::size_t kMostInMean = 64;
inline constexpr auto kOneOf = [] {
    std::array<double, kMostInMean> inverse{};
    for (std::size_t n = 1; n < kMostInMean; ++n) inverse[n] = 1.0 / double(n);
    return inverse;
}();

/// A vertex's place, and how large its difference was, in quarters of a step.
struct SteppedPlace {
    FinePlace place;
    std::int32_t size;
};

/// Goes from where a vertex is expected to its place. size: of the differences around it, quarters of a step.
/// `step(axis, size class)` writes or reads how many steps it is along one of the frame's axes.
template <unsigned kClasses, class Step>
SteppedPlace step_to_place(const Reals& expected, const SurfaceFrame& frame, const Reals& step_sizes,
                           std::uint32_t size, const Step& step) {
    Reals place = expected;
    std::uint32_t all = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        const std::int32_t steps = step(k, size_class(size, kClasses));
        const std::uint32_t own = 4 * std::uint32_t(std::abs(steps));
        size = k == 0 ? (3 * size + 2 * own) / 4 : (size + own) / 2;
        all += own;
        const double far = double(steps) * step_sizes[k];
        for (std::size_t j = 0; j < 3; ++j) place[j] += far * frame.axes[k][j];
    }
    return {{to_fine(place[0]), to_fine(place[1]), to_fine(place[2])}, std::int32_t(std::min(all / 3, 1u << 20))};
}

/// How many steps along an axis come nearest to a place.
inline std::int32_t nearest_step(const FinePlace& place, const Reals& expected, const Reals& axis, double step_size) {
    return to_fine(dot(reals(place) - expected, axis) / step_size);
}

} // namespace filigree
