#include "filigree/mesh/morton.h"

#include <gtest/gtest.h>

namespace filigree_test {
namespace {

using namespace filigree;

TEST(Morton, BitsOfTheAxesTakeTurns) {
    EXPECT_EQ(morton_key(1, 0, 0), 1u);
    EXPECT_EQ(morton_key(0, 1, 0), 2u);
    EXPECT_EQ(morton_key(0, 0, 1), 4u);
    EXPECT_EQ(morton_key(2, 1, 3), 0b101'110u);
    constexpr std::uint64_t kMost = (1u << 21) - 1;
    EXPECT_EQ(morton_key(kMost, kMost, kMost), (std::uint64_t{1} << 63) - 1);
    for (unsigned bit = 0; bit < 21; ++bit) EXPECT_EQ(spread_bits(1u << bit), std::uint64_t{1} << (3 * bit));
}

TEST(Morton, StepsStayInTheBox) {
    Box box;
    box.extend({0, 0, 0});
    box.extend({2, 1, 1});
    const MortonOrder order(box);
    EXPECT_EQ(order.steps({0, 0, 0}), (std::array<std::uint32_t, 3>{0, 0, 0}));
    EXPECT_EQ(order.steps({2, 1, -3}), (std::array<std::uint32_t, 3>{1023, 511, 0}));
    EXPECT_EQ(order.key({2, 0, 0}), spread_bits(1023));
    EXPECT_LT(order.key({0.1f, 0.1f, 0.1f}), order.key({1.9f, 0.9f, 0.9f}));
}

} // namespace
} // namespace filigree_test
