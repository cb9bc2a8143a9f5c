// Method: reduction to a small range with constants in two to four parts, Taylor series there, and the parts put
// together
//   from the smallest on. Series are cut where the rest is below half a unit in the last place.
#include "filigree/core/math.h"

#include "filigree/core/exact_arithmetic.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

namespace filigree::math {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// High parts end in zeros, so that small whole multiples of them are exact.
constexpr double kLn2High = 0x1.62e42feep-1, kLn2Low = 0x1.a39ef35793c76p-33;
constexpr double kHalfPi = 0x1.921fb54442d18p0, kHalfPiLow = 0x1.1a62633145c07p-54;
constexpr std::array<double, 4> kHalfPiParts{0x1.921fb544p0, 0x1.0b4611a6p-34, 0x1.3198a2ep-69, 0x1.b839a252049c1p-104};
constexpr double kLargestAngle = 0x1p20; // whose multiple of pi/2 has 20 bits

/// c[0] + c[1] x + ...: even and odd terms apart, which halves the wait for each other.
template <std::size_t N>
double polynomial(const std::array<double, N>& c, double x) {
    const double square = x * x;
    double even = c[(N - 1) / 2 * 2], odd = c[N / 2 * 2 - 1];
    for (int i = int(N - 1) / 2 * 2 - 2; i >= 0; i -= 2) even = even * square + c[i];
    for (int i = int(N) / 2 * 2 - 3; i >= 1; i -= 2) odd = odd * square + c[i];
    return even + x * odd;
}

/// 1/first! and so on, every `step`-th, with signs that take turns if `alternating`.
template <std::size_t N>
constexpr std::array<double, N> inverse_factorials(int first, int step, bool alternating) {
    std::array<double, N> terms{};
    for (std::size_t i = 0; i < N; ++i) {
        double factorial = 1; // up to 22! exactly
        for (int k = 2; k <= first + step * int(i); ++k) factorial *= k;
        terms[i] = (alternating && i % 2 != 0 ? -1 : 1) / factorial;
    }
    return terms;
}
/// scale/first and so on, every second, with signs that take turns if `alternating`.
template <std::size_t N>
constexpr std::array<double, N> inverse_odds(int first, double scale, bool alternating) {
    std::array<double, N> terms{};
    for (std::size_t i = 0; i < N; ++i) terms[i] = (alternating && i % 2 != 0 ? -scale : scale) / (first + 2 * int(i));
    return terms;
}

double times_power_of_two(double x, int k) {
    if (k < -1021 || k > 1022) return std::ldexp(x, k); // subnormal or infinite
    return x * std::bit_cast<double>(std::uint64_t(k + 1023) << 52);
}

// --- Angles ----------------------------------------------------------------------------------------------------------

/// x - quarter * pi/2, between -pi/4 and pi/4, in two parts.
struct Angle {
    double high, low;
    unsigned quarter;
};

Angle reduced(double x) {
    if (std::abs(x) <= 0x1.921fb54442d18p-1) return {x, 0, 0};
    if (!(std::abs(x) < kLargestAngle)) x = std::fmod(x, 4 * kHalfPi); // exact, of a rounded 2 pi
    const double n = std::floor(x * (1 / kHalfPi) + 0.5);
    double high = x - n * kHalfPiParts[0], low = 0; // exact
    for (int i : {1, 2}) {
        const double part = n * kHalfPiParts[i]; // exact
        const ExactPair rest = exact_sum(high, -part);
        high = rest.high;
        low += rest.low;
    }
    low -= n * kHalfPiParts[3];
    const double sum = high + low;
    return {sum, (high - sum) + low, unsigned(std::int64_t(n)) & 3u};
}

constexpr auto kSineTerms = inverse_factorials<8>(3, 2, true);   // to x^17
constexpr auto kCosineTerms = inverse_factorials<7>(4, 2, true); // to x^16

double sine_of(const Angle& a) {
    const double square = a.high * a.high;
    return a.high + (a.low * (1 - 0.5 * square) - a.high * square * polynomial(kSineTerms, square));
}
double cosine_of(const Angle& a) {
    const double square = a.high * a.high, half = 0.5 * square, most = 1 - half;
    return most + (((1 - most) - half) + (square * square * polynomial(kCosineTerms, square) - a.high * a.low));
}

/// Of atan(k/8).
constexpr std::array<ExactPair, 9> kArcTangents{{
    {0, 0},
    {0x1.fd5ba9aac2f6ep-4, -0x1.cd37686760c17p-59},
    {0x1.f5b75f92c80ddp-3, 0x1.8ab6e3cf7afbdp-57},
    {0x1.6f61941e4def1p-2, -0x1.c63aae6f6e918p-56},
    {0x1.dac670561bb4fp-2, 0x1.a2b7f222f65e2p-56},
    {0x1.1e00babdefeb4p-1, -0x1.928df287a668fp-58},
    {0x1.4978fa3269ee1p-1, 0x1.2419a87f2a458p-56},
    {0x1.700a7c5784634p-1, -0x1.8c34d25aadef6p-56},
    {0x1.921fb54442d18p-1, 0x1.1a62633145c07p-55},
}};
constexpr auto kArcTangentTerms = inverse_odds<8>(3, 1, true);

// --- Exponentials and logarithms -------------------------------------------------------------------------------------

constexpr auto kExponentialTerms = inverse_factorials<12>(2, 1, false); // to r^13

/// e^r - 1 of r = high + low, |r| <= ln(2)/2.
double exponential_less_one(double high, double low) {
    const double r = high + low;
    return r + (r * r * polynomial(kExponentialTerms, r) + ((high - r) + low));
}
struct Exponent {
    double high, low; ///< x - k ln 2
    int k;
};
Exponent reduced_exponent(double x) {
    const double k = std::floor(x * std::numbers::log2e + 0.5);
    return {x - k * kLn2High, -k * kLn2Low, static_cast<int>(k)};
}
constexpr double kLargestExponent = 709.79, kSmallestExponent = -745.14;

constexpr auto kLogarithmTerms = inverse_odds<11>(3, 2, false);

/// log(1 + f) + k ln 2 + more, -0.3 < f < 0.42. With s = f/(2 + f), log(1 + f) is 2 atanh(s).
double logarithm(double f, double k, double more) {
    const double half_square = 0.5 * f * f, s = f / (2 + f), square = s * s;
    const double rest = s * (half_square + square * polynomial(kLogarithmTerms, square));
    return k * kLn2High - ((half_square - (rest + (k * kLn2Low + more))) - f);
}
/// x = (1 + f) 2^k with 1 + f between the roots of 1/2 and 2. Of finite x > 0.
struct Mantissa {
    double f;
    int k;
};
Mantissa mantissa(double x) {
    Mantissa of{};
    double m = std::frexp(x, &of.k);
    if (m < std::numbers::sqrt2 / 2) {
        m *= 2;
        --of.k;
    }
    of.f = m - 1;
    return of;
}
/// Whether log(x) is no usual number; then `result` is it.
bool is_special_logarithm(double x, double& result) {
    if (x > 0 && x < kInfinity) return false;
    result = x == 0 ? -kInfinity : x > 0 ? kInfinity : kNaN;
    return true;
}

/// log(x) in two parts, of finite x > 0.
ExactPair long_logarithm(double x) {
    constexpr auto kFurther = inverse_odds<10>(5, 2, false);
    const auto [f, k] = mantissa(x);
    const double below = 2 + f;
    ExactPair s = long_quotient(f, below);
    s.low -= s.high * (f - (below - 2)) / below;
    const ExactPair square = exact_product(s.high, s.high);
    // 2 s^3 / 3 in two parts, as it is up to a hundredth of the whole; further terms in one.
    const ExactPair cube = exact_product(s.high, square.high);
    ExactPair third = long_quotient(2 * cube.high, 3);
    third.low += (2.0 / 3) * (cube.low + s.high * square.low) + 2 * square.high * s.low;
    const double further = cube.high * square.high * polynomial(kFurther, square.high);
    const ExactPair most = exact_sum(k * kLn2High, 2 * s.high);
    const ExactPair more = exact_sum(most.high, third.high);
    const double low = most.low + more.low + (k * kLn2Low + (2 * s.low + (third.low + further)));
    const double sum = more.high + low;
    return {sum, (more.high - sum) + low};
}

bool is_whole(double y) { return std::floor(y) == y; }
bool is_odd(double y) { return is_whole(y) && !is_whole(0.5 * y); }

} // namespace

