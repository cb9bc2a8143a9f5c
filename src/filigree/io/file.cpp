#include "filigree/io/file.h"
#include "filigree/core/large_memory.h"
#include "filigree/io/file_descriptor.h"
#include "filigree/io/file_error.h"
#include "filigree/io/temporary_file.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <new>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace filigree {

namespace {

namespace fs = std::filesystem;

/// What `read` gives, or that there is no room for it.
template <class Read>
Result<std::string> in_memory(const fs::path& path, const Read& read) {
    try {
        return read();
    } catch (const std::bad_alloc&) {
        return Error{ErrorCode::out_of_memory, path.string() + ": does not fit into memory."};
    } catch (const std::length_error&) {
        return Error{ErrorCode::out_of_memory, path.string() + ": does not fit into memory."};
    }
}

/// Bytes of memory that there are for this program: the machine's, or fewer where its container has a limit.
std::uint64_t memory_here() {
    const long pages = ::sysconf(_SC_PHYS_PAGES), page = ::sysconf(_SC_PAGESIZE);
    std::uint64_t memory = pages > 0 && page > 0 ? std::uint64_t(pages) * std::uint64_t(page) : UINT64_MAX;
    std::ifstream limit("/sys/fs/cgroup/memory.max"); // "max" where there is none
    if (std::uint64_t bytes = 0; limit >> bytes) memory = std::min(memory, bytes);
    return memory;
}

/// Refuses a file whose bytes cannot all be here, before any of them is read: where memory is promised freely, the
/// program would be killed in the midst of it.
Status check_room(const fs::path& path, std::uint64_t bytes) {
    constexpr double kGigabyte = 1e9;
    const std::uint64_t memory = memory_here();
    if (bytes <= memory) return Success{};
    char sizes[96];
    std::snprintf(sizes, sizeof sizes, "has %.3g GB, and there are %.3g GB of memory", double(bytes) / kGigabyte,
                  double(memory) / kGigabyte);
    return Error{ErrorCode::out_of_memory, path.string() + ": does not fit into memory: it " + sizes + "."};
}

Result<std::string> read_descriptor(int descriptor, const fs::path& path) {
    constexpr std::size_t kPipePiece = std::size_t{1} << 16;
    struct stat status {};
    if (::fstat(descriptor, &status) != 0) return cannot_read(path, errno);
    if (S_ISDIR(status.st_mode)) return cannot_read(path, EISDIR);
    // The size is a hint: pipes have none, and files grow and shrink. One byte more finds the end without another
    // round.
    if (S_ISREG(status.st_mode))
        if (Status fits = check_room(path, static_cast<std::uint64_t>(status.st_size)); !fits) return fits.error();
    std::string bytes;
    const std::size_t first_size = S_ISREG(status.st_mode) ? static_cast<std::size_t>(status.st_size) + 1 : kPipePiece;
    reserve_large(bytes, first_size);
    bytes.resize(first_size);
    for (std::size_t used = 0;;) {
        if (used == bytes.size()) {
            if (Status fits = check_room(path, used); !fits) return fits.error();
            bytes.resize(2 * bytes.size());
        }
        const ssize_t got = ::read(descriptor, bytes.data() + used, bytes.size() - used);
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) return cannot_read(path, errno);
        used += static_cast<std::size_t>(got);
        if (got == 0) {
            bytes.resize(used);
            return bytes;
        }
    }
}

Result<std::string> read_whole(int descriptor, const fs::path& path) {
    return in_memory(path, [&] { return read_descriptor(descriptor, path); });
}

/// 0 or the error number.
int write_piece(int descriptor, std::string_view piece) {
    while (!piece.empty()) {
        const ssize_t written = ::write(descriptor, piece.data(), piece.size());
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) return errno;
        piece.remove_prefix(static_cast<std::size_t>(written));
    }
    return 0;
}

/// A file without a name in a folder, which goes with its last descriptor, also when the process is killed; -1 where
/// the file system has none, or one could not be given a name later.
int open_unnamed(const fs::path& folder) {
    const int descriptor = ::open(folder.empty() ? "." : folder.c_str(), O_WRONLY | O_TMPFILE | O_CLOEXEC, 0666);
    if (descriptor < 0 || ::access(("/proc/self/fd/" + std::to_string(descriptor)).c_str(), F_OK) == 0)
        return descriptor;
    ::close(descriptor);
    return -1;
}

} // namespace

