// Names of files that are numbered: "moved_####.ply", "frame_%04d.png".
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace filigree {

/// A file's name with a place for a number.
struct NumberedName {
    std::filesystem::path folder;
    std::string before, after; ///< around the number
    std::size_t digits = 4;    ///< at least; zeros fill them up

    /// The file of a number, in the folder.
    std::filesystem::path file(std::size_t number) const;
    /// The number in the name of a file (without its folder); none where it is not of this name. Any count of digits
    /// is taken.
    std::optional<std::uint64_t> number_of(const std::string& file) const;
};

/// The name that a path stands for: "####" (the last run of them; as many digits), else "%d", "%4d" or "%04d" (the
/// number is filled up with zeros in each case). None where the file's name has no such place. Folders may have '#' and
/// '%' in their names.
std::optional<NumberedName> numbered_name(const std::filesystem::path& path);

/// The same for "%d" and "%01d" to "%09d" alone, where no other '%' stands in the file's name: as films' pictures are
/// numbered, whose names may hold a '#'.
std::optional<NumberedName> printf_numbered_name(const std::filesystem::path& path);

} // namespace filigree