double sin(double x) {
    if (!std::isfinite(x)) return kNaN;
    if (std::abs(x) < 0x1p-27) return x;
    const Angle a = reduced(x);
    const double value = a.quarter % 2 == 0 ? sine_of(a) : cosine_of(a);
    return a.quarter < 2 ? value : -value;
}

double cos(double x) {
    if (!std::isfinite(x)) return kNaN;
    const Angle a = reduced(x);
    const double value = a.quarter % 2 == 0 ? cosine_of(a) : sine_of(a);
    return a.quarter == 0 || a.quarter == 3 ? value : -value;
}

double tan(double x) {
    if (!std::isfinite(x)) return kNaN;
    if (std::abs(x) < 0x1p-27) return x;
    const Angle a = reduced(x);
    return a.quarter % 2 == 0 ? sine_of(a) / cosine_of(a) : -cosine_of(a) / sine_of(a);
}

double atan(double x) {
    const double size = std::abs(x);
    if (!(size >= 0x1p-27)) return x; // NaN too
    const bool inverted = size > 1;
    const double t = inverted ? 1 / size : size;
    const int k = static_cast<int>(8 * t + 0.5);
    const double at = k / 8.0, u = (t - at) / (1 + t * at), square = u * u;
    const double little = kArcTangents[k].low + (u - u * square * polynomial(kArcTangentTerms, square));
    const double angle =
        inverted ? (kHalfPi - kArcTangents[k].high) - (little - kHalfPiLow) : kArcTangents[k].high + little;
    return std::copysign(angle, x);
}

