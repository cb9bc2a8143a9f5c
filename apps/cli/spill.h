// Meshes larger than memory: what does not fit lies in a file, which the system writes out when memory is short.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace filigree::cli {

/// The memory that this program may take: three quarters of what is free, in bytes.
std::uint64_t memory_to_use();

/// Bytes of "8G", "500M" or "1073741824" (K, M, G, T: powers of 1024, "GiB" too); 0: not a size.
std::uint64_t parse_memory_size(const std::string& text);

/// From here on arrays of 4 MiB and more that would make all of them larger than `limit` bytes lie in an unnamed file
/// in `folder`. It goes with the program, however that ends. A full disk is std::bad_alloc; where no such file can be
/// made and mapped, they stay in memory.
void spill_beyond(std::uint64_t limit, const std::filesystem::path& folder);

/// Whether that file can be made; from here on there is one.
bool can_spill();

/// The most bytes that lay in the file at one time.
std::uint64_t most_spilled();

} // namespace filigree::cli
