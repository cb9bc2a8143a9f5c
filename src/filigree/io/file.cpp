#include "filigree/io/file.h"
#include "filigree/io/large_memory.h"

#include <atomic>
#include <cerrno>
#include <cstring>
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

/// Closes what it holds.
class FileDescriptor {
public:
    explicit FileDescriptor(int descriptor) : descriptor_(descriptor) {}
    ~FileDescriptor() { close(); }
    FileDescriptor(const FileDescriptor&) = delete;
    FileDescriptor& operator=(const FileDescriptor&) = delete;

    bool is_open() const { return descriptor_ >= 0; }
    int get() const { return descriptor_; }
    void reset(int descriptor) {
        close();
        descriptor_ = descriptor;
    }
    bool close() {
        const int descriptor = std::exchange(descriptor_, -1);
        return descriptor < 0 || ::close(descriptor) == 0;
    }

private:
    int descriptor_;
};

/// What the system says about `error_number`, the same in every locale.
std::string cause(int error_number) {
    switch (error_number) {
    case ENOENT:
        return "there is no such file or folder";
    case ENOTDIR:
        return "a part of its path is not a folder";
    case EISDIR:
        return "it is a folder";
    case EACCES:
    case EPERM:
        return "permission is denied";
    case EROFS:
        return "the file system is read-only";
    case ENOSPC:
        return "the disk is full; make room or write elsewhere";
    case EDQUOT:
        return "the disk quota is used up; make room or write elsewhere";
    case EFBIG:
        return "the file is larger than allowed here";
    case ENAMETOOLONG:
        return "the name is too long";
    case ELOOP:
        return "its symbolic links go round in a circle";
    case EPIPE:
        return "the reader has gone away";
    case EIO:
        return "the device failed";
    default:
        return "the system says error " + std::to_string(error_number);
    }
}

Error cannot_read(const fs::path& path, int error_number) {
    return {ErrorCode::not_found, path.string() + ": cannot be read: " + cause(error_number) + "."};
}
Error cannot_write(const fs::path& path, int error_number) {
    return {ErrorCode::unwritable, path.string() + ": cannot be written: " + cause(error_number) + "."};
}

Result<std::string> read_descriptor(int descriptor, const fs::path& path) {
    constexpr std::size_t kPipePiece = std::size_t{1} << 16;
    struct stat status {};
    if (::fstat(descriptor, &status) != 0) return cannot_read(path, errno);
    if (S_ISDIR(status.st_mode)) return cannot_read(path, EISDIR);
    // The size is a hint: pipes have none, and files grow and shrink. One byte more finds the end without another
    // round.
    std::string bytes;
    const std::size_t first_size = S_ISREG(status.st_mode) ? static_cast<std::size_t>(status.st_size) + 1 : kPipePiece;
    reserve_large(bytes, first_size);
    bytes.resize(first_size);
    for (std::size_t used = 0;;) {
        if (used == bytes.size()) bytes.resize(2 * bytes.size());
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

/// Where writing to `path` ends up: symbolic links followed, also one that points to nothing yet.
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

/// Beside the target, so that the rename stays in one file system; of another process and call than any other.
fs::path temporary_name(const fs::path& target) {
    static std::atomic<unsigned> next{0};
    return target.parent_path() / (".filigree-" + std::to_string(::getpid()) + "-" + std::to_string(next++) + ".tmp");
}

int open_temporary(const fs::path& target, fs::path& temporary) {
    constexpr int kTries = 100; // leftovers of a killed process with our number
    for (int i = 0; i < kTries; ++i) {
        temporary = temporary_name(target);
        const int descriptor = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (descriptor >= 0 || errno != EEXIST) return descriptor;
    }
    return -1;
}

void sync_folder(const fs::path& folder) {
    const FileDescriptor descriptor(::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (descriptor.is_open()) ::fsync(descriptor.get()); // best effort: some file systems cannot
}

} // namespace

Result<std::string> read_file(const fs::path& path) {
    try {
        if (path == "-") return read_descriptor(STDIN_FILENO, "standard input");
        const FileDescriptor descriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
        if (!descriptor.is_open()) return cannot_read(path, errno);
        return read_descriptor(descriptor.get(), path);
    } catch (const std::bad_alloc&) {
        return Error{ErrorCode::out_of_memory, path.string() + ": does not fit into memory."};
    } catch (const std::length_error&) {
        return Error{ErrorCode::out_of_memory, path.string() + ": does not fit into memory."};
    }
}

struct FileWriter::Content {
    fs::path path;      ///< as the caller named it
    fs::path target;    ///< where that leads
    fs::path temporary; ///< empty: written in place
    FileDescriptor descriptor{-1};
    bool is_standard_output = false;
    std::optional<mode_t> permissions; ///< of the file that is replaced

    int get() const { return is_standard_output ? STDOUT_FILENO : descriptor.get(); }
    ~Content() {
        descriptor.close();
        if (!temporary.empty()) ::unlink(temporary.c_str());
    }
};

FileWriter::FileWriter(std::unique_ptr<Content> content) : content_(std::move(content)) {}
FileWriter::FileWriter(FileWriter&&) noexcept = default;
FileWriter& FileWriter::operator=(FileWriter&&) noexcept = default;
FileWriter::~FileWriter() = default;

Result<FileWriter> FileWriter::create(const fs::path& path) {
    auto content = std::make_unique<Content>();
    content->path = path;
    if (path == "-") {
        content->path = "standard output";
        content->is_standard_output = true;
        return FileWriter(std::move(content));
    }
    const fs::path target = content->target = follow_links(path);
    std::error_code ignored;
    if (fs::is_symlink(target, ignored)) return cannot_write(path, ELOOP);
    struct stat existing {};
    const bool exists = ::stat(target.c_str(), &existing) == 0;
    if (exists && S_ISDIR(existing.st_mode)) return cannot_write(path, EISDIR);
    if (exists && !S_ISREG(existing.st_mode)) { // a device or pipe stays what it is
        content->descriptor.reset(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
    } else {
        if (exists && ::access(target.c_str(), W_OK) != 0) return cannot_write(path, errno); // read-only: hands off
        if (!target.has_filename()) return cannot_write(path, ENOENT);
        if (exists) content->permissions = existing.st_mode & 07777;
        fs::path temporary;
        content->descriptor.reset(open_temporary(target, temporary));
        if (content->descriptor.is_open()) content->temporary = temporary;
    }
    if (!content->descriptor.is_open()) return cannot_write(path, errno);
    return FileWriter(std::move(content));
}

Status FileWriter::write(std::string_view bytes) {
    if (const int failed = write_piece(content_->get(), bytes)) return cannot_write(content_->path, failed);
    return Success{};
}

Status FileWriter::finish() {
    Content& content = *content_;
    if (content.is_standard_output) return Success{};
    const int descriptor = content.descriptor.get();
    int failed = 0;
    if (content.permissions && ::fchmod(descriptor, *content.permissions) != 0) failed = errno;
    if (!failed && !content.temporary.empty() && ::fsync(descriptor) != 0) failed = errno;
    if (!content.descriptor.close() && !failed) failed = errno;
    if (!failed && !content.temporary.empty()) {
        if (::rename(content.temporary.c_str(), content.target.c_str()) != 0)
            failed = errno;
        else
            content.temporary.clear();
    }
    if (failed) return cannot_write(content.path, failed);
    if (!content.target.empty()) sync_folder(content.target.parent_path());
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
