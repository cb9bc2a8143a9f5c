#include "filigree/sample/exact_sign.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

using namespace filigree;
using namespace filigree::exact;

namespace {

/// An integer of any size, the reference: sign and 32-bit digits, lowest first.
class BigInteger {
public:
    BigInteger() = default;
    /// number * 2^1074, which is an integer for every finite double.
    explicit BigInteger(double number) : negative_(number < 0) {
        int exponent = 0;
        const double fraction = std::frexp(std::abs(number), &exponent); // 53 bits
        auto mantissa = static_cast<std::uint64_t>(std::ldexp(fraction, 53));
        int shift = exponent - 53 + 1074;
        if (shift < 0) mantissa >>= -shift, shift = 0; // a subnormal: the bits shifted out are zero
        digits_.assign(static_cast<std::size_t>(shift / 32) + 3, 0);
        for (int bit = 0; bit < 53; ++bit)
            if (mantissa >> bit & 1)
                digits_[static_cast<std::size_t>((shift + bit) / 32)] |= std::uint32_t{1} << (shift + bit) % 32;
        trim();
    }
    int sign() const { return digits_.empty() ? 0 : negative_ ? -1 : 1; }

    friend BigInteger operator+(const BigInteger& a, const BigInteger& b) {
        if (a.negative_ != b.negative_) {
            const bool a_larger = larger(a, b);
            return difference(a_larger ? a : b, a_larger ? b : a);
        }
        BigInteger sum = a;
        sum.digits_.resize(std::max(a.digits_.size(), b.digits_.size()) + 1);
        std::uint64_t carry = 0;
        for (std::size_t i = 0; i < sum.digits_.size(); ++i) {
            carry += std::uint64_t{sum.digits_[i]} + (i < b.digits_.size() ? b.digits_[i] : 0);
            sum.digits_[i] = static_cast<std::uint32_t>(carry);
            carry >>= 32;
        }
        sum.trim();
        return sum;
    }
    friend BigInteger operator-(const BigInteger& a, BigInteger b) {
        b.negative_ = !b.negative_;
        return a + b;
    }
    friend BigInteger operator*(const BigInteger& a, const BigInteger& b) {
        BigInteger product;
        product.negative_ = a.negative_ != b.negative_;
        product.digits_.resize(a.digits_.size() + b.digits_.size());
        for (std::size_t i = 0; i < a.digits_.size(); ++i) {
            std::uint64_t carry = 0;
            for (std::size_t j = 0; j < b.digits_.size() || carry; ++j) {
                carry += product.digits_[i + j];
                if (j < b.digits_.size()) carry += std::uint64_t{a.digits_[i]} * b.digits_[j];
                product.digits_[i + j] = static_cast<std::uint32_t>(carry);
                carry >>= 32;
            }
        }
        product.trim();
        return product;
    }

private:
    bool negative_ = false;
    std::vector<std::uint32_t> digits_;

