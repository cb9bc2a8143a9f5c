// Whole files in and out: read at once, written beside the target and renamed.
#pragma once

#include "filigree/file.h"

#include "filigree/result.h"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace filigree {

/// A file whose pieces are read when they are asked for. A pipe or standard input is read whole when it is opened.
class FileReader {
public:
    /// "-" is standard input. Errors: as of read_file.
    static Result<FileReader> open(const std::filesystem::path& path);
    /// Bytes that somebody else keeps.
    explicit FileReader(std::string_view bytes);
    /// The same, of a file that has `size` bytes and of which only the beginning is there yet.
    FileReader(std::string_view beginning, std::uint64_t size);
    FileReader(FileReader&&) noexcept;
    FileReader& operator=(FileReader&&) noexcept;
    ~FileReader();

    std::uint64_t size() const;
    /// Fills `to` with the bytes from `offset` on. Errors: not_found (they cannot be read, or the file has become
    /// shorter).
    Status read(std::uint64_t offset, std::span<char> to) const;
    /// All of it. Errors: as of read, and out_of_memory.
    Result<std::string> read_all() const;

private:
    struct OpenFile;
    explicit FileReader(std::unique_ptr<OpenFile> file);
    std::unique_ptr<OpenFile> file_;
};

/// Replaces `path` by `pieces`, one after the other: written to a temporary file in the same folder, flushed, then
/// renamed. On any error, or when the process dies, `path` is as it was. "-" is standard output. Only a device or pipe
/// is written in place: it cannot be replaced, and keeps what it got before an error. Symbolic links are followed, and
/// the permissions of an existing file are kept. Errors: unwritable.
/// The temporary file has no name until it is whole, so a process that is killed leaves nothing; but for a moment
/// before the rename, and on file systems without such files (NFS, FAT). It then leaves ".filigree-X.tmp", which the
/// next writing of the same file removes.
Status write_file(const std::filesystem::path& path, std::span<const std::string_view> pieces);

/// A file that is written piece by piece without being in memory, under the same promises as write_file.
class FileWriter {
public:
    /// Opens the temporary file. "-" is standard output. Errors: unwritable.
    static Result<FileWriter> create(const std::filesystem::path& path);
    FileWriter(FileWriter&&) noexcept;
    FileWriter& operator=(FileWriter&&) noexcept;
    /// Unless it was finished, `path` is as it was.
    ~FileWriter();

    Status write(std::string_view bytes);
    /// Makes room for a file of so many bytes, where the file system can: pieces that come in any order then lie
    /// together, and a full disk is known at once. Errors: unwritable (the disk is full).
    Status reserve(std::uint64_t bytes);
    /// Writes somewhere in the file, and leaves where write goes on. Errors: also of what cannot be written there and
    /// back (standard output, a pipe).
    Status write_at(std::uint64_t offset, std::string_view bytes);
    /// Puts what was written in the place of `path`.
    Status finish();

private:
    struct OpenFile;
    explicit FileWriter(std::unique_ptr<OpenFile> file);
    std::unique_ptr<OpenFile> file_;
};

} // namespace filigree
