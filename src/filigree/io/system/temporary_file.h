// Temporary files beside the files they will become.
#pragma once

#include <filesystem>
#include <string_view>

namespace filigree {

inline constexpr std::string_view kTemporarySuffix = ".tmp";

/// A name in `folder` that no other process or thread makes: ".filigree-" and 16 random hexadecimal digits, before
/// `suffix`. Numbers of processes would not do: in containers they are often the same.
std::filesystem::path temporary_path(const std::filesystem::path& folder, std::string_view suffix = kTemporarySuffix);

/// A new file beside `target`, for writing, and its name. The name is one that belongs to `target` unless another
/// process has taken it; what a killed process left under that one is removed first. Until the descriptor is closed the
/// file is locked, where its file system has locks, which says that it has an owner. -1 with errno where it cannot be
/// made.
int create_beside(const std::filesystem::path& target, std::filesystem::path& name);
/// Gives such a name to a file that has none. 0 or the error number.
int name_beside(const std::filesystem::path& target, int descriptor, std::filesystem::path& name);

/// Where writing to `path` ends up: symbolic links followed, also one that points to nothing yet. Still a link where
/// links go round in a circle.
std::filesystem::path follow_links(std::filesystem::path path);

} // namespace filigree
