// Temporary files beside the files they will become.
#pragma once

#include <filesystem>
#include <string_view>

namespace filigree {

/// A name in `folder` that no other process or thread makes: ".filigree-" and 16 random hexadecimal digits, before
/// `suffix`. Numbers of processes would not do: in containers they are often the same.
std::filesystem::path temporary_path(const std::filesystem::path& folder, std::string_view suffix = ".tmp");

/// Where writing to `path` ends up: symbolic links followed, also one that points to nothing yet. Still a link where
/// links go round in a circle.
std::filesystem::path follow_links(std::filesystem::path path);

/// Makes what was renamed in a folder outlast a power cut, where its file system can.
void sync_folder(const std::filesystem::path& folder);

} // namespace filigree
