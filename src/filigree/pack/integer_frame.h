// Frames of a surface in integers, the same on every machine: what places are coded in.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>

namespace filigree {

using Wide = std::array<std::int64_t, 3>;

inline constexpr int kOneBits = 24;
inline constexpr std::int32_t kOne = 1 << kOneBits; // length of the frame's axes
inline constexpr std::int32_t kFarthest = 1 << 22;  // of a place, in sixteenths of a step

inline Wide operator-(const Wide& a, const Wide& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline Wide cross(const Wide& a, const Wide& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline std::int64_t dot(const Wide& a, const Wide& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// What follows uses doubles where they are quicker than integers, and in such a way that every machine has the same:
// whole numbers below 2^53, one operation that IEEE 754 rounds, and back to whole numbers towards zero.

/// To the nearest, halves away from zero. by > 0.
inline std::int64_t divide(std::int64_t value, std::int64_t by) {
    return std::int64_t(double(2 * value + (value < 0 ? -by : by)) / double(2 * by));
}
/// By kOne.
inline std::int64_t divide_by_one(std::int64_t value) { return (value + kOne / 2) >> kOneBits; }

/// Made kOne long; false: it has no direction.
inline bool normalise(Wide& v) {
    const std::int64_t largest = std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])});
    if (largest == 0) return false;
    const int shift = int(std::bit_width(std::uint64_t(largest))) - 25; // so that squares add up to less than 2^53
    for (std::int64_t& x : v) x = shift > 0 ? x >> shift : x << -shift;
    const double scale = double(kOne) / std::sqrt(double(dot(v, v)));
    for (std::int64_t& x : v) x = std::int64_t(double(x) * scale);
    return true;
}

/// The normal, and two directions across it.
struct Frame {
    std::array<Wide, 3> axes = {Wide{kOne, 0, 0}, Wide{0, kOne, 0}, Wide{0, 0, kOne}};

    Frame() = default;
    Frame(Wide normal, Wide ahead) {
        if (!normalise(normal)) return;
        Wide side = cross(normal, ahead);
        if (!normalise(side)) return;
        Wide across = cross(side, normal);
        for (std::int64_t& x : across) x = divide_by_one(x);
        axes = {normal, across, side};
    }
};

/// Of what differences to expect: 0, 1, then two classes a power of two.
inline std::uint32_t size_class(std::uint32_t size, std::uint32_t classes) {
    const std::uint32_t one_more = size + 1;
    const auto exponent = std::uint32_t(std::bit_width(one_more)) - 1;
    const std::uint32_t half = exponent ? one_more >> (exponent - 1) & 1 : 0;
    return std::min(2 * exponent + half, classes - 1);
}

} // namespace filigree