double atan2(double y, double x) {
    if (std::isnan(x) || std::isnan(y)) return kNaN;
    double angle; // of the first quarter
    if (y == 0) {
        angle = 0;
    } else if (std::isinf(y)) {
        angle = std::isinf(x) ? kHalfPi / 2 : kHalfPi;
    } else {
        angle = x == 0 ? kHalfPi : atan(std::abs(y / x));
    }
    if (std::signbit(x)) angle = 2 * kHalfPi - (angle - 2 * kHalfPiLow);
    return std::copysign(angle, y);
}

double asin(double x) { return std::abs(x) <= 1 ? atan2(x, std::sqrt((1 - x) * (1 + x))) : kNaN; }
double acos(double x) { return std::abs(x) <= 1 ? 2 * atan2(std::sqrt(1 - x), std::sqrt(1 + x)) : kNaN; }

double exp(double x) {
    if (std::isnan(x)) return x;
    if (x > kLargestExponent) return kInfinity;
    if (x < kSmallestExponent) return 0;
    const Exponent r = reduced_exponent(x);
    return times_power_of_two(1 + exponential_less_one(r.high, r.low), r.k);
}

double exp2(double x) {
    if (std::isnan(x)) return x;
    if (x >= 1024) return kInfinity;
    if (x < -1075) return 0;
    const double k = std::floor(x + 0.5), part = x - k; // exact
    const ExactPair r = exact_product(part, std::numbers::ln2);
    return times_power_of_two(1 + exponential_less_one(r.high, r.low), static_cast<int>(k));
}

double expm1(double x) {
    if (std::isnan(x) || std::abs(x) < 0x1p-54) return x;
    if (x > kLargestExponent) return kInfinity;
    if (x < -40) return -1;
    const Exponent r = reduced_exponent(x);
    const double part = exponential_less_one(r.high, r.low);
    if (r.k == 0) return part;
    if (r.k > 60) return times_power_of_two(1 + part, r.k);
    const double power = times_power_of_two(1, r.k);
    return r.k < 0 ? power * part - (1 - power) : (power - 1) + power * part;
}

double log(double x) {
    double special;
    if (is_special_logarithm(x, special)) return special;
    const auto [f, k] = mantissa(x);
    return logarithm(f, k, 0);
}

double log1p(double x) {
    if (std::abs(x) < 0x1p-54) return x;
    if (-0.29 < x && x < 0.41) return logarithm(x, 0, 0);
    double special;
    if (is_special_logarithm(1 + x, special)) return special;
    const ExactPair sum = exact_sum(1, x);
    const auto [f, k] = mantissa(sum.high);
    return logarithm(f, k, sum.low / sum.high);
}

double log2(double x) {
    double special;
    if (is_special_logarithm(x, special)) return special;
    const auto [f, k] = mantissa(x);
    return k + logarithm(f, 0, 0) * std::numbers::log2e;
}

double power_of_ten(int n) {
    double power = 1, square = 10;
    for (int bits = std::abs(n); bits != 0; bits /= 2) {
        if (bits % 2 != 0) power *= square;
        square *= square;
    }
    return n < 0 ? 1 / power : power;
}

double log10(double x) {
    double special;
    if (is_special_logarithm(x, special)) return special;
    const double found = log(x) * std::numbers::log10e, whole = std::floor(found + 0.5);
    return std::abs(whole) <= 22 && x == power_of_ten(static_cast<int>(whole)) ? whole : found;
}

