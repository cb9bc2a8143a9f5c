// Folders made for files to come.
#pragma once

#include <filesystem>
#include <system_error>
#include <vector>

namespace filigree {

/// A folder with its parents, made where they are not there.
class NewFolders {
public:
    explicit NewFolders(const std::filesystem::path& folder) {
        std::error_code ignored;
        for (std::filesystem::path missing = folder;
             !missing.empty() && !std::filesystem::exists(std::filesystem::symlink_status(missing, ignored));
             missing = missing.parent_path()) {
            if (missing.has_filename()) made_.push_back(missing);
            if (missing == missing.parent_path()) break;
        }
        std::filesystem::create_directories(folder, failed_);
        if (failed_) remove();
    }
    bool are_there() const { return !failed_; }
    /// Takes those away again that were made here and are empty.
    void remove() const {
        std::error_code ignored;
        for (const std::filesystem::path& folder : made_) std::filesystem::remove(folder, ignored);
    }

private:
    std::vector<std::filesystem::path> made_; ///< innermost first
    std::error_code failed_;
};

} // namespace filigree