Result<std::string> read_file(const fs::path& path) {
    if (path == "-") return read_whole(STDIN_FILENO, "standard input");
    const FileDescriptor descriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
    if (!descriptor.is_open()) return cannot_read(path, errno);
    return read_whole(descriptor.get(), path);
}

struct FileReader::OpenFile {
    fs::path path;
    FileDescriptor descriptor; ///< of a file that can be read anywhere; else the bytes are all here
    std::string kept;
    std::string_view bytes;
    std::uint64_t size = 0;
};

FileReader::FileReader(std::unique_ptr<OpenFile> file) : file_(std::move(file)) {}
FileReader::FileReader(FileReader&&) noexcept = default;
FileReader& FileReader::operator=(FileReader&&) noexcept = default;
FileReader::~FileReader() = default;

FileReader::FileReader(std::string_view bytes) : FileReader(bytes, bytes.size()) {}

FileReader::FileReader(std::string_view beginning, std::uint64_t size) : file_(std::make_unique<OpenFile>()) {
    file_->bytes = beginning;
    file_->size = size;
}

Result<FileReader> FileReader::open(const fs::path& path) {
    auto file = std::make_unique<OpenFile>();
    file->path = path;
    struct stat status {};
    if (path != "-") {
        file->descriptor = FileDescriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
        if (!file->descriptor.is_open() || ::fstat(file->descriptor.get(), &status) != 0)
            return cannot_read(path, errno);
        file->size = static_cast<std::uint64_t>(status.st_size);
        if (S_ISREG(status.st_mode) && file->size > 0) return FileReader(std::move(file));
    }
    Result<std::string> bytes = read_whole(path == "-" ? STDIN_FILENO : file->descriptor.get(),
                                           path == "-" ? fs::path("standard input") : path);
    if (!bytes) return bytes.error();
    file->descriptor.close();
    file->kept = std::move(*bytes);
    file->bytes = file->kept;
    file->size = file->bytes.size();
    return FileReader(std::move(file));
}

std::uint64_t FileReader::size() const { return file_->size; }

Status FileReader::read(std::uint64_t offset, std::span<char> to) const {
    const OpenFile& file = *file_;
    const auto is_shorter = [&] {
        return Error{ErrorCode::not_found, file.path.string() + ": cannot be read: it became shorter meanwhile."};
    };
    const std::uint64_t size = file.descriptor.is_open() ? file.size : file.bytes.size();
    if (offset > size || to.size() > size - offset) return is_shorter();
    if (!file.descriptor.is_open()) {
        std::copy_n(file.bytes.data() + offset, to.size(), to.data());
        return Success{};
    }
    while (!to.empty()) {
        const ssize_t got = ::pread(file.descriptor.get(), to.data(), to.size(), static_cast<off_t>(offset));
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) return cannot_read(file.path, errno);
        if (got == 0) return is_shorter();
        to = to.subspan(static_cast<std::size_t>(got));
        offset += static_cast<std::uint64_t>(got);
    }
    return Success{};
}

Result<std::string> FileReader::read_all() const {
    return in_memory(file_->path, [&]() -> Result<std::string> {
        if (Status fits = check_room(file_->path, size()); !fits) return fits.error();
        std::string bytes;
        reserve_large(bytes, size());
        bytes.resize(size());
        if (Status filled = read(0, bytes); !filled) return filled.error();
        return bytes;
    });
}

struct FileWriter::OpenFile {
    fs::path path;      ///< as the caller named it
    fs::path target;    ///< where that leads
    fs::path temporary; ///< the name it has until then; empty: none, or written in place
    bool is_unnamed = false;
    FileDescriptor descriptor;
    bool is_standard_output = false;
    std::optional<mode_t> permissions; ///< of the file that is replaced

    int get() const { return is_standard_output ? STDOUT_FILENO : descriptor.get(); }
    ~OpenFile() {
        descriptor.close();
        if (!temporary.empty()) ::unlink(temporary.c_str());
    }

