// A file for readers that take a path.
#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>

#include <unistd.h>

namespace filigree_fuzz {

/// Removed with the object. One at a time for each extension.
class TemporaryFile {
public:
    explicit TemporaryFile(std::string_view extension)
        : path_(std::filesystem::temp_directory_path() /
                ("fuzz-" + std::to_string(::getpid()) + std::string(extension))) {}
    ~TemporaryFile() {
        std::error_code ignored;
        std::filesystem::remove(path_, ignored);
    }
    TemporaryFile(const TemporaryFile&) = delete;
    TemporaryFile& operator=(const TemporaryFile&) = delete;

    const std::filesystem::path& path() const { return path_; }
    void write(std::string_view bytes) const { std::ofstream(path_, std::ios::binary) << bytes; }
    std::string bytes() const {
        std::ifstream file(path_, std::ios::binary);
        return {std::istreambuf_iterator<char>(file), {}};
    }

private:
    std::filesystem::path path_;
};

} // namespace filigree_fuzz
