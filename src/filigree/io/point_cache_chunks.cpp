// A PC2's frames all have one size, so processes that know nothing of each other can write them into one file.
#include "filigree/io/extension.h"
#include "filigree/io/file.h"
#include "filigree/io/file_error.h"
#include "filigree/io/point_cache_formats.h"
#include "filigree/io/temporary_file.h"

#include <cerrno>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace filigree {

namespace {

namespace fs = std::filesystem;

/// Closes itself; -1: not open.
class Descriptor {
public:
    explicit Descriptor(int descriptor) : descriptor_(descriptor) {}
    ~Descriptor() {
        if (descriptor_ >= 0) ::close(descriptor_);
    }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    int get() const { return descriptor_; }

private:
    int descriptor_;
};

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

/// What the processes of one job share.
class SharedFile {
public:
    SharedFile(std::size_t frames, std::size_t points, const fs::path& path, const AnimationChunk& chunk,
               std::string header)
        : path_(path), folder_(path.string() + ".chunks"), plan_path_(path.string() + ".plan"),
          frames_(folder_ / "frames"), header_(std::move(header)),
          size_(header_.size() + std::uint64_t{frames} * points * sizeof(Vec3f)), count_(chunk.count) {
        plan_ = "A point cache that filigree writes in chunks\njob " + chunk.job + "\nframes " +
                std::to_string(frames) + "\nvertices " + std::to_string(points) + "\nchunks " +
                std::to_string(chunk.count) + "\n";
    }

    /// Whether the file was finished by this very job.
    bool is_whole() const {
        std::error_code failed;
        return !fs::exists(folder_, failed) && is_our_plan() && fs::file_size(path_, failed) == size_ && !failed;
    }