double pow(double x, double y) {
    if (y == 0 || x == 1) return 1;
    if (std::isnan(x) || std::isnan(y)) return kNaN;
    const bool is_negative = std::signbit(x) && is_odd(y);
    const double size = std::abs(x);
    if (std::isinf(y)) return size == 1 ? 1 : (size > 1) == (y > 0) ? kInfinity : 0;
    if (size == 0 || std::isinf(size)) {
        const double power = (size == 0) == (y > 0) ? 0 : kInfinity;
        return is_negative ? -power : power;
    }
    if (x < 0 && !is_whole(y)) return kNaN;
    if (y == 1) return x;
    if (y == 2) return x * x;
    if (y == 3) return x * x * x;
    if (y == -1) return 1 / x;
    const ExactPair l = long_logarithm(size);
    const double rough = y * l.high;
    double power;
    if (!(rough <= kLargestExponent)) {
        power = kInfinity;
    } else if (rough < kSmallestExponent) {
        power = 0;
    } else {
        const ExactPair product = exact_product(y, l.high);
        const double k = std::floor(product.high * std::numbers::log2e + 0.5);
        const double low = (product.low + y * l.low) - k * kLn2Low;
        power = times_power_of_two(1 + exponential_less_one(product.high - k * kLn2High, low), static_cast<int>(k));
    }
    return is_negative ? -power : power;
}

double cbrt(double x) {
    if (x == 0 || !std::isfinite(x)) return x;
    int k;
    double m = std::frexp(std::abs(x), &k); // 0.5 to 1
    const int third = (k + 3 * 400) / 3 - 400, rest = k - 3 * third;
    m = times_power_of_two(m, rest);              // 0.5 to 4
    double root = (0.4 + m * (0.67 - 0.068 * m)); // 4 bits
    for (int i = 0; i < 2; ++i) {                 // [Halley]: three times as many
        const double cube = root * root * root;
        root *= (cube + 2 * m) / (2 * cube + m);
    }
    for (int i = 0; i < 2; ++i) { // [Newton]: the last one rounds alone
        const double square = root * root;
        root -= (root * square - m) / (3 * square);
    }
    return std::copysign(times_power_of_two(root, third), x);
}

double hypot(double x, double y) {
    if (std::isinf(x) || std::isinf(y)) return kInfinity;
    const double size = std::max(std::abs(x), std::abs(y));
    if (!(size < 1e150 && size > 1e-140) && size > 0) {
        const double scale = size > 1 ? 0x1p-600 : 0x1p600;
        x *= scale;
        y *= scale;
        return std::sqrt(x * x + y * y) / scale;
    }
    return std::sqrt(x * x + y * y);
}

/// Stirling's series [Abramowitz and Stegun 6.1.40], from 12 on.
double gamma(double x) {
    double below = 1;
    for (; x < 12; x += 1) below *= x;
    const double inverse = 1 / x, square = inverse * inverse;
    const double series =
        inverse * (1.0 / 12 - square * (1.0 / 360 - square * (1.0 / 1260 - square * (1.0 / 1680 - square / 1188))));
    return std::sqrt(2 * std::numbers::pi * inverse) * exp(x * (log(x) - 1) + series) / below;
}

Eigen::Quaterniond quaternion(const Eigen::AngleAxisd& rotation) {
    const double half = 0.5 * rotation.angle();
    Eigen::Quaterniond q;
    q.w() = cos(half);
    q.vec() = sin(half) * rotation.axis();
    return q;
}

Eigen::Matrix3d matrix(const Eigen::AngleAxisd& rotation) {
    const Eigen::Vector3d& n = rotation.axis();
    const double s = sin(rotation.angle()), c = cos(rotation.angle());
    Eigen::Matrix3d turn = (1 - c) * n * n.transpose();
    turn.diagonal().array() += c;
    turn(0, 1) -= s * n.z();
    turn(1, 0) += s * n.z();
    turn(0, 2) += s * n.y();
    turn(2, 0) -= s * n.y();
    turn(1, 2) -= s * n.x();
    turn(2, 1) += s * n.x();
    return turn;
}

Eigen::AngleAxisd angle_axis(const Eigen::Quaterniond& rotation) {
    const double length = rotation.vec().norm();
    if (!(length > 0)) return {0, Eigen::Vector3d::UnitX()};
    const double sign = rotation.w() < 0 ? -1 : 1;
    return {2 * atan2(length, std::abs(rotation.w())), sign / length * rotation.vec()};
}

Eigen::AngleAxisd angle_axis(const Eigen::Matrix3d& rotation) { return angle_axis(Eigen::Quaterniond(rotation)); }

Eigen::Quaterniond slerp(const Eigen::Quaterniond& from, double fraction, const Eigen::Quaterniond& to) {
    const double along = from.dot(to), sign = along < 0 ? -1 : 1;
    double a = 1 - fraction, b = fraction;
    if (std::abs(along) < 1 - 1e-15) {
        const double angle = acos(std::abs(along)), inverse = 1 / sin(angle);
        a = sin((1 - fraction) * angle) * inverse;
        b = sin(fraction * angle) * inverse;
    }
    return Eigen::Quaterniond(a * from.coeffs() + sign * b * to.coeffs());
}

} // namespace filigree::math
