#include "filigree/io/system/text_scanner.h"
#include "filigree/io/system/text_writer.h"

#include <gtest/gtest.h>
#include <optional>

#include <bit>
#include <cmath>
#include <cstdlib>
#include <random>

using namespace filigree;

namespace {

double parse(const std::string& text) {
    double value = -1;
    const char* const last = parse_number(text.data(), text.data() + text.size(), value);
    EXPECT_EQ(last, text.data() + text.size()) << text;
    return value;
}

template <class T>
std::string print(T x) {
    std::string text;
    TextWriter(text).number(x);
    return text;
}

} // namespace

TEST(ParseNumber, ReadsAllForms) {
    EXPECT_EQ(parse("0"), 0);
    EXPECT_TRUE(std::signbit(parse("-0")));
    EXPECT_EQ(parse("+1.5"), 1.5);
    EXPECT_EQ(parse(".5"), 0.5);
    EXPECT_EQ(parse("5."), 5);
    EXPECT_EQ(parse("-1e3"), -1000);
    EXPECT_EQ(parse("1E+3"), 1000);
    EXPECT_EQ(parse("+1e-3"), 0.001);
    EXPECT_EQ(parse("9007199254740993"), 9007199254740992.0); // 2^53 + 1 is half way: to even
    EXPECT_EQ(parse("9007199254740993.00000000000000000001"), 9007199254740994.0);
    EXPECT_EQ(parse("0.000000000000000000000000000001"), 1e-30);
    EXPECT_EQ(parse("18446744073709551617"), 18446744073709551617.0);
    EXPECT_EQ(parse("1e400"), HUGE_VAL);
    EXPECT_EQ(parse("-1e400"), -HUGE_VAL);
    EXPECT_EQ(parse("1e-400"), 0);
    EXPECT_EQ(parse(std::string(400, '0') + "1e-400"), 0);
    EXPECT_EQ(parse("0." + std::string(400, '0') + "1"), 0);
    EXPECT_EQ(parse(std::string(400, '9')), HUGE_VAL);
    EXPECT_TRUE(std::isnan(parse("nan")));
    EXPECT_EQ(parse("-inf"), -HUGE_VAL);
}

TEST(ParseNumber, StopsWhereNoNumberIs) {
    for (const std::string text : {"", "-", "+", ".", "e5", "x", "+-1", "-.", "--1"}) {
        double value = 0;
        EXPECT_EQ(parse_number(text.data(), text.data() + text.size(), value), text.data()) << text;
    }
    double value = 0;
    const std::string text = "12abc"; // a view may end inside a number
    EXPECT_EQ(parse_number(text.data(), text.data() + 1, value), text.data() + 1);
    EXPECT_EQ(value, 1);
}

TEST(ParseNumber, AgreesWithTheCLibrary) {
    std::mt19937_64 random(1);
    for (int i = 0; i < 200000; ++i) {
        std::string text = i % 2 ? "-" : "";
        const unsigned whole = static_cast<unsigned>(random() % 8), decimals = static_cast<unsigned>(random() % 20);
        for (unsigned d = 0; d <= whole; ++d) text += static_cast<char>('0' + random() % 10);
        if (decimals > 0) text += '.';
        for (unsigned d = 0; d < decimals; ++d) text += static_cast<char>('0' + random() % 10);
        if (i % 5 == 0) text.append("e").append(std::to_string(static_cast<int>(random() % 600) - 300));
        const double value = parse(text), truth = std::strtod(text.c_str(), nullptr);
        ASSERT_EQ(std::bit_cast<std::uint64_t>(value), std::bit_cast<std::uint64_t>(truth)) << text;
    }
}

TEST(TextWriter, FloatsReadBackToTheSameBits) {
    std::mt19937 random(2);
    for (int i = 0; i < 500000; ++i) {
        const auto x = std::bit_cast<float>(static_cast<std::uint32_t>(random()));
        if (!std::isfinite(x)) continue;
        ASSERT_EQ(std::bit_cast<std::uint32_t>(static_cast<float>(parse(print(x)))), std::bit_cast<std::uint32_t>(x));
    }
    for (const float x : {0x1.5c87fap-84f, -0x1.5c87fap-84f}) EXPECT_EQ(static_cast<float>(parse(print(x))), x);
    EXPECT_EQ(print(0.1f), "0.1");
    EXPECT_EQ(print(Index{42}), "42");
}

