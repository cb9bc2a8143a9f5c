// A PC2's frames all have one size, so processes that know nothing of each other can write them into one file.
#include "filigree/io/extension.h"
#include "filigree/io/file.h"
#include "filigree/io/file_descriptor.h"
#include "filigree/io/file_error.h"
#include "filigree/io/point_cache.h"
#include "filigree/io/point_cache_formats.h"
#include "filigree/io/shared_work.h"
#include "filigree/io/temporary_file.h"

#include <algorithm>
#include <cerrno>

#include <fcntl.h>
#include <unistd.h>

namespace filigree {

namespace {

namespace fs = std::filesystem;

/// 0 or the error number.
int write_at(int descriptor, std::uint64_t offset, std::string_view bytes) {
    while (!bytes.empty()) {
        const ssize_t written = ::pwrite(descriptor, bytes.data(), bytes.size(), off_t(offset));
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) return errno;
        bytes.remove_prefix(std::size_t(written));
        offset += std::uint64_t(written);
    }
    return 0;
}

/// What the processes of one job share: the frames, and a mark for every chunk that is in them.
class SharedFrames {
public:
    SharedFrames(std::size_t frames, std::size_t points, const fs::path& path, const WorkChunk& chunk,
                 std::string header)
        : path_(path), header_(std::move(header)),
          size_(header_.size() + std::uint64_t{frames} * points * sizeof(Vec3f)),
          folder_(path,
                  "A point cache that filigree writes in chunks\njob " + chunk.job + "\nframes " +
                      std::to_string(frames) + "\nvertices " + std::to_string(points) + "\nchunks " +
                      std::to_string(chunk.count) + "\n",
                  [this] { return is_in_place(); }) {
        for (std::size_t k = 1; k <= chunk.count; ++k) marks_.push_back("done-" + std::to_string(k));
    }
    SharedFrames(const SharedFrames&) = delete;
    SharedFrames& operator=(const SharedFrames&) = delete;

    const SharedFolder& folder() const { return folder_; }
    std::vector<bool> marks() const { return folder_.are_there(marks_); }

    /// Has `fill` write frames, and keeps them safe.
    Status write(const std::function<Status(const WriteAt&)>& fill) const {
        const fs::path frames = folder_.file(kFrames);
        if (!folder_.is_ours()) return cannot_write(frames, ENOENT);
        if (Status made = folder_.add(kFrames, [&](const fs::path& empty) { return make_empty(empty); }); !made)
            return made;
        const FileDescriptor file(::open(frames.c_str(), O_WRONLY | O_CLOEXEC));
        if (!file.is_open()) return cannot_write(frames, errno);
        const auto write_some = [&](std::uint64_t offset, std::string_view bytes) -> Status {
            if (const int wrong = write_at(file.get(), offset, bytes)) return cannot_write(frames, wrong);
            return Success{};
        };
        if (Status filled = fill(write_some); !filled) return filled;
        if (::fsync(file.get()) != 0) return cannot_write(frames, errno);
        return Success{};
    }

    Status mark_done(std::size_t chunk) const { return folder_.mark(marks_[chunk - 1]); }

    /// All chunks are there: the file goes to its place. Another process may do the same at this moment.
    Status finish() const {
        // It keeps its name in the folder: without it another process would begin an empty one there.
        const fs::path frames = folder_.file(kFrames), whole = temporary_path(folder_.file(""));
        if (!folder_.is_ours()) return cannot_write(frames, ENOENT);
        const bool is_moved = ::link(frames.c_str(), whole.c_str()) == 0 && ::rename(whole.c_str(), path_.c_str()) == 0;
        if (!is_moved) {
            if (errno != ENOENT) return cannot_write(path_, errno);
            if (!is_in_place()) // one that was killed had put it there, and somebody took it away
                return cannot_write(path_, frames.string() + " is gone; delete its folder, and run all chunks again");
        }
        sync_folder(path_.parent_path());
        return folder_.end();
    }

private:
    static constexpr const char* kFrames = "frames";

