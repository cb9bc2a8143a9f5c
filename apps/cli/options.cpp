#include "options.h"

#include "session.h"

#include <filesystem>

namespace filigree::cli {

namespace {

std::vector<std::string> paths_of(const Option& option) {
    if (const auto* path = std::get_if<std::string*>(&option.target)) return {**path};
    if (const auto* paths = std::get_if<std::vector<std::string>*>(&option.target)) return **paths;
    return {};
}

/// Whether both are names of one file; a terminal or a pipe may be read and written.
bool is_one_regular_file(const std::filesystem::path& a, const std::filesystem::path& b) {
    std::error_code failed;
    return std::filesystem::is_regular_file(a, failed) && std::filesystem::equivalent(a, b, failed) && !failed;
}

} // namespace

void refuse_to_overwrite_inputs(const OptionList& options) {
    for (const Option& output : options) {
        if (output.file != Option::File::written) continue;
        const std::string name = output.name.substr(0, output.name.find(','));
        for (const Option& input : options)
            for (const std::string& read : paths_of(input))
                for (const std::string& written : paths_of(output))
                    if (input.file == Option::File::read && is_one_regular_file(path_of(read), path_of(written)))
                        refuse(written +
                               ": is the input and would be overwritten; choose "
                               "another place with " +
                               name + ".");
    }
}

} // namespace filigree::cli
