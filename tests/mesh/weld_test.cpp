#include "filigree/mesh/weld.h"

#include <gtest/gtest.h>
#include <map>
#include <random>

namespace filigree {
namespace {

TEST(Weld, TheLowestIdAtAPlaceStandsForAll) {
    const std::vector<Vec3f> positions = {{1, 2, 3}, {0, 0, 0}, {1, 2, 3}, {-0.0f, 0, -0.0f}, {3, 2, 1}, {1, 2, 3}};
    EXPECT_EQ(weld_map(positions), (std::vector<Index>{0, 1, 0, 1, 4, 0}));
    EXPECT_TRUE(weld_map({}).empty());
}

TEST(Weld, NeighbouringFloatsStayApart) {
    const float x = 0.1f, next = std::nextafter(x, 1.0f), tiny = std::numeric_limits<float>::denorm_min();
    const std::vector<Vec3f> positions = {{x, 0, 0}, {next, 0, 0}, {tiny, 0, 0},
                                          {0, 0, 0}, {0, tiny, 0}, {-tiny, 0, 0}};
    EXPECT_EQ(weld_map(positions), (std::vector<Index>{0, 1, 2, 3, 4, 5}));
}

TEST(Weld, IsAnOrderedMapsAnswer) {
    std::mt19937 random(1);
    std::vector<Vec3f> positions;
    for (int i = 0; i < 20000; ++i)
        positions.emplace_back(float(random() % 30) - 15, float(random() % 30) * 1e-30f, float(random() % 30) * 1e30f);
    const std::vector<Index> welded = weld_map(positions);
    std::map<std::array<float, 3>, Index> first;
    for (Index v = 0; v < positions.size(); ++v)
        ASSERT_EQ(welded[v],
                  first.try_emplace({positions[v].x(), positions[v].y(), positions[v].z()}, v).first->second);
    EXPECT_LT(first.size(), positions.size());
}

} // namespace
} // namespace filigree