    bool is_in_place() const {
        std::error_code failed;
        return fs::file_size(path_, failed) == size_ && !failed;
    }
    Status make_empty(const fs::path& path) const {
        const FileDescriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
        int wrong = file.is_open() ? write_at(file.get(), 0, header_) : errno;
        if (!wrong && ::ftruncate(file.get(), off_t(size_)) != 0) wrong = errno;
        if (!wrong && ::fsync(file.get()) != 0) wrong = errno;
        if (wrong) return cannot_write(path, wrong);
        return Success{};
    }

    fs::path path_;
    std::string header_;
    std::uint64_t size_;
    SharedFolder folder_;
    std::vector<std::string> marks_;
};

} // namespace

Result<ChunkReport>
write_shared_pc2(std::size_t frames, std::size_t points, const fs::path& path, const WorkChunk& chunk,
                 const std::function<Status(std::size_t first, std::size_t last, const WriteAt& write_at)>& fill) {
    if (Status right = check_chunk(chunk); !right) return right.error();
    if (lower_extension(path) != ".pc2")
        return Error{ErrorCode::usage,
                     path.string() + ": chunks are written of .pc2 alone, whose frames all have one size."};
    if (frames == 0) return Error{ErrorCode::unsuitable, path.string() + ": not written: there are no frames."};
    Result<std::string> header = pc2_header(frames, points, path);
    if (!header) return header.error();
    const SharedFrames shared(frames, points, path, chunk, std::move(*header));
    ChunkReport report;
    report.first_frame = chunk.first_of(frames);
    report.frames = chunk.end_of(frames) - report.first_frame;
    const auto whole = [&] {
        shared.folder().clear();
        report.chunks_done = chunk.count;
        report.is_whole = true;
        return report;
    };
    const Result<bool> begun = shared.folder().begin();
    if (!begun) return begun.error();
    report.was_done = *begun || shared.marks()[chunk.number - 1];
    if (*begun) return whole();
    if (!report.was_done) {
        Status written = shared.write([&](const WriteAt& write_at) {
            return fill(report.first_frame, report.first_frame + report.frames, write_at);
        });
        if (written) written = shared.mark_done(chunk.number);
        // Another process wrote the same chunk, and was the last.
        if (!written && shared.folder().is_finished()) return whole();
        if (!written) return written.error();
    }
    const std::vector<bool> marks = shared.marks();
    report.chunks_done = std::size_t(std::ranges::count(marks, true));
    if (shared.folder().is_finished()) return whole();
    if (report.chunks_done < chunk.count) return report;
    if (Status finished = shared.finish(); !finished && !shared.folder().is_finished()) return finished.error();
    return whole();
}

Result<ChunkReport> write_animation_chunk(const MeshAnimation& animation, const fs::path& path, const WorkChunk& chunk,
                                          const RunContext& context) {
    const auto fill = [&](std::size_t first, std::size_t last, const WriteAt& write_at) -> Status {
        CheckedFrames positions(animation, path, animation.rest->origin);
        std::vector<Vec3f> points(animation.rest->vertex_count());
        const std::string_view bytes(reinterpret_cast<const char*>(points.data()), points.size() * sizeof(Vec3f));
        for (std::size_t frame = first; frame < last; ++frame) {
            context.report("writing", double(frame - first) / double(last - first));
            if (context.is_cancelled()) return cancelled_error();
            if (Status fetched = positions.fetch(frame, points); !fetched) return fetched;
            if (Status written = write_at(kPc2HeaderBytes + std::uint64_t{frame} * bytes.size(), bytes); !written)
                return written;
        }
        context.report("writing", 1);
        return Success{};
    };
    return write_shared_pc2(animation.frames, animation.rest->vertex_count(), path, chunk, fill);
}

} // namespace filigree
