// Based on: [Ottosson 2020], OKLab, a space where distances are how different two colours look. Both maps are Bezier
// curves there, walked at constant speed.
#include "filigree/render.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

namespace filigree {

namespace {

constexpr std::size_t kTableSize = 256;
using ColorTable = std::array<Vec3f, kTableSize>;

const std::array<Vec3f, kCategoryCount> kCategories = {{{0.95f, 0.64f, 0.73f},
                                                        {0.95f, 0.67f, 0.54f},
                                                        {0.84f, 0.73f, 0.46f},
                                                        {0.64f, 0.80f, 0.56f},
                                                        {0.45f, 0.82f, 0.75f},
                                                        {0.46f, 0.80f, 0.92f},
                                                        {0.65f, 0.73f, 0.99f},
                                                        {0.84f, 0.67f, 0.91f}}};

/// Linear sRGB to the cube of the cones' answers, and from these to lightness, a and b [Ottosson 2020].
const Mat3d& linear_to_cones() {
    static const Mat3d matrix = (Mat3d() << 0.4122214708, 0.5363325363, 0.0514459929, //
                                 0.2119034982, 0.6806995451, 0.1073969566,            //
                                 0.0883024619, 0.2817188376, 0.6299787005)
                                    .finished();
    return matrix;
}
const Mat3d& cones_to_lab() {
    static const Mat3d matrix = (Mat3d() << 0.2104542553, 0.7936177850, -0.0040720468, //
                                 1.9779984951, -2.4285922050, 0.4505937099,            //
                                 0.0259040371, 0.7827717662, -0.8086757660)
                                    .finished();
    return matrix;
}

double decoded(double srgb) { return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4); }
double encoded(double linear) {
    return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

Vec3d oklab_to_srgb(const Vec3d& lab) {
    static const Mat3d lab_to_cones = cones_to_lab().inverse(), cones_to_linear = linear_to_cones().inverse();
    const Vec3d cones = lab_to_cones * lab;
    return (cones_to_linear * cones.array().cube().matrix()).unaryExpr(&encoded);
}

/// A colour by lightness, chroma (its distance from grey) and hue.
Vec3d lch(double lightness, double chroma, double hue_deg) {
    const double hue = hue_deg * std::numbers::pi / 180;
    return {lightness, chroma * std::cos(hue), chroma * std::sin(hue)};
}

/// The point of a Bezier curve at u, 0 to 1 [de Casteljau].
template <std::size_t N>
Vec3d bezier(std::array<Vec3d, N> points, double u) {
    for (std::size_t left = N - 1; left > 0; --left)
        for (std::size_t i = 0; i < left; ++i) points[i] += u * (points[i + 1] - points[i]);
    return points[0];
}

/// A curve at equal steps of its own length.
class EvenCurve {
public:
    template <std::size_t N>
    explicit EvenCurve(const std::array<Vec3d, N>& control) : points_(kSamples), lengths_(kSamples, 0.0) {
        for (std::size_t i = 0; i < kSamples; ++i) {
            points_[i] = bezier(control, static_cast<double>(i) / (kSamples - 1));
            if (i > 0) lengths_[i] = lengths_[i - 1] + (points_[i] - points_[i - 1]).norm();
        }
    }

    Vec3d at(double fraction) const {
        const double length = fraction * lengths_.back();
        const auto above = std::upper_bound(lengths_.begin() + 1, lengths_.end() - 1, length);
        const auto i = static_cast<std::size_t>(above - lengths_.begin());
        const double u = (length - lengths_[i - 1]) / (lengths_[i] - lengths_[i - 1]);
        return points_[i - 1] + u * (points_[i] - points_[i - 1]);
    }

private:
    static constexpr std::size_t kSamples = 4096; // sixteen for each entry of a table
    std::vector<Vec3d> points_;
    std::vector<double> lengths_;
};

ColorTable table_of(const std::function<Vec3d(double)>& oklab_at) {
    ColorTable table;
    for (std::size_t i = 0; i < kTableSize; ++i)
        table[i] = oklab_to_srgb(oklab_at(static_cast<double>(i) / (kTableSize - 1))).cast<float>();
    return table;
}

/// Night blue, violet, red, orange, cream. Control points may lie outside of what a screen can show; the curve does
/// not.
ColorTable make_sequential() {
    const EvenCurve curve(std::array{lch(0.34, 0.11, 276), lch(0.41, 0.22, 287), lch(0.47, 0.26, 330),
                                     lch(0.60, 0.29, 15), lch(0.74, 0.18, 58), lch(0.85, 0.155, 82),
                                     lch(0.94, 0.06, 95)});
    return table_of([&](double t) { return curve.at(t); });
}

/// Blue, warm pale grey, red. The arms are mirror images, so each step on one side looks as large as on the other. They
/// leave the middle in opposite directions and level: neither a kink nor a ridge of light at zero.
ColorTable make_diverging() {
    constexpr double kMirrorHue = 322.5; // half way between the two hues
    const Vec3d middle = lch(0.94, 0.012, 80);
    const Vec3d along = lch(0, 1, kMirrorHue), across = lch(0, 1, kMirrorHue + 90);
    // Lightness and chroma along and across the mirror, seen from the middle.
    const EvenCurve arm(std::array{Vec3d(0, 0, 0), Vec3d(0, 0, 0.045), Vec3d(-0.24, 0.025, 0.175),
                                   Vec3d(-0.42, 0.10, 0.20), Vec3d(-0.56, 0.06, 0.12)});
    return table_of([&](double t) -> Vec3d {
        const Vec3d step = arm.at(std::abs(2 * t - 1));
        const double side = t < 0.5 ? -1 : 1;
        return middle + Vec3d(step.x(), 0, 0) + step.y() * along + side * step.z() * across;
    });
}

ColorTable make_categorical() {
    ColorTable table;
    for (std::size_t i = 0; i < kTableSize; ++i) table[i] = kCategories[i * kCategoryCount / kTableSize];
    return table;
}

/// A number m * 10^power; exact where doubles can be.
double decimal(double mantissa, int power) {
    return power < 0 ? mantissa / std::pow(10.0, -power) : mantissa * std::pow(10.0, power);
}

/// 1, 2 or 5 times a power of ten.
struct RoundStep {
    int digit = 1, power = 0;

    double size() const { return decimal(digit, power); }
    double multiple(double count) const { return decimal(count * digit, power) + 0.0; } // no -0
};

/// The smallest that is not below `least`, which is above 0.
RoundStep round_step(double least) {
    RoundStep step{1, static_cast<int>(std::floor(std::log10(least)))};
    constexpr double kSlack = 1e-6; // 0.3f - 0.2f is 0.1
    while (step.size() < least * (1 - kSlack)) {
        step.power += step.digit == 5 ? 1 : 0;
        step.digit = step.digit == 1 ? 2 : step.digit == 2 ? 5 : 1;
    }
    return step;
}

float to_float(double x) {
    constexpr double kMost = std::numeric_limits<float>::max();
    return static_cast<float>(std::clamp(x, -kMost, kMost));
}

} // namespace

const std::array<Vec3f, kCategoryCount>& category_colors() { return kCategories; }

std::span<const Vec3f> color_table(ColorMap map) {
    static const ColorTable sequential = make_sequential(), diverging = make_diverging(),
                            categorical = make_categorical();
    return map == ColorMap::sequential ? sequential : map == ColorMap::diverging ? diverging : categorical;
}

Vec3f color_at(ColorMap map, float t) {
    if (std::isnan(t)) return Vec3f::Constant(0.5f);
    const std::span<const Vec3f> table = color_table(map);
    const float place = std::clamp(t, 0.0f, 1.0f) * (kTableSize - 1);
    const std::size_t entry = std::min(static_cast<std::size_t>(place), kTableSize - 2);
    return table[entry] + (place - static_cast<float>(entry)) * (table[entry + 1] - table[entry]);
}

Vec3f srgb_to_linear(const Vec3f& srgb) { return srgb.cast<double>().unaryExpr(&decoded).cast<float>(); }

Vec3f srgb_to_oklab(const Vec3f& srgb) {
    const Vec3d linear = srgb.cast<double>().unaryExpr(&decoded);
    return (cones_to_lab() * (linear_to_cones() * linear).unaryExpr([](double x) { return std::cbrt(x); }))
        .cast<float>();
}

ValueRange legend_range(std::span<const float> values, bool from_zero) {
    constexpr double kSteps = 10; // at most so many in the values' own range
    double least = std::numeric_limits<double>::infinity(), most = -least;
    for (const float value : values) {
        if (!std::isfinite(value)) continue;
        least = std::min(least, static_cast<double>(value));
        most = std::max(most, static_cast<double>(value));
    }
    if (from_zero) least = 0;
    if (most < least || (least == 0 && most == 0)) return {};
    const bool all_equal = least == most;
    const RoundStep step = round_step((all_equal ? std::abs(least) : most - least) / kSteps);
    double first = std::round(least / step.size()), last = std::round(most / step.size());
    if (to_float(step.multiple(first)) > least || all_equal) --first; // compared as float: 0.7f is below 0.7
    if (to_float(step.multiple(last)) < most || all_equal) ++last;
    return {to_float(step.multiple(first)), to_float(step.multiple(last))};
}

HeatMap heat_map(std::vector<float> values, double diagonal) {
    HeatMap map{std::move(values), {}};
    if (diagonal > 0)
        for (float& value : map.values) value = static_cast<float>(value / diagonal);
    std::vector<float> lower(map.values); // a few outliers would leave everything else dark
    const auto place = lower.begin() + std::ptrdiff_t(0.995 * double(lower.size()));
    if (place < lower.end()) std::nth_element(lower.begin(), place, lower.end());
    if (place < lower.end() && *place > 0) lower.erase(place + 1, lower.end());
    map.range = legend_range(lower, true);
    return map;
}

std::vector<double> legend_ticks(const ValueRange& range, unsigned count) {
    constexpr unsigned kMostTicks = 1000;
    const double least = range.least, most = range.most;
    if (count == 0 || !std::isfinite(most - least) || most <= least) return {};
    const RoundStep step = round_step((most - least) / std::clamp(count - 1, 1u, kMostTicks));
    constexpr double kSlack = 1e-5; // of a step: the ends are float, the ticks decimal numbers
    const double first = std::ceil(least / step.size() - kSlack), last = std::floor(most / step.size() + kSlack);
    std::vector<double> ticks;
    for (double i = first; i <= last; ++i) ticks.push_back(step.multiple(i));
    return ticks;
}

} // namespace filigree
