#include "filigree/core/math.h"

#include "filigree/core/hash.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

using namespace filigree;

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

class Arguments {
public:
    double between(double low, double high) { return low + (high - low) * unit(); }
    double of_any_size() {
        const int exponent = int(random_() % 2000) - 1000; // first: compilers evaluate arguments in orders of their own
        return std::ldexp(between(0.5, 1.5), exponent);
    }

private:
    double unit() { return double(random_() >> 11) * 0x1p-53; }
    std::mt19937_64 random_{1};
};

/// In units of the last place of `right`.
double error(double found, long double right) {
    int exponent = 0;
    std::frexp(static_cast<double>(right), &exponent);
    return static_cast<double>(std::abs(found - right)) / std::ldexp(1.0, exponent - 53);
}

constexpr double kMost = 3; // units in the last place, as the header says
#if defined(_WIN32)
constexpr double kLargestAngle = 4; // of larger ones MinGW's own sine is off: the processor's pi has 66 bits
#else
constexpr double kLargestAngle = 1e5;
#endif

} // namespace

#define EXPECT_RIGHT(call, argument)                                                                                   \
    for (int i = 0; i < 20000; ++i) {                                                                                  \
        const double x = argument;                                                                                     \
        const long double right = std::call(static_cast<long double>(x));                                              \
        ASSERT_LE(error(math::call(x), right), kMost) << #call " of " << x;                                            \
    }

TEST(Math, AnglesAreRightInTheLastPlaces) {
    if constexpr (std::numeric_limits<long double>::digits < 60) GTEST_SKIP() << "nothing more precise to compare with";
    Arguments any;
    EXPECT_RIGHT(sin, any.between(-4, 4))
    EXPECT_RIGHT(sin, any.between(-kLargestAngle, kLargestAngle))
    EXPECT_RIGHT(cos, any.between(-4, 4))
    EXPECT_RIGHT(cos, any.between(-kLargestAngle, kLargestAngle))
    EXPECT_RIGHT(tan, any.between(-1.6, 1.6))
    EXPECT_RIGHT(atan, any.between(-3, 3))
    EXPECT_RIGHT(atan, any.of_any_size())
    EXPECT_RIGHT(asin, any.between(-1, 1))
    EXPECT_RIGHT(acos, any.between(-1, 1))
    for (int i = 0; i < 20000; ++i) {
        const double y = any.between(-1, 1), x = any.between(-1, 1);
        ASSERT_LE(error(math::atan2(y, x), std::atan2(static_cast<long double>(y), static_cast<long double>(x))),
                  kMost);
    }
}

TEST(Math, ExponentialsAreRightInTheLastPlaces) {
    if constexpr (std::numeric_limits<long double>::digits < 60) GTEST_SKIP() << "nothing more precise to compare with";
    Arguments any;
    EXPECT_RIGHT(exp, any.between(-1, 1))
    EXPECT_RIGHT(exp, any.between(-700, 700))
    EXPECT_RIGHT(exp2, any.between(-1000, 1000))
    EXPECT_RIGHT(expm1, any.between(-1, 1))
    EXPECT_RIGHT(expm1, any.between(-40, 40))
    EXPECT_RIGHT(log, any.of_any_size())
    EXPECT_RIGHT(log, any.between(0.5, 1.5))
    EXPECT_RIGHT(log2, any.of_any_size())
    EXPECT_RIGHT(log2, any.between(0.5, 1.5))
    EXPECT_RIGHT(log10, any.of_any_size())
    EXPECT_RIGHT(log1p, any.between(-0.9, 0.9))
    EXPECT_RIGHT(log1p, any.of_any_size())
    EXPECT_RIGHT(cbrt, any.of_any_size())
    for (int i = 0; i < 20000; ++i) {
        const double x = any.between(0, 100), y = any.between(-100, 100);
        ASSERT_LE(error(math::pow(x, y), std::pow(static_cast<long double>(x), static_cast<long double>(y))), kMost)
            << x << " to the " << y;
        ASSERT_LE(error(math::hypot(x, y), std::hypot(static_cast<long double>(x), static_cast<long double>(y))),
                  kMost);
        const double z = any.between(0.1, 5);
        ASSERT_NEAR(math::gamma(z) / std::tgamma(z), 1, 1e-13);
    }
}

