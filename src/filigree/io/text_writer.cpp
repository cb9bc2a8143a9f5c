#include "filigree/io/text_writer.h"

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
    const int first_guess = offset == 0 ? 0 : static_cast<int>(-std::log10(std::abs(offset) * 0x1p-23f)) - 1;
    char decimals[kLongestNumber];
    for (int precision = std::max(0, first_guess); precision < std::max(0, first_guess) + kTries; ++precision) {
        auto [last, error] =
            std::to_chars(decimals, decimals + sizeof decimals, sum, std::chars_format::fixed, precision);
        double read_back = 0;
        if (error != std::errc{}) break;
        std::from_chars(decimals, last, read_back);
        if (static_cast<float>(read_back - origin) != offset) continue;
        if (precision > 0) {
            while (last[-1] == '0') --last;
            if (last[-1] == '.') --last;
        }
        return text({decimals, static_cast<std::size_t>(last - decimals)});
    }
    return number(sum);
}

} // namespace filigree
