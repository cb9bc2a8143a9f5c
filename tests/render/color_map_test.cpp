#include "filigree/render.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

using namespace filigree;

namespace {

constexpr ColorMap kMaps[] = {ColorMap::sequential, ColorMap::diverging};
constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();

ValueRange range_of(std::vector<float> values, bool from_zero = false) { return legend_range(values, from_zero); }

void expect_range(const ValueRange& range, float least, float most) {
    EXPECT_EQ(range.least, least);
    EXPECT_EQ(range.most, most);
}

} // namespace

TEST(Oklab, KnowsItsLandmarks) {
    const auto expect_lab = [](const Vec3f& srgb, const Vec3f& lab) {
        EXPECT_LT((srgb_to_oklab(srgb) - lab).norm(), 1e-3f) << srgb_to_oklab(srgb).transpose();
    };
    expect_lab({0, 0, 0}, {0, 0, 0});
    expect_lab({1, 1, 1}, {1, 0, 0});
    expect_lab({1, 0, 0}, {0.628f, 0.2249f, 0.1258f});
    expect_lab({0, 0, 1}, {0.452f, -0.0324f, -0.3115f});
    const Vec3f grey = srgb_to_oklab(Vec3f::Constant(0.4f));
    EXPECT_LT(std::hypot(grey.y(), grey.z()), 1e-4f);
}

TEST(ColorMap, NeighboursAreEquallyFarApart) {
    for (const ColorMap map : kMaps) {
        const std::span<const Vec3f> table = color_table(map);
        ASSERT_EQ(table.size(), 256u);
        float least = kInfinity, most = 0;
        for (std::size_t i = 1; i < table.size(); ++i) {
            const float step = (srgb_to_oklab(table[i]) - srgb_to_oklab(table[i - 1])).norm();
            least = std::min(least, step);
            most = std::max(most, step);
        }
        EXPECT_GT(least, 0.99f * most);
        EXPECT_GT(most, 0.003f); // the whole way is long, so that small differences show
    }
}

TEST(ColorMap, EveryColorCanBeShown) {
    for (const ColorMap map : kMaps)
        for (const Vec3f& color : color_table(map)) {
            EXPECT_GE(color.minCoeff(), 0.0f);
            EXPECT_LE(color.maxCoeff(), 1.0f);
        }
}

TEST(ColorMap, SequentialLightnessRisesSteadily) {
    const std::span<const Vec3f> table = color_table(ColorMap::sequential);
    const float first = srgb_to_oklab(table.front()).x(), last = srgb_to_oklab(table.back()).x();
    EXPECT_NEAR(first, 0.34f, 0.02f);
    EXPECT_NEAR(last, 0.93f, 0.02f);
    const float even = (last - first) / 255;
    for (std::size_t i = 1; i < table.size(); ++i) {
        const float rise = srgb_to_oklab(table[i]).x() - srgb_to_oklab(table[i - 1]).x();
        EXPECT_GT(rise, 0.5f * even) << i;
        EXPECT_LT(rise, 1.5f * even) << i;
    }
}

TEST(ColorMap, DivergingLightnessIsSymmetricAboutAPaleMiddle) {
    const std::span<const Vec3f> table = color_table(ColorMap::diverging);
    for (std::size_t i = 0; i < 128; ++i) {
        const float left = srgb_to_oklab(table[i]).x();
        EXPECT_NEAR(left, srgb_to_oklab(table[255 - i]).x(), 1e-5f) << i;
        EXPECT_GT(srgb_to_oklab(table[i + 1]).x(), left - 1e-6f) << i;
    }
    const Vec3f middle = srgb_to_oklab(color_at(ColorMap::diverging, 0.5f));
    EXPECT_GT(middle.x(), 0.9f);
    EXPECT_LT(std::hypot(middle.y(), middle.z()), 0.02f);
    EXPECT_GT(middle.z(), 0.0f); // warm
    const Vec3f low = table.front(), high = table.back();
    EXPECT_GT(low.z(), 2 * low.x());   // blue
    EXPECT_GT(high.x(), 2 * high.z()); // red
}

TEST(ColorMap, ClampsAndInterpolates) {
    for (const ColorMap map : kMaps) {
        const std::span<const Vec3f> table = color_table(map);
        for (const float t : {0.0f, -1.0f, -kInfinity}) EXPECT_EQ(color_at(map, t), table.front());
        for (const float t : {1.0f, 7.0f, kInfinity}) EXPECT_EQ(color_at(map, t), table.back());
        for (std::size_t i = 0; i < table.size(); ++i)
            EXPECT_LT((color_at(map, static_cast<float>(i) / 255) - table[i]).norm(), 1e-5f);
        EXPECT_LT((color_at(map, 100.5f / 255) - 0.5f * (table[100] + table[101])).norm(), 1e-5f);
        const Vec3f none = color_at(map, kNan);
        EXPECT_EQ(none.minCoeff(), none.maxCoeff()); // grey
    }
}