TEST(Math, EdgesAreThoseOfTheStandardLibrary) {
    const double edges[] = {0.0,
                            -0.0,
                            1.0,
                            -1.0,
                            2.0,
                            -3.0,
                            0.5,
                            1e-320,
                            -1e-320,
                            1e300,
                            5e-324,
                            kInfinity,
                            -kInfinity,
                            std::numeric_limits<double>::quiet_NaN(),
                            std::numbers::pi,
                            710.0,
                            -746.0,
                            1024.0,
                            -1075.0};
    const auto same = [](double found, double right, const char* name, double x) {
        if (std::isnan(right)) {
            EXPECT_TRUE(std::isnan(found)) << name << " of " << x;
            return;
        }
        if (right == 0 || std::isinf(right)) {
            EXPECT_EQ(found, right) << name << " of " << x;
            EXPECT_EQ(std::signbit(found), std::signbit(right)) << name << " of " << x;
        } else {
            EXPECT_NEAR(found / right, 1, 1e-14) << name << " of " << x;
        }
    };
#define EXPECT_SAME(call) same(math::call(x), std::call(x), #call, x)
    for (const double x : edges) {
        EXPECT_SAME(atan);
        EXPECT_SAME(asin);
        EXPECT_SAME(acos);
        EXPECT_SAME(exp);
        EXPECT_SAME(exp2);
        EXPECT_SAME(expm1);
        EXPECT_SAME(log);
        EXPECT_SAME(log2);
        EXPECT_SAME(log10);
        EXPECT_SAME(log1p);
        EXPECT_SAME(cbrt);
        if (!(std::abs(x) > kLargestAngle)) {
            if (std::abs(x) != std::numbers::pi) {
                EXPECT_SAME(sin);
                EXPECT_SAME(tan);
            }
            EXPECT_SAME(cos);
        }
        for (const double y : edges) {
            same(math::pow(x, y), std::pow(x, y), "pow", x);
            same(math::atan2(x, y), std::atan2(x, y), "atan2", x);
            same(math::hypot(x, y), std::hypot(x, y), "hypot", x);
        }
    }
    EXPECT_NEAR(math::sin(std::numbers::pi), std::sin(std::numbers::pi), 1e-30);
    for (int n = -22; n <= 22; ++n) {
        EXPECT_EQ(math::power_of_ten(n), std::stod("1e" + std::to_string(n)));
        EXPECT_EQ(math::log10(math::power_of_ten(n)), n);
    }
}

TEST(Math, RotationsAreEigens) {
    Arguments any;
    for (int i = 0; i < 200; ++i) {
        const Eigen::Vector3d axis =
            Eigen::Vector3d(any.between(-1, 1), any.between(-1, 1), any.between(-1, 1)).normalized();
        const Eigen::AngleAxisd turn(any.between(-3, 3), axis), other(any.between(-3, 3), axis.unitOrthogonal());
        EXPECT_LT((math::matrix(turn) - turn.toRotationMatrix()).norm(), 1e-14);
        EXPECT_LT((math::quaternion(turn).coeffs() - Eigen::Quaterniond(turn).coeffs()).norm(), 1e-14);
        const Eigen::AngleAxisd back = math::angle_axis(turn.toRotationMatrix());
        EXPECT_LT((back.toRotationMatrix() - turn.toRotationMatrix()).norm(), 1e-13);
        EXPECT_GE(back.angle(), 0);
        const Eigen::Quaterniond p(turn), q(other);
        EXPECT_LT((math::slerp(p, 0.3, q).coeffs() - p.slerp(0.3, q).coeffs()).norm(), 1e-13);
    }
    EXPECT_EQ(math::angle_axis(Eigen::Quaterniond::Identity()).angle(), 0);
}

/// Of the bits of every function's values; the same on every platform. Another value: a new method, and models, scenes
/// and recorded hashes change with it.
TEST(Math, BitsAreTheSameEverywhere) {
    Arguments any;
    std::uint64_t hash = 0;
    const auto add = [&](double value) { hash = hash_words(hash, std::bit_cast<std::uint64_t>(value)); };
    for (int i = 0; i < 20000; ++i) {
        const double x = any.between(-10, 10), y = any.between(0, 10), unit = any.between(-1, 1),
                     size = any.of_any_size();
        for (const double value :
             {math::sin(x), math::cos(x), math::tan(x), math::asin(unit), math::acos(unit), math::atan(x),
              math::atan2(x, y), math::exp(x), math::exp2(x), math::expm1(x), math::log(size), math::log2(size),
              math::log10(size), math::log1p(y), math::pow(y, x), math::cbrt(size), math::hypot(x, y),
              math::gamma(y + 0.1), math::sin(1e5 * x)})
            add(value);
    }
    EXPECT_EQ(hash, 17203622862198994590u);
}
