#include "filigree/core/color.h"

#include <charconv>

namespace filigree {

std::optional<Vec3f> parse_color(std::string_view text) {
    if (text.size() != 7 || text[0] != '#') return std::nullopt;
    unsigned value = 0;
    const char *first = text.data() + 1, *last = text.data() + text.size();
    const auto [end, error] = std::from_chars(first, last, value, 16);
    if (error != std::errc() || end != last) return std::nullopt;
    return Vec3f(float(value >> 16), float(value >> 8 & 255), float(value & 255)) / 255.0f;
}

} // namespace filigree
