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

TEST(Text, CharactersAreAsLongAsUtf8Says) {
    const std::string text = "a\u00e4\u65e5\U0001f40c";
    EXPECT_EQ(utf8_length(text, 0), 1u);
    EXPECT_EQ(utf8_length(text, 1), 2u);
    EXPECT_EQ(utf8_length(text, 3), 3u);
    EXPECT_EQ(utf8_length(text, 6), 4u);
    EXPECT_EQ(utf8_length(text, 2), 0u); // its middle
    for (const char* wrong : {"\xc0\x80", "\xe0\x80\x80", "\xed\xa0\x80", "\xf4\x90\x80\x80", "\xf8", "\xe6\x97"})
        EXPECT_EQ(utf8_length(wrong, 0), 0u) << wrong; // overlong, a surrogate, beyond the last, cut off
}

} // namespace
} // namespace filigree
