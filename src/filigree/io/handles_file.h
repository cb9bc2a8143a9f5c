// Handles in a JSON file (docs/handles.md).
#pragma once

#include "filigree/pose.h"

#include <filesystem>
#include <vector>

namespace filigree {

/// The handles of a file, one or more. Errors: not_found, bad_file (no JSON, or not of this form; with the place),
/// usage (a word that is none, a handle with no selection or two, a vertex id that is none, no handles).
Result<std::vector<HandleRegion>> read_handles(const std::filesystem::path& path);

} // namespace filigree