TEST(TextWriter, FarCoordinatesAreShortAndReadBack) {
    const double origin = 524288;
    std::mt19937 random(3);
    std::uniform_real_distribution<float> unit(-1, 1);
    std::size_t longest = 0;
    for (int i = 0; i < 10000; ++i) {
        const float offset = std::ldexp(unit(random), -static_cast<int>(random() % 12));
        std::string text;
        TextWriter(text).coordinate(origin, offset);
        const double back = parse(text) - origin;
        if ((origin + static_cast<double>(offset)) - origin == static_cast<double>(offset)) {
            ASSERT_EQ(static_cast<float>(back), offset) << text;
            longest = std::max(longest, text.size());
        } else { // double has no such digits that far out
            ASSERT_NEAR(back, offset, 0x1p-33) << text;
        }
    }
    EXPECT_LE(longest, 17u + 1); // never longer than the double's
    std::string text;
    TextWriter(text).coordinate(origin, 0.5f).text(" ").coordinate(origin, 0).text(" ").coordinate(origin, 100);
    EXPECT_EQ(text, "524288.5 524288 524388");
}

TEST(TextWriter, TheSmallestOffsetsFromAnOriginAreWritten) {
    for (const float offset : {1e-45f, -1e-45f, 1.1e-38f, 3e-39f}) {
        std::string text;
        TextWriter(text).coordinate(1000, offset).text(" ").coordinate(1e-40, offset);
        EXPECT_EQ(text.substr(0, text.find(' ')), "1000");
        EXPECT_EQ(parse(text.substr(text.find(' ') + 1)), 1e-40 + static_cast<double>(offset));
    }
}

TEST(TextScanner, CountsLinesOfEveryKind) {
    TextScanner text("a\nb\r\nc\rd");
    for (std::size_t line = 1; line <= 4; ++line) {
        EXPECT_EQ(text.line(), line);
        EXPECT_EQ(text.word(), std::string(1, static_cast<char>('a' + line - 1)));
        text.next_line();
    }
    EXPECT_TRUE(text.at_end());
}

TEST(TextScanner, ContinuesLinesAfterABackslash) {
    TextScanner text("1 \\\n 2\\\r\n3 \\ 4");
    double x = 0;
    for (double expected = 1; expected <= 3; ++expected, text.skip_blanks()) {
        ASSERT_TRUE(text.number(x));
        EXPECT_EQ(x, expected);
        text.skip_blanks();
    }
    EXPECT_EQ(text.line(), 3u);
    EXPECT_FALSE(text.number(x)); // a backslash inside a line continues nothing
}

TEST(TextScanner, NumbersEndWhereWordsEnd) {
    double x = 0;
    std::int64_t n = 0;
    for (const char* const bad : {"1,5", "1.5.2", "1x", "1-2"}) EXPECT_FALSE(TextScanner(bad).number(x)) << bad;
    EXPECT_TRUE(TextScanner("1#").number(x));
    EXPECT_TRUE(TextScanner("99999999999999999999999").integer(n));
    EXPECT_EQ(n, std::int64_t{1} << 53);
    EXPECT_FALSE(TextScanner("-").integer(n));
}

TEST(TextScanner, QuotesAreReadableInEveryScript) {
    EXPECT_EQ(in_quotes("plain"), "'plain'");
    EXPECT_EQ(in_quotes("K\u00e4se \u65e5\u672c"), "'K\u00e4se \u65e5\u672c'");
    EXPECT_EQ(in_quotes("a\tb\x7f \xc2\x85 \xff\xe6"), "'a?b? ? ?\?'"); // controls, and what is no UTF-8
    EXPECT_EQ(in_quotes("\xc2"), "'?'");
    EXPECT_EQ(in_quotes(std::string(23, 'x') + "\u00e4"), "'" + std::string(23, 'x') + "...'"); // no half of one
    EXPECT_EQ(in_quotes(std::string(24, 'x')), "'" + std::string(24, 'x') + "'");
}

TEST(TextWriter, ItsEndNeedsNoMemory) {
    for (const std::size_t numbers : {1u, 100u, 5000u}) {
        std::string text;
        std::optional<TextWriter> out(std::in_place, text);
        for (std::size_t k = 0; k < numbers; ++k) out->number(double(k) + 0.123).text(" ");
        out->text(std::string(1000, 'x'));
        out->text("end of the text, which is in the buffer still");
        const char* const before = text.data();
        out.reset();
        EXPECT_EQ(text.data(), before) << "the destructor asked for memory";
        EXPECT_TRUE(text.ends_with("still"));
    }
}
