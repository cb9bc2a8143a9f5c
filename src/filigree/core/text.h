// Numbers as people read them.
#pragma once

#include <cstdint>
#include <string>

namespace filigree {

/// 1234567 as "1,234,567".
std::string with_commas(std::uint64_t count);

} // namespace filigree
