// PC2 (PointCache 2) and MDD (Motion Designer): a header, then positions frame after frame. PC2 is little-endian, as we
// are; MDD is big-endian and has a time for each frame.
#include "filigree/io/animation/point_cache_formats.h"
#include "filigree/io/system/file.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace filigree {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPc2Magic("POINTCACHE2\0", 12);
constexpr std::int32_t kPc2Version = 1;
constexpr std::uint64_t kMddHeader = 8;
constexpr std::size_t kPointBytes = sizeof(Vec3f);
static_assert(kPointBytes == 12);

/// A cache's bytes, and its name for what is wrong with it.
class CacheFile {
public:
    static Result<std::shared_ptr<const CacheFile>> open(const fs::path& path) {
        std::error_code ignored;
        const fs::file_status status = fs::status(path, ignored);
        if (fs::is_other(status) || fs::is_fifo(status)) // to open a pipe waits for its writer
            return Error{ErrorCode::unsupported, path.string() +
                                                     ": is a pipe or device, and frames of point caches are "
                                                     "fetched in any order; write it to a file first."};
        Result<FileReader> bytes = FileReader::open(path);
        if (!bytes) return bytes.error();
        return std::make_shared<const CacheFile>(*std::move(bytes), path.string());
    }
    CacheFile(FileReader bytes, std::string name) : bytes_(std::move(bytes)), name_(std::move(name)) {}

    const std::string& name() const { return name_; }
    std::uint64_t size() const { return bytes_.size(); }
    Error error(const std::string& cause) const { return {ErrorCode::bad_file, name_ + ": " + cause}; }
    Status read(std::uint64_t offset, void* to, std::size_t bytes) const {
        return bytes_.read(offset, std::span(static_cast<char*>(to), bytes));
    }

private:
    FileReader bytes_;
    std::string name_;
};

using FilePointer = std::shared_ptr<const CacheFile>;

/// Turns the bytes of 32-bit words around.
void swap_words(void* words, std::size_t count) {
    auto* bytes = static_cast<char*>(words);
    for (std::size_t i = 0; i < count; ++i, bytes += 4) {
        std::uint32_t word;
        std::memcpy(&word, bytes, 4);
        word = __builtin_bswap32(word);
        std::memcpy(bytes, &word, 4);
    }
}

