#include "filigree/io/system/text_writer.h"

#include "filigree/core/math.h"
#include "filigree/core/numbers.h"

#include <algorithm>
#include <cmath>

namespace filigree {

TextWriter& TextWriter::name(std::string_view s) {
    std::string line(s);
    for (char& c : line)
        if (static_cast<unsigned char>(c) < ' ' || c == '\x7f') c = '_';
    if (line.ends_with('\\')) line.back() = '_';
    return text(line);
}

TextWriter& TextWriter::far_coordinate(double origin, float offset) {
    constexpr int kTries = 4; // the first number of decimals is a guess from below
    const double sum = origin + static_cast<double>(offset);
    char digits[kLongestNumber];
    const auto shortest = std::to_chars(digits, digits + sizeof digits, sum);
    const float last_bit = std::abs(offset) * 0x1p-23f;
    const bool is_tiny = offset != 0 && last_bit == 0; // no number of decimals is shorter then
    if (is_tiny) return text({digits, static_cast<std::size_t>(shortest.ptr - digits)});
    const int guess = offset == 0 ? 0 : static_cast<int>(-math::log10(last_bit)) - 1;
    const int first = std::max(0, guess);
    for (int precision = first; precision < first + kTries; ++precision) {
        char rounded[kLongestNumber];
        const auto fixed = std::to_chars(rounded, rounded + sizeof rounded, sum, std::chars_format::fixed, precision);
        if (fixed.ec != std::errc{} || fixed.ptr - rounded >= shortest.ptr - digits) break;
        double read_back = 0;
        number_from_chars(rounded, fixed.ptr, read_back);
        if (static_cast<float>(read_back - origin) == offset)
            return text({rounded, static_cast<std::size_t>(fixed.ptr - rounded)});
    }
    return text({digits, static_cast<std::size_t>(shortest.ptr - digits)});
}

} // namespace filigree
