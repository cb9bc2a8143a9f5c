// Numbers as colours.
#pragma once

#include "filigree/core/types.h"

#include <array>
#include <span>

namespace filigree {

/// sequential: dark to bright, for amounts (an error, a strain). diverging: two hues from a pale middle, for signed
/// amounts. Both are made in OKLab [Ottosson 2020] so that equal steps of the number look like equal steps of colour;
/// lightness rises steadily in the first and is symmetric in the second, so they survive a grey print. categorical:
/// category_colors(), each an eighth, for things without an order.
enum class ColorMap { sequential, diverging, categorical };

/// sRGB: eight hues, evenly around OKLab's circle of lightness 0.80 and chroma 0.095, so that none stands out.
inline constexpr std::size_t kCategoryCount = 8;
const std::array<Vec3f, kCategoryCount>& category_colors();

/// sRGB, 0 to 1, for t in [0, 1] (clamped; NaN gives a neutral grey). Cost: a few multiplications (a table inside).
Vec3f color_at(ColorMap map, float t);

/// The table behind it: 256 sRGB colours, evenly from t = 0 to t = 1.
std::span<const Vec3f> color_table(ColorMap map);

/// sRGB (0 to 1) to OKLab: lightness 0 to 1, and a, b. Distances in it are how different two colours look.
Vec3f srgb_to_oklab(const Vec3f& srgb);

/// sRGB (0 to 1) to amounts of light, which add up.
Vec3f srgb_to_linear(const Vec3f& srgb);

/// A range a legend would show for `values`: finite ones only, the ends as round numbers (multiples of 1, 2 or 5 times
/// a power of ten, no further out than they must), never empty, {0, 1} when there are no values. With `from_zero` it
/// starts at 0, and values below do not count.
struct ValueRange {
    float least = 0, most = 1;
};
ValueRange legend_range(std::span<const float> values, bool from_zero);

/// Errors as colours: dark is none. `values` in model units become fractions of `diagonal`; the range covers 99.5 % of
/// them, and what is above has the brightest colour.
struct HeatMap {
    std::vector<float> values;
    ValueRange range;
};
HeatMap heat_map(std::vector<float> values, double diagonal);

/// Numbers to write beside a legend: round, ascending, inside the range, at most `count` of them (from two up) and
/// about so many.
std::vector<double> legend_ticks(const ValueRange& range, unsigned count);

} // namespace filigree
