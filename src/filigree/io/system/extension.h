// File names' extensions, the same for every case of letters.
#pragma once

#include "filigree/core/text.h"

#include <filesystem>
#include <string>

namespace filigree {

/// ".ply" of "a/Cow.PLY"; empty where the name has no extension.
inline std::string lower_extension(const std::filesystem::path& path) { return lower_case(path.extension().string()); }

} // namespace filigree
