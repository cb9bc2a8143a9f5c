// Colours as people write them.
#pragma once

#include "filigree/types.h"

#include <optional>
#include <string_view>

namespace filigree {

/// "#d04030", sRGB, as three numbers from 0 to 1; nothing for any other text.
std::optional<Vec3f> parse_color(std::string_view text);

} // namespace filigree
