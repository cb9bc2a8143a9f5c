// Walks over the bytes of a text file: lines, words and numbers, the same in every locale.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

namespace filigree {

/// Reads a decimal number at `p`, correctly rounded; also nan and inf, and infinity for what is too large for double.
/// Returns where it ends, or `p` when there is none.
const char* parse_number_exactly(const char* p, const char* end, double& value);

/// The start of `text`, in quotes and printable, for a message.
std::string in_quotes(std::string_view text, std::size_t longest = 24);

inline bool is_digit(char c) { return static_cast<unsigned char>(c - '0') < 10; }

/// The same, quickly: at most 2^53 as digits and a power of ten up to 22 need one exact operation [Clinger 1990].
inline const char* parse_number(const char* p, const char* end, double& value) {
    static constexpr double kPowers[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                         1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
    constexpr std::uint64_t kExactDigits = std::uint64_t{1} << 53;
    constexpr std::ptrdiff_t kMaxDigits = 19; // more could overflow 64 bits
    const char* q = p;
    const bool negative = q < end && *q == '-';
    if (q < end && (*q == '-' || *q == '+')) ++q;
    const char* const whole = q;
    std::uint64_t digits = 0;
    for (; q < end && is_digit(*q); ++q) digits = 10 * digits + static_cast<unsigned>(*q - '0');
    std::ptrdiff_t count = q - whole, decimals = 0;
    if (q < end && *q == '.') {
        const char* const fraction = ++q;
        for (; q < end && is_digit(*q); ++q) digits = 10 * digits + static_cast<unsigned>(*q - '0');
        decimals = q - fraction;
        count += decimals;
    }
    const bool has_exponent = q < end && (*q == 'e' || *q == 'E');
    if (count == 0 || count > kMaxDigits || digits > kExactDigits || decimals > 22 || has_exponent)
        return parse_number_exactly(p, end, value);
    const double magnitude = static_cast<double>(digits) / kPowers[decimals];
    value = negative ? -magnitude : magnitude;
    return q;
}

/// A place in a text that only moves forward. Lines end in LF, CR LF or CR, and are counted from 1.
class TextScanner {
public:
    explicit TextScanner(std::string_view text) : begin_(text.data()), p_(begin_), end_(begin_ + text.size()) {}

    bool at_end() const { return p_ == end_; }
    std::size_t line() const { return line_; }
    std::size_t offset() const { return static_cast<std::size_t>(p_ - begin_); }
    std::size_t bytes_left() const { return static_cast<std::size_t>(end_ - p_); }
    char peek() const { return p_ < end_ ? *p_ : '\0'; }
    void advance() { ++p_; }

    static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }
    static bool is_line_end(char c) { return c == '\n' || c == '\r'; }

    /// At the end of the line, or of what counts in it: at a comment.
    bool at_line_end() const { return p_ == end_ || is_line_end(*p_) || *p_ == '#'; }
    /// Between two words.
    bool at_word_end() const { return at_line_end() || is_blank(*p_) || *p_ == '\\'; }

    /// Past blanks, and past a backslash that continues the line in the next one.
    void skip_blanks() {
        while (p_ < end_ && (is_blank(*p_) || *p_ == '\\')) {
            if (is_blank(*p_))
                ++p_;
            else if (!skip_continuation())
                return;
        }
    }

    /// Past the end of this line.
    void next_line() {
        while (p_ < end_ && !is_line_end(*p_)) ++p_;
        skip_line_end();
    }

    /// Past blanks, line ends and comments.
    void skip_space() {
        for (skip_blanks(); p_ < end_ && at_line_end(); skip_blanks()) next_line();
    }

    /// The characters up to the next blank, line end or comment; empty when there are none.
    std::string_view word() {
        const char* const first = p_;
        while (!at_word_end()) ++p_;
        return {first, static_cast<std::size_t>(p_ - first)};
    }

    /// The rest of the line without blanks around it; stops before the line's end. A '#' belongs to it: names may hold
    /// one.
    std::string_view rest_of_line() {
        skip_blanks();
        const char* const first = p_;
        while (p_ < end_ && !is_line_end(*p_)) ++p_;
        const char* last = p_;
        while (last > first && is_blank(last[-1])) --last;
        return {first, static_cast<std::size_t>(last - first)};
    }

    /// A number that ends where a word ends. When there is none, stays where it is and returns false.
    bool number(double& value) {
        const char* const first = p_;
        p_ = parse_number(first, end_, value);
        if (p_ != first && at_word_end()) return true;
        p_ = first;
        return false;
    }

    /// A whole number. Larger ones than 2^53 come back as 2^53. When there is none, stays and returns false.
    bool integer(std::int64_t& value) {
        constexpr std::int64_t kMax = std::int64_t{1} << 53;
        const char* q = p_;
        const bool negative = q < end_ && *q == '-';
        if (q < end_ && (*q == '-' || *q == '+')) ++q;
        const char* const first = q;
        for (value = 0; q < end_ && is_digit(*q); ++q) value = value < kMax / 10 ? 10 * value + (*q - '0') : kMax;
        if (q == first) return false;
        p_ = q;
        if (negative) value = -value;
        return true;
    }

private:
    void skip_line_end() {
        if (p_ == end_) return;
        const bool carriage_return = *p_++ == '\r';
        if (carriage_return && p_ < end_ && *p_ == '\n') ++p_;
        ++line_;
    }

    bool skip_continuation() {
        const char* q = p_ + 1;
        while (q < end_ && is_blank(*q)) ++q;
        if (q < end_ && !is_line_end(*q)) return false;
        p_ = q;
        skip_line_end();
        return true;
    }

    const char* begin_;
    const char* p_;
    const char* end_;
    std::size_t line_ = 1;
};

} // namespace filigree
