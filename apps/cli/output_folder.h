// A folder that a command writes several files into.
#pragma once

#include "session.h"

#include "filigree/io/system/file_batch.h"
#include "filigree/io/system/new_folders.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace filigree::cli {

/// Made with its parents where it is not there. Its files are made aside and come into it together, when it is kept;
/// until then it is as it was, and a new one goes again.
class OutputFolder {
public:
    /// input: a file that must not be written over; empty: none.
    explicit OutputFolder(std::filesystem::path path, const std::filesystem::path& input = {})
        : path_(std::move(path)), inputs_{input}, folders_(path_) {
        if (!folders_.are_there())
            refuse(ErrorCode::unwritable, path_.string() + ": the folder cannot be made; choose another with -o.");
        files_.emplace(require(FileBatch::create(path_)));
        show_folder_as(files_->path("").string(), (path_ / "").string());
    }
    ~OutputFolder() {
        files_.reset();
        if (!is_kept_) folders_.remove();
    }
    OutputFolder(const OutputFolder&) = delete;
    OutputFolder& operator=(const OutputFolder&) = delete;

    /// More files that must not be written over.
    void protect(const std::vector<std::filesystem::path>& inputs) {
        inputs_.insert(inputs_.end(), inputs.begin(), inputs.end());
    }
    /// Where to write; to be asked for all files before the work, for it refuses the places of inputs.
    std::string file(const std::string& name) {
        const std::filesystem::path file = path_ / path_of(name);
        std::error_code failed;
        const auto is_one = [&](const std::filesystem::path& input) {
            return !input.empty() && std::filesystem::equivalent(file, input, failed) && !failed;
        };
        if (std::any_of(inputs_.begin(), inputs_.end(), is_one))
            refuse(file.string() + ": is the input and would be overwritten; choose another "
                                   "folder with -o.");
        require(files_->check_place(name));
        return files_->path(name).string();
    }
    void keep() {
        require(files_->finish());
        is_kept_ = true;
    }

private:
    std::filesystem::path path_;
    std::vector<std::filesystem::path> inputs_;
    NewFolders folders_;
    std::optional<FileBatch> files_;
    bool is_kept_ = false;
};

} // namespace filigree::cli