    /// Makes what is not there yet. Errors: mismatch, unwritable.
    Status begin() const {
        std::error_code failed;
        if (fs::exists(folder_, failed) && fs::exists(plan_path_, failed) && !is_our_plan())
            return Error{ErrorCode::mismatch, plan_path_.string() +
                                                  ": belongs to another job (another model, other poses, settings or "
                                                  "number of chunks); let it end, delete it and " +
                                                  folder_.string() + ", or write to another name."};
        if (!is_our_plan())
            if (Status written = write_file(plan_path_, plan_); !written) return written;
        if (::mkdir(folder_.c_str(), 0777) != 0 && errno != EEXIST) return cannot_write(folder_, errno);
        if (fs::exists(frames_, failed)) return Success{};
        const fs::path temporary = temporary_path(folder_);
        const Descriptor file(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
        int wrong = file.get() < 0 ? errno : write_at(file.get(), 0, header_);
        if (!wrong && ::ftruncate(file.get(), off_t(size_)) != 0) wrong = errno;
        if (!wrong && ::fsync(file.get()) != 0) wrong = errno;
        // Whoever comes second finds the first one's.
        if (!wrong && ::link(temporary.c_str(), frames_.c_str()) != 0 && errno != EEXIST) wrong = errno;
        ::unlink(temporary.c_str());
        if (wrong) return cannot_write(frames_, wrong);
        return Success{};
    }

    fs::path mark(std::size_t chunk) const { return folder_ / ("done-" + std::to_string(chunk)); }
    bool is_done(std::size_t chunk) const {
        std::error_code failed;
        return fs::exists(mark(chunk), failed);
    }
    std::size_t done() const {
        std::size_t count = 0;
        for (std::size_t k = 1; k <= count_; ++k) count += is_done(k);
        return count;
    }

    /// Has `fill` write frames, and keeps them safe.
    Status write(const std::function<Status(const WriteAt&)>& fill) const {
        const Descriptor file(::open(frames_.c_str(), O_WRONLY | O_CLOEXEC));
        if (file.get() < 0) return cannot_write(frames_, errno);
        const auto write_some = [&](std::uint64_t offset, std::string_view bytes) -> Status {
            if (const int wrong = write_at(file.get(), offset, bytes)) return cannot_write(frames_, wrong);
            return Success{};
        };
        if (Status filled = fill(write_some); !filled) return filled;
        if (::fsync(file.get()) != 0) return cannot_write(frames_, errno);
        return Success{};
    }

    Status mark_done(std::size_t chunk) const {
        const Descriptor file(::open(mark(chunk).c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0666));
        if (file.get() < 0) return cannot_write(mark(chunk), errno);
        sync_folder(folder_);
        return Success{};
    }

    /// All chunks are there: the file goes to its place. Another process may do the same at this moment.
    Status finish() const {
        if (::rename(frames_.c_str(), path_.c_str()) != 0 && errno != ENOENT) return cannot_write(path_, errno);
        sync_folder(path_.parent_path());
        std::error_code ignored; // what is left hinders nobody
        for (std::size_t k = 1; k <= count_; ++k) fs::remove(mark(k), ignored);
        fs::remove(folder_, ignored);
        return Success{};
    }

private:
    bool is_our_plan() const {
        const Result<std::string> there = read_file(plan_path_);
        return there && *there == plan_;
    }

    fs::path path_, folder_, plan_path_, frames_;
    std::string header_, plan_;
    std::uint64_t size_;
    std::size_t count_;
};

} // namespace

Result<ChunkReport>
write_shared_pc2(std::size_t frames, std::size_t points, const fs::path& path, const AnimationChunk& chunk,
                 const std::function<Status(std::size_t first, std::size_t last, const WriteAt& write_at)>& fill) {
    if (chunk.number < 1 || chunk.number > chunk.count)
        return Error{ErrorCode::usage, "There is no chunk " + std::to_string(chunk.number) + " of " +
                                           std::to_string(chunk.count) + "; they are counted from 1."};
    if (lower_extension(path) != ".pc2")
        return Error{ErrorCode::usage,
                     path.string() + ": chunks are written of .pc2 alone, whose frames all have one size."};
    if (frames == 0) return Error{ErrorCode::unsuitable, path.string() + ": not written: there are no frames."};
    Result<std::string> header = pc2_header(frames, points, path);
    if (!header) return header.error();
    const SharedFile file(frames, points, path, chunk, std::move(*header));
    ChunkReport report;
    report.first_frame = frames * (chunk.number - 1) / chunk.count;
    report.frames = frames * chunk.number / chunk.count - report.first_frame;
    const auto whole = [&] {
        report.chunks_done = chunk.count;
        report.is_whole = true;
        return report;
    };
    if (file.is_whole()) {
        report.was_done = true;
        return whole();
    }
    if (Status begun = file.begin(); !begun) return begun.error();
    report.was_done = file.is_done(chunk.number);
    if (!report.was_done) {
        Status written = file.write([&](const WriteAt& write_at) {
            return fill(report.first_frame, report.first_frame + report.frames, write_at);
        });
        if (written) written = file.mark_done(chunk.number);
        if (!written && file.is_whole()) return whole(); // another process wrote the same chunk, and was the last
        if (!written) return written.error();
    }
    report.chunks_done = file.done();
    if (file.is_whole()) return whole();
    if (report.chunks_done < chunk.count) return report;
    if (Status finished = file.finish(); !finished) return finished.error();
    return whole();
}

Result<ChunkReport> write_animation_chunk(const MeshAnimation& animation, const fs::path& path,
                                          const AnimationChunk& chunk, const RunContext& context) {
    const auto fill = [&](std::size_t first, std::size_t last, const WriteAt& write_at) -> Status {
        WorldFrames positions(animation, path);
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

Result<std::string> hash_of_files(std::span<const fs::path> paths) {
    XXH3_state_t* const state = XXH3_createState();
    if (!state) return Error{ErrorCode::out_of_memory, "Not enough memory to hash a file."};
    XXH3_128bits_reset(state);
    const auto take = [&](const fs::path& path) -> Status {
        const Result<FileReader> file = FileReader::open(path);
        if (!file) return file.error();
        std::string piece;
        for (std::uint64_t offset = 0; offset < file->size(); offset += piece.size()) {
            piece.resize(std::min<std::uint64_t>(std::uint64_t{1} << 20, file->size() - offset));
            if (Status filled = file->read(offset, piece); !filled) return filled;
            XXH3_128bits_update(state, piece.data(), piece.size());
        }
        return Success{};
    };
    Status taken = Success{};
    for (const fs::path& path : paths)
        if (taken) taken = take(path);
    const XXH128_hash_t hash = XXH3_128bits_digest(state);
    XXH3_freeState(state);
    if (!taken) return taken.error();
    constexpr char kDigits[] = "0123456789abcdef";
    std::string text;
    for (const XXH64_hash_t half : {hash.high64, hash.low64})
        for (int shift = 60; shift >= 0; shift -= 4) text += kDigits[half >> shift & 15];
    return text;
}

} // namespace filigree
