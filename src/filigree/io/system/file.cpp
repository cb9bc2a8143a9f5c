#include "filigree/io/system/file.h"
#include "filigree/core/large_memory.h"
#include "filigree/io/system/file_descriptor.h"
#include "filigree/io/system/file_error.h"
#include "filigree/io/system/platform.h"
#include "filigree/io/system/temporary_file.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <new>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace filigree {

namespace {

namespace fs = std::filesystem;
using Kind = platform::Status::Kind;

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

/// Refuses a file whose bytes cannot all be here, before any of them is read: where memory is promised freely, the
/// program would be killed in the midst of it.
Status check_room(const fs::path& path, std::uint64_t bytes) {
    constexpr double kGigabyte = 1e9;
    const std::uint64_t memory = platform::memory();
    if (bytes <= memory) return Success{};
    char sizes[96];
    std::snprintf(sizes, sizeof sizes, "has %.3g GB, and there are %.3g GB of memory", double(bytes) / kGigabyte,
                  double(memory) / kGigabyte);
    return Error{ErrorCode::out_of_memory, path.string() + ": does not fit into memory: it " + sizes + "."};
}

Result<std::string> read_descriptor(int descriptor, const fs::path& path) {
    constexpr std::size_t kPipePiece = std::size_t{1} << 16;
    const std::optional<platform::Status> status = platform::status_of(descriptor);
    if (!status) return cannot_read(path, errno);
    if (status->kind == Kind::folder) return cannot_read(path, EISDIR);
    // The size is a hint: pipes have none, and files grow and shrink. One byte more finds the end without another
    // round.
    const bool has_size = status->kind == Kind::file;
    if (has_size)
        if (Status fits = check_room(path, status->size); !fits) return fits.error();
    std::string bytes;
    const std::size_t first_size = has_size ? static_cast<std::size_t>(status->size) + 1 : kPipePiece;
    reserve_large(bytes, first_size);
    bytes.resize(first_size);
    for (std::size_t used = 0;;) {
        if (used == bytes.size()) {
            if (Status fits = check_room(path, used); !fits) return fits.error();
            bytes.resize(2 * bytes.size());
        }
        const std::int64_t got = platform::read(descriptor, std::span(bytes).subspan(used));
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

} // namespace

fs::path path_of(std::string_view utf8) { return platform::native_name(utf8); }

Result<std::string> read_file(const fs::path& path) {
    if (path == "-") return read_whole(platform::kStandardInput, "standard input");
    const FileDescriptor descriptor(platform::open_to_read(path));
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
    if (path != "-") {
        file->descriptor = FileDescriptor(platform::open_to_read(path));
        if (!file->descriptor.is_open()) return cannot_read(path, errno);
        const std::optional<platform::Status> status = platform::status_of(file->descriptor.get());
        if (!status) return cannot_read(path, errno);
        file->size = status->size;
        if (status->kind == Kind::file && file->size > 0) return FileReader(std::move(file));
    }
    Result<std::string> bytes = read_whole(path == "-" ? platform::kStandardInput : file->descriptor.get(),
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
        const std::int64_t got = platform::read_at(file.descriptor.get(), offset, to);
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
    std::optional<unsigned> permissions; ///< of the file that is replaced

    int get() const { return is_standard_output ? platform::kStandardOutput : descriptor.get(); }
    ~OpenFile() {
        descriptor.close();
        if (!temporary.empty()) platform::remove_file(temporary);
    }

    /// 0 or the error number.
    int finish() {
        const bool replaces = is_unnamed || !temporary.empty();
        if (permissions)
            if (const int failed = platform::set_permissions(descriptor.get(), *permissions)) return failed;
        if (replaces)
            if (const int failed = platform::flush(descriptor.get())) return failed;
        if (is_unnamed) {
            fs::path name;
            if (const int failed = name_beside(target, descriptor.get(), name)) return failed;
            temporary = name;
        }
        // Another descriptor keeps the lock until the name is gone; what closing tells has to be known before.
        const FileDescriptor lock(platform::duplicate(descriptor.get()));
        if (!descriptor.close()) return errno;
        if (!replaces) return 0;
        if (const int failed = platform::rename(temporary, target)) return failed;
        temporary.clear();
        platform::flush_folder(target.parent_path());
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
    const std::optional<platform::Status> existing = platform::status_of(target);
    if (existing && existing->kind == Kind::folder) return cannot_write(path, EISDIR);
    if (existing && existing->kind != Kind::file) { // a device or pipe stays what it is
        file->descriptor = FileDescriptor(platform::open_to_write(path));
    } else {
        if (existing) // read-only: hands off
            if (const int refused = platform::refused_writing(target)) return cannot_write(path, refused);
        if (!target.has_filename()) return cannot_write(path, ENOENT);
        if (existing) file->permissions = existing->permissions;
        file->descriptor = FileDescriptor(platform::open_unnamed(target.parent_path()));
        file->is_unnamed = file->descriptor.is_open();
        fs::path temporary;
        if (!file->is_unnamed) file->descriptor = FileDescriptor(create_beside(target, temporary));
        if (!file->is_unnamed && file->descriptor.is_open()) file->temporary = temporary;
    }
    if (!file->descriptor.is_open()) return cannot_write(path, errno);
    return FileWriter(std::move(file));
}

Status FileWriter::write(std::string_view bytes) {
    if (const int failed = platform::write(file_->get(), bytes)) return cannot_write(file_->path, failed);
    return Success{};
}

Status FileWriter::reserve(std::uint64_t bytes) {
    if (const int failed = platform::reserve(file_->get(), bytes)) return cannot_write(file_->path, failed);
    return Success{};
}

Status FileWriter::write_at(std::uint64_t offset, std::string_view bytes) {
    if (const int failed = platform::write_at(file_->get(), offset, bytes)) return cannot_write(file_->path, failed);
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
