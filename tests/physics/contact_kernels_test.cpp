// What contacts ask of many boxes or particles at once gives what asking one by one gives.
#include "filigree/core/random.h"
#include "filigree/physics/box_sweep.h"
#include "filigree/physics/extremes_kernel.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

namespace filigree {
namespace {

/// In [low, high).
float draw(std::uint64_t seed, std::uint64_t& counter, double low, double high) {
    return float(low + (high - low) * random_unit(seed, counter++));
}

std::set<std::pair<Index, Index>> near_one_by_one(std::span<const BoxSweep::Bounds> boxes, float around) {
    std::set<std::pair<Index, Index>> near;
    for (Index a = 0; a < boxes.size(); ++a)
        for (Index b = a; b < boxes.size(); ++b) {
            const Vec3f gap = (boxes[a].low - boxes[b].high).cwiseMax(boxes[b].low - boxes[a].high);
            if (gap.maxCoeff() <= around) near.emplace(a, b);
        }
    return near;
}

std::set<std::pair<Index, Index>> near_by_sweep(std::span<const BoxSweep::Bounds> boxes, float around) {
    const BoxSweep sweep(boxes);
    std::vector<std::uint16_t> room;
    std::set<std::pair<Index, Index>> near;
    for (std::size_t a = 0; a < boxes.size(); ++a) {
        std::size_t before = 0;
        sweep.each_near(a, around, room, [&](std::size_t b) {
            EXPECT_TRUE(b == a || b > before);
            before = b;
            const auto [low, high] = std::minmax(sweep.order()[a], sweep.order()[b]);
            EXPECT_TRUE(near.emplace(low, high).second);
        });
    }
    return near;
}

TEST(BoxSweep, FindsWhatComparingAllFinds) {
    for (const std::size_t count : {0u, 1u, 2u, 15u, 16u, 17u, 100u})
        for (std::uint64_t seed = 0; seed < 4; ++seed) {
            std::uint64_t counter = 0;
            const Vec3f stretched = seed % 3 == 0 ? Vec3f(8, 1, 1) : seed % 3 == 1 ? Vec3f(1, 1, 8) : Vec3f(2, 2, 2);
            std::vector<BoxSweep::Bounds> boxes;
            for (std::size_t k = 0; k < count; ++k) {
                Vec3f low, size;
                for (int axis = 0; axis < 3; ++axis) {
                    low[axis] = stretched[axis] * draw(seed, counter, -1, 1);
                    size[axis] = seed == 3 ? 0 : draw(seed, counter, 0, 0.5);
                }
                boxes.push_back({low, low + size});
            }
            for (const float around : {0.0f, 0.1f, 30.0f}) {
                SCOPED_TRACE(testing::Message() << count << " boxes, seed " << seed << ", around " << around);
                EXPECT_EQ(near_by_sweep(boxes, around), near_one_by_one(boxes, around));
            }
        }
}

TEST(BoxSweep, TakesBoxesAtOnePlaceAndAsFarApartAsFloatsGo) {
    const BoxSweep::Bounds here{Vec3f::Constant(1), Vec3f::Constant(1)};
    const float most = std::numeric_limits<float>::max();
    const std::vector<BoxSweep::Bounds> same(40, here);
    EXPECT_EQ(near_by_sweep(same, 0).size(), 40u * 41 / 2);
    const std::vector<BoxSweep::Bounds> far{
        {Vec3f::Constant(-most), Vec3f::Constant(-most)}, here, {Vec3f::Constant(most), Vec3f::Constant(most)}};
    EXPECT_EQ(near_by_sweep(far, 1).size(), 3u);
}

TEST(Extremes, AreThoseOfWhatCounts) {
    for (const std::size_t count : {1u, 15u, 16u, 33u, 1000u})
        for (const bool has_from : {false, true}) {
            SCOPED_TRACE(testing::Message() << count << " particles" << (has_from ? ", less others" : ""));
            std::uint64_t counter = 0;
            Vectors values(count), from(count);
            std::vector<float> counts((count + kExtremesPadding - 1) / kExtremesPadding * kExtremesPadding, 0.0f);
            const Index usual = Index(count / 2);
            Extremes expected{Vec3f::Constant(1e30f), Vec3f::Constant(-1e30f)};
            for (std::size_t i = 0; i < count; ++i) {
                counts[i] = i == usual || draw(1, counter, 0, 1) < 0.7f;
                for (const auto axis : kVectorAxes) {
                    // Quarters, of which sums are exact; what does not count goes beyond all that does.
                    (values.*axis)[i] = std::round(draw(1, counter, -40, 40)) / 4 + (counts[i] == 0 ? 100.0f : 0.0f);
                    (from.*axis)[i] = std::round(draw(1, counter, -40, 40)) / 4;
                }
                const Vec3f value = has_from ? Vec3f(values[i] - from[i]) : values[i];
                if (counts[i] != 0) expected = expected.with({value, value});
            }
            const Extremes found = extremes_of(values, has_from ? &from : nullptr, counts, usual);
            EXPECT_EQ(found.least, expected.least);
            EXPECT_EQ(found.most, expected.most);
        }
}

} // namespace
} // namespace filigree
