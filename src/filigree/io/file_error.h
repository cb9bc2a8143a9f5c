// Sentences for what the system refuses to do with a file.
#pragma once

#include "filigree/result.h"

#include <filesystem>
#include <string>

namespace filigree {

/// What the system means by an error number (errno): "the disk is full; ...". The same in every locale.
std::string cause_of(int error_number);

/// "PATH: cannot be read: CAUSE.", not_found.
Error cannot_read(const std::filesystem::path& path, int error_number);
/// "PATH: cannot be written: CAUSE.", unwritable.
Error cannot_write(const std::filesystem::path& path, const std::string& cause);
inline Error cannot_write(const std::filesystem::path& path, int error_number) {
    return cannot_write(path, cause_of(error_number));
}

/// An error about `from`, a file that only we know, as one about the file that the user named.
Error renamed(Error error, const std::filesystem::path& from, const std::filesystem::path& to);

} // namespace filigree
