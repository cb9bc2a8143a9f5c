#if !defined(_WIN32)

#include "filigree/io/system/platform.h"

#include <cerrno>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <random>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#if defined(__linux__)
#include <malloc.h>
#include <sys/random.h>
#endif
#if defined(__APPLE__)
#include <mach-o/dyld.h>
#endif

namespace filigree::platform {

namespace {

/// Again, as long as a signal came between.
template <class Call>
auto uninterrupted(const Call& call) {
    for (;;)
        if (const auto result = call(); result >= 0 || errno != EINTR) return result;
}

Status from(const struct stat& of) {
    Status status;
    status.kind = S_ISREG(of.st_mode)   ? Status::Kind::file
                  : S_ISDIR(of.st_mode) ? Status::Kind::folder
                  : S_ISLNK(of.st_mode) ? Status::Kind::link
                                        : Status::Kind::other;
    status.size = static_cast<std::uint64_t>(of.st_size);
#if defined(__APPLE__)
    const timespec& changed = of.st_mtimespec;
#else
    const timespec& changed = of.st_mtim;
#endif
    status.seconds = changed.tv_sec;
    status.nanoseconds = changed.tv_nsec;
    status.permissions = of.st_mode & 07777;
    status.names = of.st_nlink;
    status.is_own = of.st_uid == ::geteuid();
    status.device = static_cast<std::uint64_t>(of.st_dev);
    status.number = of.st_ino;
    return status;
}

/// 0 or the error number.
int failure(int result) { return result == 0 ? 0 : errno; }

const char* folder_name(const Path& folder) { return folder.empty() ? "." : folder.c_str(); }

} // namespace

Path::string_type native_name(std::string_view utf8) { return Path::string_type(utf8); }

std::optional<Status> status_of(const Path& path) {
    struct stat status {};
    if (::stat(path.c_str(), &status) != 0) return {};
    return from(status);
}
std::optional<Status> status_of(int descriptor) {
    struct stat status {};
    if (::fstat(descriptor, &status) != 0) return {};
    return from(status);
}
std::optional<Status> status_of_name(const Path& path) {
    struct stat status {};
    if (::lstat(path.c_str(), &status) != 0) return {};
    return from(status);
}
int refused_writing(const Path& path) { return failure(::access(path.c_str(), W_OK)); }

int open_to_read(const Path& path) { return ::open(path.c_str(), O_RDONLY | O_CLOEXEC); }
int open_to_write(const Path& path) { return ::open(path.c_str(), O_WRONLY | O_CLOEXEC); }
int create_new(const Path& path, Readers readers) {
    return ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, readers == Readers::all ? 0666 : 0600);
}
int open_lock_file(const Path& path, bool make) {
    return ::open(path.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK | (make ? O_CREAT | O_EXCL : 0), 0600);
}

int open_unnamed([[maybe_unused]] const Path& folder) {
#if defined(__linux__)
    const int descriptor = ::open(folder_name(folder), O_WRONLY | O_TMPFILE | O_CLOEXEC, 0666);
    if (descriptor < 0 || ::access(("/proc/self/fd/" + std::to_string(descriptor)).c_str(), F_OK) == 0)
        return descriptor;
    ::close(descriptor);
#endif
    return -1;
}
int give_name(int descriptor, const Path& path) {
    const std::string unnamed = "/proc/self/fd/" + std::to_string(descriptor);
    return failure(::linkat(AT_FDCWD, unnamed.c_str(), AT_FDCWD, path.c_str(), AT_SYMLINK_FOLLOW));
}
int open_scratch(const Path& folder) {
    std::string name = (folder / ".filigree-XXXXXX").string();
    const int descriptor = ::mkstemp(name.data());
    if (descriptor < 0) return -1;
    ::unlink(name.c_str());
    ::fcntl(descriptor, F_SETFD, FD_CLOEXEC);
    return descriptor;
}
int duplicate(int descriptor) { return ::fcntl(descriptor, F_DUPFD_CLOEXEC, 0); }
bool close(int descriptor) { return ::close(descriptor) == 0; }