    /// 0 or the error number.
    int finish() {
        const bool replaces = is_unnamed || !temporary.empty();
        if (permissions && ::fchmod(descriptor.get(), *permissions) != 0) return errno;
        if (replaces && ::fsync(descriptor.get()) != 0) return errno;
        if (is_unnamed) {
            fs::path name;
            if (const int failed = name_beside(target, descriptor.get(), name)) return failed;
            temporary = name;
        }
        // Another descriptor keeps the lock until the name is gone; what closing tells has to be known before.
        const FileDescriptor lock(::fcntl(descriptor.get(), F_DUPFD_CLOEXEC, 0));
        if (!descriptor.close()) return errno;
        if (!replaces) return 0;
        if (::rename(temporary.c_str(), target.c_str()) != 0) return errno;
        temporary.clear();
        sync_folder(target.parent_path());
        return 0;
    }
};

FileWriter::FileWriter(std::unique_ptr<OpenFile> file) : file_(std::move(file)) {}
FileWriter::FileWriter(FileWriter&&) noexcept = default;
FileWriter& FileWriter::operator=(FileWriter&&) noexcept = default;
FileWriter::~FileWriter() = default;

Result<FileWriter> FileWriter::create(const fs::path& path) {
    auto file = std::make_unique<OpenFile>();
    file->path = path;
    if (path == "-") {
        file->path = "standard output";
        file->is_standard_output = true;
        return FileWriter(std::move(file));
    }
    const fs::path target = file->target = follow_links(path);
    std::error_code ignored;
    if (fs::is_symlink(target, ignored)) return cannot_write(path, ELOOP);
    struct stat existing {};
    const bool exists = ::stat(target.c_str(), &existing) == 0;
    if (exists && S_ISDIR(existing.st_mode)) return cannot_write(path, EISDIR);
    if (exists && !S_ISREG(existing.st_mode)) { // a device or pipe stays what it is
        file->descriptor = FileDescriptor(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
    } else {
        if (exists && ::access(target.c_str(), W_OK) != 0) return cannot_write(path, errno); // read-only: hands off
        if (!target.has_filename()) return cannot_write(path, ENOENT);
        if (exists) file->permissions = existing.st_mode & 07777;
        file->descriptor = FileDescriptor(open_unnamed(target.parent_path()));
        file->is_unnamed = file->descriptor.is_open();
        fs::path temporary;
        if (!file->is_unnamed) file->descriptor = FileDescriptor(create_beside(target, temporary));
        if (!file->is_unnamed && file->descriptor.is_open()) file->temporary = temporary;
    }
    if (!file->descriptor.is_open()) return cannot_write(path, errno);
    return FileWriter(std::move(file));
}

Status FileWriter::write(std::string_view bytes) {
    if (const int failed = write_piece(file_->get(), bytes)) return cannot_write(file_->path, failed);
    return Success{};
}

Status FileWriter::reserve(std::uint64_t bytes) {
    const bool has_room = ::fallocate(file_->get(), 0, 0, static_cast<off_t>(bytes)) == 0;
    if (!has_room && (errno == ENOSPC || errno == EFBIG || errno == EDQUOT)) return cannot_write(file_->path, errno);
    return Success{};
}

Status FileWriter::write_at(std::uint64_t offset, std::string_view bytes) {
    while (!bytes.empty()) {
        const ssize_t written = ::pwrite(file_->get(), bytes.data(), bytes.size(), static_cast<off_t>(offset));
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) return cannot_write(file_->path, errno);
        bytes.remove_prefix(static_cast<std::size_t>(written));
        offset += static_cast<std::uint64_t>(written);
    }
    return Success{};
}

Status FileWriter::finish() {
    OpenFile& file = *file_;
    if (file.is_standard_output) return Success{};
    const int failed = file.finish();
    if (failed) return cannot_write(file.path, failed);
    return Success{};
}

Status write_file(const fs::path& path, std::span<const std::string_view> pieces) {
    Result<FileWriter> writer = FileWriter::create(path);
    if (!writer) return writer.error();
    for (const std::string_view piece : pieces)
        if (Status written = writer->write(piece); !written) return written;
    return writer->finish();
}

Status write_file(const fs::path& path, std::string_view bytes) { return write_file(path, std::span(&bytes, 1)); }

} // namespace filigree
