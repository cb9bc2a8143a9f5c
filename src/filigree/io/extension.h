// File names' extensions, the same for every case of letters.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace filigree {

/// ASCII letters in lower case; all others as they are, in every locale.
inline std::string lower_case(std::string_view text) {
    std::string lower(text);
    for (char& c : lower)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return lower;
}

/// ".ply" of "a/Cow.PLY"; empty where the name has no extension.
inline std::string lower_extension(const std::filesystem::path& path) { return lower_case(path.extension().string()); }

} // namespace filigree