std::string plural(std::uint64_t count, const char* noun) {
    return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

/// Holds counts of a header against the file's length and the mesh. bytes: of one frame; `before` of all else.
Status check_counts(const CacheFile& file, std::int32_t frames, std::int32_t points, std::uint64_t before,
                    std::size_t expected_points) {
    if (frames <= 0 || points <= 0)
        return file.error("its header says " + std::to_string(frames) + " frames of " + std::to_string(points) +
                          " points; there must be one at least.");
    const std::uint64_t bytes = before + std::uint64_t(frames) * std::uint64_t(points) * kPointBytes;
    if (file.size() != bytes)
        return file.error("its header says " + plural(std::uint64_t(frames), "frame") + " of " +
                          plural(std::uint64_t(points), "point") + ", which is " + plural(bytes, "byte") +
                          ", and it has " + std::to_string(file.size()) + "; it was cut off, or is damaged.");
    if (std::uint64_t(points) != expected_points)
        return Error{ErrorCode::mismatch, file.name() + ": has " + plural(std::uint64_t(points), "point") +
                                              ", and what it should move has " + std::to_string(expected_points) +
                                              "; it is of another mesh."};
    return Success{};
}

Status read_frame(const CacheFile& file, std::uint64_t start, std::size_t frame, std::span<Vec3f> positions,
                  bool is_big_endian) {
    const std::size_t bytes = positions.size_bytes();
    if (Status read = file.read(start + std::uint64_t(frame) * bytes, positions.data(), bytes); !read) return read;
    if (is_big_endian) swap_words(positions.data(), 3 * positions.size());
    const auto bad = std::find_if(positions.begin(), positions.end(), [](const Vec3f& p) { return !p.allFinite(); });
    if (bad == positions.end()) return Success{};
    return file.error("frame " + std::to_string(frame + 1) + ", point " + std::to_string(bad - positions.begin()) +
                      " is not a finite number.");
}

MeshAnimation animation_of(FilePointer file, std::int32_t frames, double rate, std::uint64_t start,
                           bool is_big_endian) {
    return {nullptr, static_cast<std::size_t>(frames), rate,
            [file = std::move(file), start, is_big_endian](std::size_t frame, std::span<Vec3f> positions) {
                return read_frame(*file, start, frame, positions, is_big_endian);
            }};
}

/// The rate that an MDD's times give. A float's rounding is taken off, so that 60 comes back as 60.
Result<double> rate_of(const CacheFile& file, std::span<const float> times) {
    constexpr double kUneven = 0.01, kRounding = 1e-5;
    if (std::any_of(times.begin(), times.end(), [](float t) { return !std::isfinite(t); }))
        return file.error("one of its times is not a finite number.");
    const double first = times.front(), length = times.back() - first;
    if (std::all_of(times.begin(), times.end(), [&](float t) { return t == times.front(); }))
        return kUnsaidRate; // one frame, or a program that leaves them zero
    const double step = length / double(times.size() - 1);
    for (std::size_t i = 0; i < times.size(); ++i)
        if (!(step > 0) || std::abs(times[i] - (first + step * double(i))) > kUneven * step)
            return Error{ErrorCode::unsupported,
                         file.name() + ": its frames are not evenly spaced in time; give a frame rate to take them one "
                                       "after the other."};
    const double rate = 1 / step, whole = std::round(rate);
    return whole > 0 && std::abs(rate - whole) <= kRounding * rate ? whole : rate;
}

Status check_sizes(std::size_t frames, std::size_t points, const fs::path& path) {
    constexpr std::size_t kMost = std::numeric_limits<std::int32_t>::max();
    if (frames <= kMost && points <= kMost) return Success{};
    return Error{ErrorCode::unsupported, path.string() + ": point caches hold at most 2147483647 frames and points."};
}

Status write_frames(FileWriter& file, const MeshAnimation& animation, bool is_big_endian, const RunContext& context) {
    std::vector<Vec3f> points(animation.rest->vertex_count());
    const std::string_view bytes(reinterpret_cast<const char*>(points.data()), points.size() * kPointBytes);
    for (std::size_t frame = 0; frame < animation.frames; ++frame) {
        context.report("writing", double(frame) / double(animation.frames));
        if (context.is_cancelled()) return cancelled_error();
        if (Status fetched = animation.positions(frame, points); !fetched) return fetched;
        if (is_big_endian) swap_words(points.data(), 3 * points.size());
        if (Status written = file.write(bytes); !written) return written;
    }
    if (context.is_cancelled()) return cancelled_error();
    context.report("writing", 1);
    return file.finish();
}

template <class T>
void append(std::string& bytes, T value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

} // namespace

Result<MeshAnimation> open_pc2(const fs::path& path, std::size_t points, std::optional<double> frames_per_second) {
    struct {
        std::int32_t version, points;
        float first_frame, sample_rate;
        std::int32_t frames;
    } header{};
    constexpr double kMostRate = 1000; // frames a sample, or samples a frame: beyond, the number is no rate
    static_assert(kPc2Magic.size() + sizeof header == kPc2HeaderBytes);
    const Result<FilePointer> file = CacheFile::open(path);
    if (!file) return file.error();
    const CacheFile& in = **file;
    char magic[kPc2Magic.size()];
    if (in.size() < kPc2HeaderBytes) return in.error("is too short for a PC2 point cache.");
    if (Status read = in.read(0, magic, sizeof magic); !read) return read.error();
    if (Status read = in.read(sizeof magic, &header, sizeof header); !read) return read.error();
    if (std::string_view(magic, sizeof magic) != kPc2Magic)
        return in.error("does not begin with POINTCACHE2 and is no PC2 point cache.");
    if (header.version != kPc2Version)
        return Error{ErrorCode::unsupported, in.name() + ": is PC2 of version " + std::to_string(header.version) +
                                                 ", and only version 1 is known."};
    const double samples = header.sample_rate;
    if (!std::isfinite(header.first_frame) || !(samples >= 1 / kMostRate && samples <= kMostRate))
        return in.error("its header's start frame or sample rate makes no sense; it is damaged.");
    if (Status sound = check_counts(in, header.frames, header.points, kPc2HeaderBytes, points); !sound)
        return sound.error();
    const double rate = frames_per_second.value_or(kUnsaidRate) / samples;
    return animation_of(*file, header.frames, rate, kPc2HeaderBytes, false);
}

Result<MeshAnimation> open_mdd(const fs::path& path, std::size_t points, std::optional<double> frames_per_second) {
    std::int32_t counts[2] = {}; // frames, points
    const Result<FilePointer> file = CacheFile::open(path);
    if (!file) return file.error();
    const CacheFile& in = **file;
    if (in.size() < kMddHeader) return in.error("is too short for an MDD point cache.");
    if (Status read = in.read(0, counts, sizeof counts); !read) return read.error();
    swap_words(counts, 2);
    const std::uint64_t start = kMddHeader + sizeof(float) * std::uint64_t(std::max(counts[0], 0));
    if (Status sound = check_counts(in, counts[0], counts[1], start, points); !sound) return sound.error();
    std::vector<float> times(static_cast<std::size_t>(counts[0]));
    if (Status read = in.read(kMddHeader, times.data(), sizeof(float) * times.size()); !read) return read.error();
    swap_words(times.data(), times.size());
    Result<double> rate = frames_per_second ? Result<double>(*frames_per_second) : rate_of(in, times);
    if (!rate) return rate.error();
    return animation_of(*file, counts[0], *rate, start, true);
}

Result<std::string> pc2_header(std::size_t frames, std::size_t points, const fs::path& path) {
    if (Status sound = check_sizes(frames, points, path); !sound) return sound.error();
    std::string header(kPc2Magic);
    append(header, kPc2Version);
    append(header, static_cast<std::int32_t>(points));
    append(header, 0.0f); // the first frame's number in the scene
    append(header, 1.0f); // frames of the scene from one to the next
    append(header, static_cast<std::int32_t>(frames));
    return header;
}

Status write_pc2(const MeshAnimation& animation, const fs::path& path, const RunContext& context) {
    const Result<std::string> header = pc2_header(animation.frames, animation.rest->vertex_count(), path);
    if (!header) return header.error();
    Result<FileWriter> file = FileWriter::create(path);
    if (!file) return file.error();
    if (Status written = file->write(*header); !written) return written;
    return write_frames(*file, animation, false, context);
}

Status write_mdd(const MeshAnimation& animation, const fs::path& path, const RunContext& context) {
    if (Status sound = check_sizes(animation.frames, animation.rest->vertex_count(), path); !sound) return sound;
    Result<FileWriter> file = FileWriter::create(path);
    if (!file) return file.error();
    std::string header;
    append(header, static_cast<std::int32_t>(animation.frames));
    append(header, static_cast<std::int32_t>(animation.rest->vertex_count()));
    constexpr std::size_t kPiece = std::size_t{1} << 16; // bytes
    for (std::size_t frame = 0; frame <= animation.frames; ++frame) {
        if (header.size() >= kPiece || frame == animation.frames) {
            swap_words(header.data(), header.size() / 4);
            if (Status written = file->write(header); !written) return written;
            if (context.is_cancelled()) return cancelled_error();
            header.clear();
        }
        if (frame < animation.frames) append(header, static_cast<float>(double(frame) / animation.frames_per_second));
    }
    return write_frames(*file, animation, true, context);
}

} // namespace filigree
