// Based on: [Clinger 1990], which decimal numbers need a single exact operation (in the header).
#include "filigree/io/system/text_scanner.h"
#include "filigree/core/numbers.h"
#include "filigree/core/text.h"

#include <algorithm>
#include <charconv>
#include <limits>

namespace filigree {

namespace {

/// Whether the number's first non-zero digit stands left of the decimal point once its exponent is applied.
bool is_above_one(std::string_view number) {
    const std::size_t e = number.find_first_of("eE");
    const std::string_view digits = number.substr(0, e);
    const std::size_t lead = digits.find_first_of("123456789");
    if (lead == std::string_view::npos) return false;
    const std::size_t point = std::min(digits.find('.'), digits.size());
    const auto power = static_cast<std::int64_t>(point) - static_cast<std::int64_t>(lead) - (lead < point ? 1 : 0);
    std::int64_t exponent = 0;
    if (e != std::string_view::npos) {
        TextScanner scanner(number.substr(e + 1));
        scanner.integer(exponent);
    }
    return power + exponent >= 0;
}

} // namespace

const char* parse_number_exactly(const char* p, const char* end, double& value) {
    const bool plus = p < end && *p == '+'; // which from_chars does not take
    if (plus && p + 1 < end && p[1] == '-') return p;
    const auto [last, error] = number_from_chars(p + (plus ? 1 : 0), end, value);
    if (error == std::errc::invalid_argument) return p;
    if (error == std::errc::result_out_of_range) {
        const std::string_view number(p, static_cast<std::size_t>(last - p));
        value = is_above_one(number) ? std::numeric_limits<double>::infinity() : 0.0;
        if (*p == '-') value = -value;
    }
    return last;
}

std::string in_quotes(std::string_view text, std::size_t longest) {
    std::string quote = "'";
    std::size_t at = 0;
    while (at < text.size()) {
        const std::size_t length = utf8_length(text, at);
        const std::string_view character = text.substr(at, std::max<std::size_t>(1, length));
        if (at + character.size() > longest) break;
        const bool is_control = length == 1   ? character[0] < ' ' || character[0] == '\x7f'
                                : length == 2 ? character[0] == '\xc2' && character[1] < '\xa0' // C1
                                              : false;
        if (length == 0 || is_control)
            quote += '?';
        else
            quote += character;
        at += character.size();
    }
    return quote + (at < text.size() ? "...'" : "'");
}

} // namespace filigree