std::int64_t read(int descriptor, std::span<char> to) {
    return uninterrupted([&] { return ::read(descriptor, to.data(), to.size()); });
}
std::int64_t read_at(int descriptor, std::uint64_t offset, std::span<char> to) {
    return uninterrupted([&] { return ::pread(descriptor, to.data(), to.size(), static_cast<off_t>(offset)); });
}
int write(int descriptor, std::string_view bytes) {
    while (!bytes.empty()) {
        const ssize_t written = uninterrupted([&] { return ::write(descriptor, bytes.data(), bytes.size()); });
        if (written < 0) return errno;
        bytes.remove_prefix(static_cast<std::size_t>(written));
    }
    return 0;
}
int write_at(int descriptor, std::uint64_t offset, std::string_view bytes) {
    while (!bytes.empty()) {
        const ssize_t written =
            uninterrupted([&] { return ::pwrite(descriptor, bytes.data(), bytes.size(), static_cast<off_t>(offset)); });
        if (written < 0) return errno;
        bytes.remove_prefix(static_cast<std::size_t>(written));
        offset += static_cast<std::uint64_t>(written);
    }
    return 0;
}
int reserve([[maybe_unused]] int descriptor, [[maybe_unused]] std::uint64_t bytes) {
#if defined(__linux__)
    const bool has_room = ::fallocate(descriptor, 0, 0, static_cast<off_t>(bytes)) == 0;
    if (!has_room && (errno == ENOSPC || errno == EFBIG || errno == EDQUOT)) return errno;
#endif
    return 0;
}
int set_size(int descriptor, std::uint64_t bytes) {
    return failure(::ftruncate(descriptor, static_cast<off_t>(bytes)));
}
int flush(int descriptor) { return failure(::fsync(descriptor)); }
void flush_folder(const Path& folder) {
    const int descriptor = ::open(folder_name(folder), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (descriptor < 0) return;
    ::fsync(descriptor);
    ::close(descriptor);
}

Locked lock(int descriptor) {
    if (::flock(descriptor, LOCK_EX | LOCK_NB) == 0) return Locked::yes;
    return errno == EWOULDBLOCK ? Locked::by_another : Locked::not_possible;
}

int rename(const Path& from, const Path& to) { return failure(::rename(from.c_str(), to.c_str())); }
int link(const Path& from, const Path& to) { return failure(::link(from.c_str(), to.c_str())); }
int remove_file(const Path& path) { return failure(::unlink(path.c_str())); }
int remove_empty_folder(const Path& path) { return failure(::rmdir(path.c_str())); }
int make_folder(const Path& path) { return failure(::mkdir(path.c_str(), 0777)); }
int set_permissions(int descriptor, unsigned permissions) {
    return failure(::fchmod(descriptor, static_cast<mode_t>(permissions)));
}
int set_permissions(const Path& path, unsigned permissions) {
    return failure(::chmod(path.c_str(), static_cast<mode_t>(permissions)));
}

std::uint64_t random_bits() {
#if defined(__linux__)
    std::uint64_t bits = 0;
    if (::getrandom(&bits, sizeof bits, 0) == ssize_t{sizeof bits}) return bits;
    // Kernels before 3.17. Not std::random_device, for which libstdc++ asks glibc 2.36: wheels run with older ones.
    return std::uint64_t(std::chrono::steady_clock::now().time_since_epoch().count()) << 20 ^ std::uint64_t(::getpid());
#else
    std::random_device device;
    return std::uint64_t{device()} << 32 | device();
#endif
}

std::uint64_t memory() {
    const long pages = ::sysconf(_SC_PHYS_PAGES), page = ::sysconf(_SC_PAGESIZE);
    std::uint64_t memory = pages > 0 && page > 0 ? std::uint64_t(pages) * std::uint64_t(page) : UINT64_MAX;
    std::ifstream limit("/sys/fs/cgroup/memory.max"); // "max" where there is none
    if (std::uint64_t bytes = 0; limit >> bytes) memory = std::min(memory, bytes);
    return memory;
}

std::vector<std::string> arguments(int argc, char** argv) { return {argv, argv + argc}; }
bool is_terminal(int descriptor) { return ::isatty(descriptor) == 1; }

Path own_program() {
#if defined(__APPLE__)
    char name[4096];
    std::uint32_t size = sizeof name;
    if (::_NSGetExecutablePath(name, &size) == 0) return name;
    return {};
#else
    std::error_code failed;
    return std::filesystem::read_symlink("/proc/self/exe", failed);
#endif
}

void end_process(int exit_code) { ::_exit(exit_code); }

void keep_freed_memory() {
#if defined(__GLIBC__)
    ::mallopt(M_MMAP_THRESHOLD, 32 << 20);
    ::mallopt(M_TRIM_THRESHOLD, 256 << 20);
#endif
}

} // namespace filigree::platform

#endif
