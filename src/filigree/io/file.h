// Whole files in and out: read at once, written beside the target and renamed.
#pragma once

#include "filigree/core/result.h"

#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace filigree {

/// The bytes of a file; "-" is standard input. Errors: not_found (missing, a directory, no permission), out_of_memory.
Result<std::string> read_file(const std::filesystem::path& path);

/// Replaces `path` by `pieces`, one after the other: written to a temporary file in the same folder, flushed, then
/// renamed. On any error, or when the process dies, `path` is as it was. "-" is standard output. Only a device or pipe
/// is written in place: it cannot be replaced, and keeps what it got before an error. Symbolic links are followed, and
/// the permissions of an existing file are kept. Errors: unwritable.
Status write_file(const std::filesystem::path& path, std::span<const std::string_view> pieces);

} // namespace filigree
