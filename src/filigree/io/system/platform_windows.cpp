// Windows: the C library's descriptors over handles that others may share, rename and remove while they are open.
#if defined(_WIN32)

#include "filigree/io/system/platform.h"
#include "filigree/io/system/windows_calls.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <functional>

#include <bcrypt.h>
#include <fcntl.h>
#include <io.h>
#include <process.h>
#include <shellapi.h>

namespace filigree::platform {

namespace {

constexpr DWORD kShared = FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE;

/// What the C library would say.
int error_number(DWORD error) {
    switch (error) {
    case ERROR_FILE_NOT_FOUND:
    case ERROR_PATH_NOT_FOUND:
    case ERROR_INVALID_DRIVE:
    case ERROR_BAD_NETPATH:
    case ERROR_INVALID_NAME:
        return ENOENT;
    case ERROR_ACCESS_DENIED:
    case ERROR_SHARING_VIOLATION:
    case ERROR_LOCK_VIOLATION:
    case ERROR_WRITE_PROTECT:
        return EACCES;
    case ERROR_FILE_EXISTS:
    case ERROR_ALREADY_EXISTS:
        return EEXIST;
    case ERROR_DISK_FULL:
    case ERROR_HANDLE_DISK_FULL:
        return ENOSPC;
    case ERROR_DIRECTORY:
        return ENOTDIR;
    case ERROR_DIR_NOT_EMPTY:
        return ENOTEMPTY;
    case ERROR_FILENAME_EXCED_RANGE:
        return ENAMETOOLONG;
    case ERROR_TOO_MANY_OPEN_FILES:
        return EMFILE;
    case ERROR_BROKEN_PIPE:
    case ERROR_NO_DATA:
        return EPIPE;
    case ERROR_NOT_ENOUGH_MEMORY:
    case ERROR_OUTOFMEMORY:
        return ENOMEM;
    default:
        return EIO;
    }
}
int failure(bool done) { return done ? 0 : error_number(::GetLastError()); }

/// For about a second: a file that another program has open for a moment cannot be replaced meanwhile.
int patiently(const std::function<bool()>& change) {
    int failed = failure(change());
    for (DWORD wait = 1; failed == EACCES && wait <= 512; wait *= 2) { // milliseconds
        ::Sleep(wait);
        failed = failure(change());
    }
    return failed;
}

int open(const Path& path, DWORD access, DWORD how, DWORD flags = 0) {
    const HANDLE handle =
        ::CreateFileW(path.c_str(), access, kShared, nullptr, how, FILE_ATTRIBUTE_NORMAL | flags, nullptr);
    if (handle == INVALID_HANDLE_VALUE) {
        errno = error_number(::GetLastError());
        return -1;
    }
    const int descriptor = ::_open_osfhandle(reinterpret_cast<std::intptr_t>(handle), _O_BINARY);
    if (descriptor < 0) ::CloseHandle(handle);
    return descriptor;
}
HANDLE handle_of(int descriptor) { return reinterpret_cast<HANDLE>(::_get_osfhandle(descriptor)); }

Status from(const BY_HANDLE_FILE_INFORMATION& of) {
    Status status;
    status.kind = (of.dwFileAttributes & FILE_ATTRIBUTE_REPARSE_POINT) != 0 ? Status::Kind::link
                  : (of.dwFileAttributes & FILE_ATTRIBUTE_DIRECTORY) != 0   ? Status::Kind::folder
                                                                            : Status::Kind::file;
    status.size = std::uint64_t{of.nFileSizeHigh} << 32 | of.nFileSizeLow;
    const std::uint64_t ticks = // of 100 ns
        std::uint64_t{of.ftLastWriteTime.dwHighDateTime} << 32 | of.ftLastWriteTime.dwLowDateTime;
    status.seconds = static_cast<std::int64_t>(ticks / 10'000'000);
    status.nanoseconds = static_cast<std::int64_t>(ticks % 10'000'000) * 100;
    status.permissions = (of.dwFileAttributes & FILE_ATTRIBUTE_READONLY) != 0 ? 0444 : 0666;
    status.names = of.nNumberOfLinks;
    status.device = of.dwVolumeSerialNumber;
    status.number = std::uint64_t{of.nFileIndexHigh} << 32 | of.nFileIndexLow;
    return status;
}

std::optional<Status> status_of(HANDLE handle) {
    BY_HANDLE_FILE_INFORMATION of{};
    if (::GetFileType(handle) != FILE_TYPE_DISK) return Status{}; // a pipe or the console
    if (::GetFileInformationByHandle(handle, &of) == 0) {
        errno = error_number(::GetLastError());
        return {};
    }
    return from(of);
}

/// flags: whether links are followed.
std::optional<Status> status_of(const Path& path, DWORD flags) {
    const HANDLE handle =
        ::CreateFileW(path.c_str(), 0, kShared, nullptr, OPEN_EXISTING, FILE_FLAG_BACKUP_SEMANTICS | flags, nullptr);
    if (handle == INVALID_HANDLE_VALUE) {
        errno = error_number(::GetLastError());
        return {};
    }
    const std::optional<Status> status = status_of(handle);
    ::CloseHandle(handle);
    return status;
}

OVERLAPPED at(std::uint64_t offset) {
    OVERLAPPED place{};
    place.Offset = static_cast<DWORD>(offset);
    place.OffsetHigh = static_cast<DWORD>(offset >> 32);
    return place;
}
constexpr std::size_t kMostAtOnce = std::size_t{1} << 30;

std::string utf8(const wchar_t* text) {
    const int size = ::WideCharToMultiByte(CP_UTF8, 0, text, -1, nullptr, 0, nullptr, nullptr);
    std::string bytes(static_cast<std::size_t>(std::max(size, 1)), '\0');
    ::WideCharToMultiByte(CP_UTF8, 0, text, -1, bytes.data(), size, nullptr, nullptr);
    bytes.pop_back(); // the zero
    return bytes;
}

} // namespace

Path::string_type native_name(std::string_view utf8) {
    if (utf8.empty()) return {};
    const int bytes = static_cast<int>(utf8.size());
    const int size = ::MultiByteToWideChar(CP_UTF8, 0, utf8.data(), bytes, nullptr, 0);
    Path::string_type name(static_cast<std::size_t>(size), L'\0'); // bytes that are no UTF-8: a mark of replacement
    ::MultiByteToWideChar(CP_UTF8, 0, utf8.data(), bytes, name.data(), size);
    return name;
}

std::optional<Status> status_of(const Path& path) { return status_of(path, 0); }
std::optional<Status> status_of(int descriptor) { return status_of(handle_of(descriptor)); }
std::optional<Status> status_of_name(const Path& path) { return status_of(path, FILE_FLAG_OPEN_REPARSE_POINT); }

int refused_writing(const Path& path) {
    const DWORD attributes = ::GetFileAttributesW(path.c_str());
    if (attributes == INVALID_FILE_ATTRIBUTES) return error_number(::GetLastError());
    return (attributes & FILE_ATTRIBUTE_READONLY) != 0 ? EACCES : 0;
}

int open_to_read(const Path& path) {
    const std::optional<Status> status = status_of(path);
    if (status && status->kind == Status::Kind::folder) return errno = EISDIR, -1;
    return open(path, GENERIC_READ, OPEN_EXISTING);
}
int open_to_write(const Path& path) { return open(path, GENERIC_WRITE, OPEN_EXISTING); }
int create_new(const Path& path, Readers) { return open(path, GENERIC_WRITE, CREATE_NEW); }
int open_lock_file(const Path& path, bool make) {
    return open(path, GENERIC_READ | GENERIC_WRITE, make ? CREATE_NEW : OPEN_EXISTING, FILE_FLAG_OPEN_REPARSE_POINT);
}
int open_unnamed(const Path&) { return errno = ENOTSUP, -1; }
int give_name(int, const Path&) { return ENOTSUP; }
int open_scratch(const Path& folder) {
    constexpr char kDigits[] = "0123456789abcdef";
    std::string name = ".filigree-";
    for (std::uint64_t bits = random_bits(), i = 0; i < 16; ++i, bits >>= 4) name += kDigits[bits & 15];
    return open(folder / native_name(name), GENERIC_READ | GENERIC_WRITE, CREATE_NEW, FILE_FLAG_DELETE_ON_CLOSE);
}
int duplicate(int descriptor) { return ::_dup(descriptor); }
bool close(int descriptor) { return ::_close(descriptor) == 0; }

std::int64_t read(int descriptor, std::span<char> to) {
    DWORD got = 0;
    const auto most = static_cast<DWORD>(std::min(to.size(), kMostAtOnce));
    if (::ReadFile(handle_of(descriptor), to.data(), most, &got, nullptr) != 0) return got;
    const DWORD error = ::GetLastError();
    if (error == ERROR_BROKEN_PIPE || error == ERROR_HANDLE_EOF) return 0;
    errno = error_number(error);
    return -1;
}
std::int64_t read_at(int descriptor, std::uint64_t offset, std::span<char> to) {
    OVERLAPPED place = at(offset);
    DWORD got = 0;
    const auto most = static_cast<DWORD>(std::min(to.size(), kMostAtOnce));
    if (::ReadFile(handle_of(descriptor), to.data(), most, &got, &place) != 0) return got;
    const DWORD error = ::GetLastError();
    if (error == ERROR_HANDLE_EOF) return 0;
    errno = error_number(error);
    return -1;
}
int write(int descriptor, std::string_view bytes) {
    while (!bytes.empty()) {
        DWORD written = 0;
        const auto most = static_cast<DWORD>(std::min(bytes.size(), kMostAtOnce));
        if (::WriteFile(handle_of(descriptor), bytes.data(), most, &written, nullptr) == 0)
            return error_number(::GetLastError());
        bytes.remove_prefix(written);
    }
    return 0;
}
/// Where write goes on is kept: a write at an offset moves it here.
int write_at(int descriptor, std::uint64_t offset, std::string_view bytes) {
    const HANDLE handle = handle_of(descriptor);
    LARGE_INTEGER before{};
    if (::SetFilePointerEx(handle, {}, &before, FILE_CURRENT) == 0) return ESPIPE;
    int failed = 0;
    while (!bytes.empty() && failed == 0) {
        OVERLAPPED place = at(offset);
        DWORD written = 0;
        const auto most = static_cast<DWORD>(std::min(bytes.size(), kMostAtOnce));
        failed = failure(::WriteFile(handle, bytes.data(), most, &written, &place) != 0);
        bytes.remove_prefix(written);
        offset += written;
    }
    ::SetFilePointerEx(handle, before, nullptr, FILE_BEGIN);
    return failed;
}
int reserve(int descriptor, std::uint64_t bytes) {
    FILE_ALLOCATION_INFO room{};
    room.AllocationSize.QuadPart = static_cast<LONGLONG>(bytes);
    if (::SetFileInformationByHandle(handle_of(descriptor), FileAllocationInfo, &room, sizeof room) != 0) return 0;
    const int failed = error_number(::GetLastError());
    return failed == ENOSPC ? failed : 0;
}
int set_size(int descriptor, std::uint64_t bytes) {
    FILE_END_OF_FILE_INFO end{};
    end.EndOfFile.QuadPart = static_cast<LONGLONG>(bytes);
    return failure(::SetFileInformationByHandle(handle_of(descriptor), FileEndOfFileInfo, &end, sizeof end) != 0);
}
int flush(int descriptor) { return failure(::FlushFileBuffers(handle_of(descriptor)) != 0); }
void flush_folder(const Path&) {} // the journal of NTFS keeps renames in order

Locked lock(int descriptor) {
    OVERLAPPED place = at(std::uint64_t{1} << 62); // locks keep others from reading; nobody reads there
    if (::LockFileEx(handle_of(descriptor), LOCKFILE_EXCLUSIVE_LOCK | LOCKFILE_FAIL_IMMEDIATELY, 0, 1, 0, &place) != 0)
        return Locked::yes;
    const DWORD error = ::GetLastError();
    return error == ERROR_LOCK_VIOLATION || error == ERROR_IO_PENDING ? Locked::by_another : Locked::not_possible;
}

int rename(const Path& from, const Path& to) {
    return patiently([&] { return ::MoveFileExW(from.c_str(), to.c_str(), MOVEFILE_REPLACE_EXISTING) != 0; });
}
int link(const Path& from, const Path& to) {
    return failure(::CreateHardLinkW(to.c_str(), from.c_str(), nullptr) != 0);
}
int remove_file(const Path& path) { return failure(::DeleteFileW(path.c_str()) != 0); }
int remove_empty_folder(const Path& path) { return failure(::RemoveDirectoryW(path.c_str()) != 0); }
int make_folder(const Path& path) { return failure(::CreateDirectoryW(path.c_str(), nullptr) != 0); }
int set_permissions(int, unsigned) { return 0; } // a file that may be replaced is not read-only
int set_permissions(const Path&, unsigned) { return 0; }

std::uint64_t random_bits() {
    std::uint64_t bits = 0;
    const auto into = reinterpret_cast<PUCHAR>(&bits);
    if (::BCryptGenRandom(nullptr, into, sizeof bits, BCRYPT_USE_SYSTEM_PREFERRED_RNG) == 0) return bits;
    LARGE_INTEGER ticks{};
    ::QueryPerformanceCounter(&ticks);
    return static_cast<std::uint64_t>(ticks.QuadPart) * 0x9E3779B97F4A7C15u ^ ::GetCurrentProcessId();
}

std::uint64_t memory() {
    MEMORYSTATUSEX status{};
    status.dwLength = sizeof status;
    return ::GlobalMemoryStatusEx(&status) != 0 ? status.ullTotalPhys : UINT64_MAX;
}

std::vector<std::string> arguments(int argc, char** argv) {
    for (const int descriptor : {kStandardInput, kStandardOutput}) ::_setmode(descriptor, _O_BINARY);
    ::SetConsoleOutputCP(CP_UTF8);
    int count = 0;
    wchar_t** const words = ::CommandLineToArgvW(::GetCommandLineW(), &count);
    if (!words) return {argv, argv + argc};
    std::vector<std::string> all;
    for (int i = 0; i < count; ++i) all.push_back(utf8(words[i]));
    ::LocalFree(words);
    return all;
}

bool is_terminal(int descriptor) { return ::_isatty(descriptor) != 0; }

Path own_program() {
    std::wstring name(32768, L'\0');
    name.resize(::GetModuleFileNameW(nullptr, name.data(), static_cast<DWORD>(name.size())));
    return name;
}

void end_process(int exit_code) { ::_exit(exit_code); }
void keep_freed_memory() {}

} // namespace filigree::platform

#endif
