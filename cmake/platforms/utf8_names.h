// Included before every source that is compiled for Windows: a std::filesystem::path that takes a std::string there
// reads it in the C locale, so a name beyond ASCII becomes another. It does not compile here; filigree::path_of does it
// right. Tests have no other names and are compiled with FILIGREE_ASCII_NAMES.
#if defined(__cplusplus) && !defined(FILIGREE_ASCII_NAMES)
#include <filesystem>
#include <string>
#include <string_view>

template <>
std::filesystem::path::path<std::string, std::filesystem::path>(const std::string&, format) = delete;
template <>
std::filesystem::path::path<std::string_view, std::filesystem::path>(const std::string_view&, format) = delete;
#endif
