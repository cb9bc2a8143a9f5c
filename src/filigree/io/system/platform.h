// What files and programs ask of the operating system: files, locks, folders, random bytes, memory, the console. POSIX
// calls their equals in platform_posix.cpp; platform_windows.cpp has the same for Windows.
//
// Descriptors are those of the C library. What fails returns -1 or an error number of <cerrno>, on Windows too.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace filigree::platform {

using Path = std::filesystem::path;

inline constexpr int kStandardInput = 0, kStandardOutput = 1, kStandardError = 2;

/// A name in UTF-8 in the characters of the system's own calls.
Path::string_type native_name(std::string_view utf8);

/// What a name or an open file is.
struct Status {
    enum class Kind { file, folder, link, other } kind = Kind::other; ///< other: a pipe or a device
    std::uint64_t size = 0;                                           ///< bytes
    std::int64_t seconds = 0, nanoseconds = 0;                        ///< last change of the content
    unsigned permissions = 0;
    std::uint64_t names = 1;              ///< hard links; 0: removed
    bool is_own = true;                   ///< of the user that runs this process
    std::uint64_t device = 0, number = 0; ///< equal for two names of one file
};
/// Of what a symbolic link leads to. Nothing, with errno, where there is none.
std::optional<Status> status_of(const Path& path);
std::optional<Status> status_of(int descriptor);
/// Of the link itself.
std::optional<Status> status_of_name(const Path& path);
/// 0 or the error number why the file may not be changed.
int refused_writing(const Path& path);

// Opening: a descriptor that child processes do not get, or -1 with errno.
int open_to_read(const Path& path);
/// In place: a device, a pipe, a file that is there.
int open_to_write(const Path& path);
enum class Readers { all, own_user };
/// EEXIST where the name is taken.
int create_new(const Path& path, Readers readers = Readers::all);
/// A lock file; with `make`, a new one (EEXIST as above). Symbolic links are not followed.
int open_lock_file(const Path& path, bool make);
/// A file without a name in a folder, which goes with its last descriptor, also when the process is killed. -1 where
/// the system or the file system has none, or could not name it later.
int open_unnamed(const Path& folder);
/// Gives such a file its name. 0 or the error number.
int give_name(int descriptor, const Path& path);
/// Gone with its last descriptor; for reading and writing.
int open_scratch(const Path& folder);
/// A second descriptor of the same open file.
int duplicate(int descriptor);
/// False with errno: what was written may be lost.
bool close(int descriptor);

// Content. Interrupted calls are made again.
/// Bytes read, 0 at the end, -1 with errno.
std::int64_t read(int descriptor, std::span<char> to);
std::int64_t read_at(int descriptor, std::uint64_t offset, std::span<char> to);
/// All of it: 0 or the error number.
int write(int descriptor, std::string_view bytes);
int write_at(int descriptor, std::uint64_t offset, std::string_view bytes);
/// 0 or the error number: there is no room. 0 also where the file system cannot reserve.
int reserve(int descriptor, std::uint64_t bytes);
int set_size(int descriptor, std::uint64_t bytes);
/// On the disk. 0 or the error number.
int flush(int descriptor);
/// What was renamed in a folder outlasts a power cut, where the file system can do that.
void flush_folder(const Path& folder);

enum class Locked { yes, by_another, not_possible };
/// Tries to lock a whole file until its last descriptor is closed.
Locked lock(int descriptor);

// Names. 0 or the error number.
/// Replaces a file that has the name `to`.
int rename(const Path& from, const Path& to);
/// A second name; EEXIST where `to` is taken.
int link(const Path& from, const Path& to);
int remove_file(const Path& path);
int remove_empty_folder(const Path& path);
int make_folder(const Path& path);
int set_permissions(int descriptor, unsigned permissions);
int set_permissions(const Path& path, unsigned permissions);

std::uint64_t random_bits();
/// Bytes that there are for this process: the machine's, or fewer where its container has a limit.
std::uint64_t memory();

/// The arguments of the program as UTF-8. Standard input and output carry bytes from then on.
std::vector<std::string> arguments(int argc, char** argv);
/// Whether somebody watches standard error.
bool is_terminal(int descriptor);
/// The program that runs; empty where the system does not tell.
Path own_program();
/// Ends the process without destructors; safe in a signal handler.
[[noreturn]] void end_process(int exit_code);
/// Freed memory of some megabytes stays with the process.
void keep_freed_memory();

} // namespace filigree::platform