    void trim() {
        while (!digits_.empty() && digits_.back() == 0) digits_.pop_back();
    }
    static bool larger(const BigInteger& a, const BigInteger& b) {
        if (a.digits_.size() != b.digits_.size()) return a.digits_.size() > b.digits_.size();
        return std::lexicographical_compare(b.digits_.rbegin(), b.digits_.rend(), a.digits_.rbegin(), a.digits_.rend());
    }
    /// |a| - |b| with the sign of a, for |a| >= |b|.
    static BigInteger difference(BigInteger a, const BigInteger& b) {
        std::int64_t borrow = 0;
        for (std::size_t i = 0; i < a.digits_.size(); ++i) {
            const std::int64_t d = std::int64_t{a.digits_[i]} - (i < b.digits_.size() ? b.digits_[i] : 0) + borrow;
            borrow = d < 0 ? -1 : 0;
            a.digits_[i] = static_cast<std::uint32_t>(d);
        }
        a.trim();
        return a;
    }
};

using Big3 = std::array<BigInteger, 3>;

Big3 big_difference(const Vec3d& a, const Vec3d& b) {
    Big3 d;
    for (int i = 0; i < 3; ++i) d[static_cast<std::size_t>(i)] = BigInteger(a[i]) - BigInteger(b[i]);
    return d;
}
Big3 big_cross(const Big3& u, const Big3& v) {
    return {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
}
int reference_orient3d(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d) {
    const Big3 n = big_cross(big_difference(b, a), big_difference(c, a)), w = big_difference(d, a);
    return (n[0] * w[0] + n[1] * w[1] + n[2] * w[2]).sign();
}
std::array<int, 3> reference_normal(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    const Big3 n = big_cross(big_difference(b, a), big_difference(c, a));
    return {n[0].sign(), n[1].sign(), n[2].sign()};
}

class Random {
public:
    double uniform(double lo, double hi) { return std::uniform_real_distribution(lo, hi)(engine_); }
    int integer(int lo, int hi) { return std::uniform_int_distribution(lo, hi)(engine_); }
    Vec3d point(double size) { return {uniform(-size, size), uniform(-size, size), uniform(-size, size)}; }
    Vec3d lattice_point(int size) { return Vec3d(integer(-size, size), integer(-size, size), integer(-size, size)); }

private:
    std::mt19937_64 engine_{7};
};

/// A point on the plane of a, b, c as nearly as rounding allows, then up to 2 steps of the last place off it.
Vec3d near_plane(Random& random, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    const double u = random.uniform(-1, 2), v = random.uniform(-1, 2);
    Vec3d p = a + u * (b - a) + v * (c - a);
    for (double& x : p)
        for (int steps = random.integer(-2, 2); steps != 0; steps += steps < 0 ? 1 : -1)
            x = std::nextafter(x, steps < 0 ? -1e300 : 1e300);
    return p;
}

} // namespace

TEST(ExactSign, KnowsTheTurnsOfSmallIntegers) {
    EXPECT_EQ(orient2d({0, 0}, {1, 0}, {0, 1}), 1);
    EXPECT_EQ(orient2d({0, 0}, {0, 1}, {1, 0}), -1);
    EXPECT_EQ(orient2d({0, 0}, {1, 1}, {2, 2}), 0);
    EXPECT_EQ(orient3d({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}), 1);
    EXPECT_EQ(orient3d({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, -1}), -1);
    EXPECT_EQ(orient3d({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 7, 0}), 0);
    EXPECT_EQ(normal_signs({0, 0, 0}, {1, 0, 0}, {0, 1, 0}), (std::array{0, 0, 1}));
    EXPECT_EQ(normal_signs({1, 0, 0}, {0, 1, 0}, {0, 0, 1}), (std::array{1, 1, 1}));
}

TEST(ExactSign, AgreesWithBigIntegersOnSmallLattices) {
    Random random;
    int zeros = 0;
    for (int i = 0; i < 20000; ++i) {
        const Vec3d a = random.lattice_point(3), b = random.lattice_point(3), c = random.lattice_point(3),
                    d = random.lattice_point(3);
        const int expected = reference_orient3d(a, b, c, d);
        ASSERT_EQ(orient3d(a, b, c, d), expected);
        ASSERT_EQ(normal_signs(a, b, c), reference_normal(a, b, c));
        zeros += expected == 0;
    }
    EXPECT_GT(zeros, 500);
}

TEST(ExactSign, AgreesWithBigIntegersNearPlanesAndLines) {
    Random random;
    Tally tally;
    for (const double size : {1e-80, 1e-30, 1e-3, 1.0, 1e6, 1e38, 1e80})
        for (int i = 0; i < 1500; ++i) {
            const Vec3d a = random.point(size), b = random.point(size), c = random.point(size);
            const Vec3d d = near_plane(random, a, b, c);
            ASSERT_EQ(orient3d(a, b, c, d, &tally), reference_orient3d(a, b, c, d)) << "size " << size;

            const double t = random.uniform(-1, 2); // a sliver
            const Vec3d e = a + t * (b - a);
            ASSERT_EQ(normal_signs(a, b, e, &tally), reference_normal(a, b, e)) << "size " << size;
            ASSERT_EQ(orient3d(a, b, e, c, &tally), reference_orient3d(a, b, e, c)) << "size " << size;
        }
    EXPECT_GT(tally.expansions, 5000u);
}

TEST(ExactSign, StaysExactWhenSizesAreMixed) {
    Random random;
    for (int i = 0; i < 3000; ++i) {
        const auto any_size = [&] {
            const double x = std::ldexp(random.uniform(-1, 1), random.integer(-140, 120));
            return random.integer(0, 4) == 0 ? 0 : static_cast<double>(static_cast<float>(x)); // subnormal ones too
        };
        const auto point = [&] { return Vec3d(any_size(), any_size(), any_size()); };
        const Vec3d a = point(), b = point(), c = point(),
                    d = random.integer(0, 1) ? point() : near_plane(random, a, b, c);
        ASSERT_EQ(normal_signs(a, b, c), reference_normal(a, b, c));
        if (((d.array() == 0) || (d.array().abs() > 0x1p-300)).all()) {
            ASSERT_EQ(orient3d(a, b, c, d), reference_orient3d(a, b, c, d));
        }
    }
}

TEST(ExactSign, HoldsToTheEndsOfItsRange) {
    for (const double unit : {0x1p-300, 0x1p-149, 0x1p127, 0x1p298}) {
        const double next = std::nextafter(unit, 1e300);
        EXPECT_EQ(orient2d({unit, unit}, {2 * unit, 2 * unit}, {next, next}), 0);
        EXPECT_EQ(orient2d({unit, unit}, {2 * unit, 2 * unit}, {unit, next}), 1);
        EXPECT_EQ(orient2d({unit, unit}, {2 * unit, 2 * unit}, {next, unit}), -1);
        const Vec3d a(unit, unit, unit), b(next, unit, unit), c(unit, next, unit);
        EXPECT_EQ(orient3d(a, b, c, {unit, unit, next}), 1); // a tetrahedron of one last place
        EXPECT_EQ(orient3d(a, c, b, {unit, unit, next}), -1);
        EXPECT_EQ(orient3d(a, b, c, {next, next, unit}), 0);
        EXPECT_EQ(orient3d({unit, 0, 0}, {0, unit, 0}, {0, 0, unit}, {0, 0, 0}), -1);
    }
}

TEST(ExactSign, FlipsWithEveryExchangeOfTwoPoints) {
    Random random;
    for (int i = 0; i < 500; ++i) {
        std::array<Vec3d, 4> p = {random.point(1), random.point(1), random.point(1)};
        p[3] = near_plane(random, p[0], p[1], p[2]);
        const int side = orient3d(p[0], p[1], p[2], p[3]);
        std::array<std::size_t, 4> order = {0, 1, 2, 3};
        do {
            int exchanges = 0;
            for (std::size_t j = 0; j < 4; ++j)
                for (std::size_t k = j + 1; k < 4; ++k) exchanges += order[j] > order[k];
            ASSERT_EQ(orient3d(p[order[0]], p[order[1]], p[order[2]], p[order[3]]), exchanges % 2 ? -side : side);
        } while (std::next_permutation(order.begin(), order.end()));
    }
}

TEST(ExactSign, IsUnchangedByLargeExactTranslations) {
    Random random;
    for (int i = 0; i < 2000; ++i) {
        const Vec3d a = random.lattice_point(8), b = random.lattice_point(8), c = random.lattice_point(8),
                    d = random.lattice_point(8);
        for (const double offset : {0x1p20, 0x1p38, 0x1p45}) { // the last beyond 40 bits: expansions
            const Vec3d far(offset, -offset, 3 * offset);
            ASSERT_EQ(orient3d(a + far, b + far, c + far, d + far), orient3d(a, b, c, d)) << offset;
            ASSERT_EQ(normal_signs(a + far, b + far, c + far), normal_signs(a, b, c)) << offset;
        }
    }
}

TEST(ExactSign, CountsWhatTheFilterLeftOpen) {
    Tally tally;
    EXPECT_EQ(orient3d({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, &tally), 1);
    EXPECT_EQ(tally.integers + tally.expansions, 0u);
    EXPECT_EQ(orient3d({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.25, 0.25, 0.5}, &tally), 0);
    EXPECT_EQ(tally.integers, 1u);
    const double tenth = 0.1; // 3 * 0.1 is not on the line through 0 and (0.1, 0.1, 0.1) times 3, but x = y = z is
    EXPECT_EQ(orient3d({0, 0, 0}, {tenth, tenth, tenth}, {3, 1, 2}, {3 * tenth, 3 * tenth, 3 * tenth}, &tally), 0);
    EXPECT_EQ(tally.expansions, 1u);
}

TEST(ExactSign, PerturbedPointIsOnNoPlane) {
    Random random;
    int on_plane = 0;
    for (int i = 0; i < 20000; ++i) {
        const Vec3d a = random.lattice_point(2), b = random.lattice_point(2), c = random.lattice_point(2),
                    d = random.lattice_point(2);
        const std::array<int, 3> normal = normal_signs(a, b, c);
        const bool proper = normal != std::array{0, 0, 0};
        const int side = orient3d_perturbed(a, b, c, d);
        ASSERT_EQ(side != 0, proper);
        // On this lattice a step of 1e-3, 1e-6, 1e-9 is small enough to stand for e, e^2, e^3.
        if (proper) {
            ASSERT_EQ(side, orient3d(a, b, c, d + Vec3d(1e-3, 1e-6, 1e-9)));
        }
        on_plane += proper && orient3d(a, b, c, d) == 0;
    }
    EXPECT_GT(on_plane, 500);
}
