#include "filigree/core/text.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

TEST(Text, CommasStandBetweenThousands) {
    EXPECT_EQ(with_commas(0), "0");
    EXPECT_EQ(with_commas(999), "999");
    EXPECT_EQ(with_commas(1000), "1,000");
    EXPECT_EQ(with_commas(1234567), "1,234,567");
    EXPECT_EQ(with_commas(~std::uint64_t{0}), "18,446,744,073,709,551,615");
}

} // namespace
} // namespace filigree
