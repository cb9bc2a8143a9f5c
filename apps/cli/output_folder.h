// A folder that a command writes several files into.
#pragma once

#include "session.h"

#include <filesystem>
#include <string>
#include <vector>

namespace filigree::cli {

/// Made with its parents where it is not there. Unless it is kept, files that were not there before go again, and the
/// folder where it is new.
class OutputFolder {
public:
    /// input: a file that must not be written over; empty: none.
    explicit OutputFolder(std::filesystem::path path, std::filesystem::path input = {})
        : path_(std::move(path)), input_(std::move(input)) {
        std::error_code failed;
        is_new_ = std::filesystem::create_directories(path_, failed);
        if (failed)
            throw Failure{
                {ErrorCode::unwritable, path_.string() + ": the folder cannot be made; choose another with -o."}};
    }
    ~OutputFolder() {
        std::error_code ignored;
        if (is_kept_) return;
        for (const std::filesystem::path& file : new_files_) std::filesystem::remove(file, ignored);
        if (is_new_) std::filesystem::remove(path_, ignored);
    }
    OutputFolder(const OutputFolder&) = delete;
    OutputFolder& operator=(const OutputFolder&) = delete;

    /// Where to write; to be asked for all files before the work, for it refuses the input's own place.
    std::string file(const std::string& name) {
        const std::filesystem::path file = path_ / name;
        std::error_code failed;
        if (!input_.empty() && std::filesystem::equivalent(file, input_, failed) && !failed)
            throw Failure{{ErrorCode::usage, file.string() + ": is the input and would be overwritten; choose another "
                                                             "folder with -o."}};
        if (!std::filesystem::exists(file, failed)) new_files_.push_back(file);
        return file.string();
    }
    void keep() { is_kept_ = true; }

private:
    std::filesystem::path path_, input_;
    std::vector<std::filesystem::path> new_files_;
    bool is_new_ = false, is_kept_ = false;
};

} // namespace filigree::cli