TEST(LegendRange, EndsAreRound) {
    expect_range(range_of({0.13f, 0.87f}), 0.1f, 0.9f);
    expect_range(range_of({0.1f, 0.7f}), 0.1f, 0.7f); // already round, whatever float makes of them
    expect_range(range_of({-3.2f, 8.1f}), -4, 10);
    expect_range(range_of({-871, -112}), -900, -100);
    expect_range(range_of({0.0031f}, true), 0, 0.0035f);
    expect_range(range_of({0.4f, 3, 99}, true), 0, 100);
}

TEST(LegendRange, TakesFiniteValuesOnlyAndIsNeverEmpty) {
    expect_range(range_of({}), 0, 1);
    expect_range(range_of({kNan, kInfinity, -kInfinity}), 0, 1);
    expect_range(range_of({kNan, 2, kInfinity, 4}), 2, 4);
    expect_range(range_of({0, 0, 0}), 0, 1);
    expect_range(range_of({0, 0}, true), 0, 1);
    expect_range(range_of({-5, -2}, true), 0, 1);
    expect_range(range_of({3, 3}), 2.5f, 3.5f);
    expect_range(range_of({-3, -3}), -3.5f, -2.5f);
    constexpr float kMost = std::numeric_limits<float>::max(), kLeast = std::numeric_limits<float>::denorm_min();
    expect_range(range_of({-kMost, kMost}), -kMost, kMost);
    const ValueRange tiny = range_of({kLeast}, true);
    EXPECT_EQ(tiny.least, 0);
    EXPECT_GE(tiny.most, kLeast);
}

TEST(LegendRange, HoldsEveryValueAndWastesLittle) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int i = 0; i < 20000; ++i) {
        const double scale = std::pow(10.0, static_cast<int>(random() % 60) - 30);
        const auto draw = [&] { return static_cast<float>(uniform(random) * scale); };
        const float a = draw(), b = draw();
        const ValueRange range = range_of({a, b});
        ASSERT_LT(range.least, range.most);
        ASSERT_LE(range.least, std::min(a, b));
        ASSERT_GE(range.most, std::max(a, b));
        if (std::abs(a - b) > 1e-4f * std::abs(a)) {
            ASSERT_LE(range.most - range.least, 1.51f * std::abs(a - b)); // a step is up to a quarter
        }
    }
}

TEST(LegendTicks, AreRoundAscendingAndInside) {
    EXPECT_EQ(legend_ticks({0, 1}, 6), (std::vector<double>{0, 0.2, 0.4, 0.6, 0.8, 1}));
    EXPECT_EQ(legend_ticks({-1, 1}, 5), (std::vector<double>{-1, -0.5, 0, 0.5, 1}));
    EXPECT_EQ(legend_ticks({0.1f, 0.7f}, 7), (std::vector<double>{0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7}));
    EXPECT_EQ(legend_ticks({-873, 112}, 4), (std::vector<double>{-500, 0}));
    EXPECT_EQ(legend_ticks({0, 3e-7f}, 4), (std::vector<double>{0, 1e-7, 2e-7, 3e-7}));
    EXPECT_FALSE(std::signbit(legend_ticks({-1e-9f, 1}, 3).front())); // "-0" would look odd
    std::mt19937 random(6);
    for (int i = 0; i < 5000; ++i) {
        const float a = static_cast<float>(static_cast<int>(random())) * 1e-3f;
        const ValueRange range = {a, a + 1e3f + static_cast<float>(random() % 1000000)};
        const auto count = static_cast<unsigned>(2 + random() % 20);
        const std::vector<double> ticks = legend_ticks(range, count);
        ASSERT_TRUE(std::is_sorted(ticks.begin(), ticks.end()));
        ASSERT_LE(ticks.size(), count);
        ASSERT_GE(3 * ticks.size() + 3, count) << range.least << " to " << range.most;
        for (const double tick : ticks) ASSERT_TRUE(tick > range.least - 0.1f && tick < range.most + 0.1f);
    }
}

TEST(LegendTicks, NothingToShowNoTicks) {
    EXPECT_TRUE(legend_ticks({0, 1}, 0).empty());
    EXPECT_TRUE(legend_ticks({1, 1}, 5).empty());
    EXPECT_TRUE(legend_ticks({2, 1}, 5).empty());
    EXPECT_TRUE(legend_ticks({0, kInfinity}, 5).empty());
    EXPECT_TRUE(legend_ticks({kNan, 1}, 5).empty());
    EXPECT_LE(legend_ticks({0, 1}, 4000000000u).size(), 1100u);
}
