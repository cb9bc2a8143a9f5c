// Numbers as people read them, and the characters of a text.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace filigree {

/// 1234567 as "1,234,567".
std::string with_commas(std::uint64_t count);

/// ASCII letters in lower case; all others as they are, in every locale.
std::string lower_case(std::string_view text);

/// Bytes of the UTF-8 character that begins at `at`: 1 to 4; 0 where none does. at < text.size().
std::size_t utf8_length(std::string_view text, std::size_t at);

} // namespace filigree
