// A PC2's frames all have one size, so processes that know nothing of each other can write them into one file.
#include "filigree/io/animation/point_cache.h"
#include "filigree/io/animation/point_cache_formats.h"
#include "filigree/io/system/extension.h"
#include "filigree/io/system/file.h"
#include "filigree/io/system/file_descriptor.h"
#include "filigree/io/system/file_error.h"
#include "filigree/io/system/platform.h"
#include "filigree/io/system/shared_work.h"
#include "filigree/io/system/temporary_file.h"

#include <algorithm>
#include <cerrno>

namespace filigree {

namespace {

namespace fs = std::filesystem;

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
        const FileDescriptor file(platform::open_to_write(frames));
        if (!file.is_open()) return cannot_write(frames, errno);
        const auto write_some = [&](std::uint64_t offset, std::string_view bytes) -> Status {
            if (const int wrong = platform::write_at(file.get(), offset, bytes)) return cannot_write(frames, wrong);
            return Success{};
        };
        if (Status filled = fill(write_some); !filled) return filled;
        if (const int wrong = platform::flush(file.get())) return cannot_write(frames, wrong);
        return Success{};
    }

    Status mark_done(std::size_t chunk) const { return folder_.mark(marks_[chunk - 1]); }

    /// All chunks are there: the file goes to its place. Another process may do the same at this moment.
    Status finish() const {
        // It keeps its name in the folder: without it another process would begin an empty one there.
        const fs::path frames = folder_.file(kFrames), whole = temporary_path(folder_.file(""));
        if (!folder_.is_ours()) return cannot_write(frames, ENOENT);
        int failed = platform::link(frames, whole);
        if (failed == 0) failed = platform::rename(whole, path_);
        if (failed != 0) {
            if (failed != ENOENT) return cannot_write(path_, failed);
            if (!is_in_place()) // one that was killed had put it there, and somebody took it away
                return cannot_write(path_, frames.string() + " is gone; delete its folder, and run all chunks again");
        }
        platform::flush_folder(path_.parent_path());
        return folder_.end();
    }

private:
    static constexpr const char* kFrames = "frames";

    bool is_in_place() const {
        std::error_code failed;
        return fs::file_size(path_, failed) == size_ && !failed;
    }
    Status make_empty(const fs::path& path) const {
        const FileDescriptor file(platform::create_new(path));
        int wrong = file.is_open() ? platform::write_at(file.get(), 0, header_) : errno;
        if (!wrong) wrong = platform::set_size(file.get(), size_);
        if (!wrong) wrong = platform::flush(file.get());
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
