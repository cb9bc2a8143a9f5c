#include "filigree/io/system/temporary_file.h"

#include "filigree/core/hash.h"
#include "filigree/file.h"
#include "filigree/io/system/file_descriptor.h"
#include "filigree/io/system/platform.h"

#include <cerrno>
#include <functional>
#include <string>
#include <system_error>

namespace filigree {

namespace {

namespace fs = std::filesystem;

fs::path path_of_bits(const fs::path& folder, std::uint64_t bits, std::string_view suffix) {
    constexpr char kDigits[] = "0123456789abcdef";
    std::string name = ".filigree-";
    for (int i = 0; i < 16; ++i, bits >>= 4) name += kDigits[bits & 15];
    return folder / path_of(name.append(suffix));
}

/// Removes a file of this user's that nobody has locked. While the lock is ours nobody else takes the name away.
void remove_if_left(const fs::path& file) {
    const FileDescriptor left(platform::open_lock_file(file, false));
    if (!left.is_open() || platform::lock(left.get()) != platform::Locked::yes) return;
    const std::optional<platform::Status> here = platform::status_of(left.get()),
                                          named = platform::status_of_name(file);
    if (here && named && here->kind == platform::Status::Kind::file && here->is_own && here->device == named->device &&
        here->number == named->number)
        platform::remove_file(file);
}

/// make: 0, or the error number; EEXIST where another name is to be tried.
int make_beside(const fs::path& target, const std::function<int(const fs::path&)>& make, fs::path& name) {
    const fs::path folder = target.parent_path();
    name = path_of_bits(folder, std::hash<std::string>()(target.filename().string()), kTemporarySuffix);
    remove_if_left(name);
    const int failed = make(name);
    if (failed != EEXIST) return failed;
    name = temporary_path(folder);
    return make(name);
}

} // namespace

fs::path temporary_path(const fs::path& folder, std::string_view suffix) {
    return path_of_bits(folder, platform::random_bits(), suffix);
}

int create_beside(const fs::path& target, fs::path& name) {
    int descriptor = -1;
    const int failed = make_beside(
        target,
        [&](const fs::path& file) {
            descriptor = platform::create_new(file);
            if (descriptor < 0) return errno;
            platform::lock(descriptor);
            const std::optional<platform::Status> status = platform::status_of(descriptor);
            if (!status || status->names > 0) return 0;
            platform::close(descriptor); // removed before it was locked
            return EEXIST;
        },
        name);
    return failed ? (errno = failed, -1) : descriptor;
}

int name_beside(const fs::path& target, int descriptor, fs::path& name) {
    platform::lock(descriptor);
    return make_beside(
        target, [&](const fs::path& file) { return platform::give_name(descriptor, file); }, name);
}

fs::path follow_links(fs::path path) {
    constexpr int kLongestChain = 40; // as the kernel's
    std::error_code failed;
    for (int links = 0; links < kLongestChain && fs::is_symlink(path, failed); ++links) {
        const fs::path target = fs::read_symlink(path, failed);
        if (failed) break;
        path = target.is_absolute() ? target : path.parent_path() / target;
    }
    return path;
}

} // namespace filigree
