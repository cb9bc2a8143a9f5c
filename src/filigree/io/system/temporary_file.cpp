#include "filigree/io/system/temporary_file.h"

#include <cerrno>
#include <functional>
#include <random>
#include <string>
#include <system_error>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

namespace filigree {

namespace {

namespace fs = std::filesystem;

std::uint64_t random_bits() {
    std::uint64_t bits = 0;
    if (::getrandom(&bits, sizeof bits, 0) == ssize_t{sizeof bits}) return bits;
    std::random_device device; // on kernels without the call
    return std::uint64_t{device()} << 32 | device();
}

fs::path path_of_bits(const fs::path& folder, std::uint64_t bits, std::string_view suffix) {
    constexpr char kDigits[] = "0123456789abcdef";
    std::string name = ".filigree-";
    for (int i = 0; i < 16; ++i, bits >>= 4) name += kDigits[bits & 15];
    return folder / name.append(suffix);
}

/// Removes a file of this user's that nobody has locked. While the lock is ours nobody else takes the name away.
void remove_if_left(const fs::path& file) {
    const int descriptor = ::open(file.c_str(), O_WRONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (descriptor < 0) return;
    struct stat here {};
    struct stat named {};
    if (::flock(descriptor, LOCK_EX | LOCK_NB) == 0 && ::fstat(descriptor, &here) == 0 && S_ISREG(here.st_mode) &&
        here.st_uid == ::geteuid() && ::lstat(file.c_str(), &named) == 0 && here.st_dev == named.st_dev &&
        here.st_ino == named.st_ino)
        ::unlink(file.c_str());
    ::close(descriptor);
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
    return path_of_bits(folder, random_bits(), suffix);
}

int create_beside(const fs::path& target, fs::path& name) {
    int descriptor = -1;
    const int failed = make_beside(
        target,
        [&](const fs::path& file) {
            descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
            if (descriptor < 0) return errno;
            struct stat status {};
            ::flock(descriptor, LOCK_EX | LOCK_NB);
            if (::fstat(descriptor, &status) != 0 || status.st_nlink > 0) return 0;
            ::close(descriptor); // removed before it was locked
            return EEXIST;
        },
        name);
    return failed ? (errno = failed, -1) : descriptor;
}

int name_beside(const fs::path& target, int descriptor, fs::path& name) {
    ::flock(descriptor, LOCK_EX | LOCK_NB);
    const std::string unnamed = "/proc/self/fd/" + std::to_string(descriptor);
    const auto link = [&](const fs::path& file) {
        return ::linkat(AT_FDCWD, unnamed.c_str(), AT_FDCWD, file.c_str(), AT_SYMLINK_FOLLOW) == 0 ? 0 : errno;
    };
    return make_beside(target, link, name);
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

void sync_folder(const fs::path& folder) {
    const int descriptor = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (descriptor < 0) return;
    ::fsync(descriptor); // best effort: some file systems cannot
    ::close(descriptor);
}

} // namespace filigree
