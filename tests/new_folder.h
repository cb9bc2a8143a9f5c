// A folder of a test's own, on every system.
#pragma once

#include <filesystem>
#include <string>

#include <unistd.h>

namespace filigree {

/// New and empty; whoever asks removes it.
inline std::filesystem::path new_folder() {
    static int number = 0;
    std::filesystem::path folder;
    do
        folder = std::filesystem::temp_directory_path() /
                 ("filigree-test-" + std::to_string(::getpid()) + "-" + std::to_string(number++));
    while (!std::filesystem::create_directory(folder));
    return folder;
}

} // namespace filigree
