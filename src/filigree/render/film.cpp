#include "filigree/render.h"

#include "filigree/io/system/extension.h"
#include "filigree/io/system/file.h"
#include "filigree/io/system/file_batch.h"
#include "filigree/io/system/file_descriptor.h"
#include "filigree/io/system/file_error.h"
#include "filigree/io/system/numbered_name.h"
#include "filigree/io/system/platform.h"
#include "filigree/io/system/temporary_file.h"
#include "filigree/render/child_process.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <optional>
#include <sstream>
#include <system_error>

namespace filigree {

namespace {

namespace fs = std::filesystem;

#if defined(_WIN32)
constexpr const char* kHowToInstallFfmpeg = "put ffmpeg.exe into a folder that PATH names";
#else
constexpr const char* kHowToInstallFfmpeg = "apt-get install ffmpeg";
#endif

enum class FilmKind { none, mp4, gif, numbered };

FilmKind film_kind(const fs::path& path) {
    const std::string extension = lower_extension(path);
    if (extension == ".mp4") return FilmKind::mp4;
    if (extension == ".gif") return FilmKind::gif;
    return extension == ".png" && printf_numbered_name(path) ? FilmKind::numbered : FilmKind::none;
}

/// The shortest text that stands for the number, in every locale.
std::string number_text(double number) {
    char text[32];
    return std::string(text, std::to_chars(text, text + sizeof text, number).ptr);
}

/// The bytes of ffmpeg's film beside its place: gone at the end, unless it is put there.
class TemporaryFile {
public:
    /// Empty. Messages name `target`, which may be a link: the film replaces what it leads to.
    static Result<TemporaryFile> create(const fs::path& target) {
        fs::path real = follow_links(target);
        std::error_code ignored;
        if (fs::is_symlink(real, ignored)) return cannot_write(target, ELOOP);
        fs::path path;
        FileDescriptor owner(create_beside(real, path));
        if (!owner.is_open()) return cannot_write(target, errno);
        return TemporaryFile(std::move(path), std::move(real), std::move(owner));
    }
    TemporaryFile(TemporaryFile&& other) noexcept
        : path_(std::exchange(other.path_, {})), real_target_(std::move(other.real_target_)),
          owner_(std::move(other.owner_)) {}
    TemporaryFile& operator=(TemporaryFile&& other) noexcept {
        std::swap(path_, other.path_);
        std::swap(real_target_, other.real_target_);
        owner_ = std::move(other.owner_);
        return *this;
    }
    ~TemporaryFile() {
        if (!path_.empty()) platform::remove_file(path_);
    }

    const fs::path& path() const { return path_; }

    /// 0 or the error number.
    int put_in_place() {
        std::error_code failed;
        const fs::file_status existing = fs::status(real_target_, failed);
        if (fs::is_regular_file(existing)) fs::permissions(path_, existing.permissions(), failed); // best effort
        if (const int error = platform::rename(path_, real_target_)) return error;
        path_.clear();
        platform::flush_folder(real_target_.parent_path());
        return 0;
    }

private:
    TemporaryFile(fs::path path, fs::path real_target, FileDescriptor owner)
        : path_(std::move(path)), real_target_(std::move(real_target)), owner_(std::move(owner)) {}
    fs::path path_, real_target_;
    FileDescriptor owner_; ///< tells other writers that the file is ours
};

/// The first line of ffmpeg's complaint, which names the cause; those after it name what followed from it.
std::string first_line(const std::string& complaint) {
    constexpr std::size_t kLongest = 200;
    const std::size_t start = std::min(complaint.find_first_not_of("\r\n"), complaint.size());
    std::string line = complaint.substr(start, complaint.find_first_of("\r\n", start) - start);
    if (line.starts_with('[') && line.find("] ") != std::string::npos)
        line.erase(0, line.find("] ") + 2); // [mp4 @ 0x5..]
    if (line.size() > kLongest) line = line.substr(0, kLongest) + "...";
    for (char& c : line)
        if (static_cast<unsigned char>(c) < ' ' || c == '\x7f') c = '?';
    while (!line.empty() && (line.back() == '.' || line.back() == ' ')) line.pop_back();
    return line;
}

std::vector<std::string> ffmpeg_command(FilmKind kind, unsigned width, unsigned height, double frames_per_second,
                                        const fs::path& output) {
    // The same number of threads everywhere, as x264's output depends on it. The colours are sRGB and say so.
    constexpr std::string_view kMp4 =
        "-threads 8 -vf scale=out_color_matrix=bt709:out_range=tv:flags=bicubic+accurate_rnd+full_chroma_int "
        "-c:v libx264 -crf 17 -pix_fmt yuv420p -colorspace bt709 -color_primaries bt709 -color_trc iec61966-2-1 "
        "-color_range tv -movflags +faststart -f mp4";
    constexpr std::string_view kGif =
        "-filter_complex split[all][shown];[all]palettegen=reserve_transparent=0[palette];"
        "[shown][palette]paletteuse=diff_mode=rectangle -loop 0 -f gif";
    std::istringstream line("ffmpeg -hide_banner -nostdin -nostats -loglevel error -y "
                            "-f rawvideo -pix_fmt rgb24 -video_size " +
                            std::to_string(width) + "x" + std::to_string(height) + " -framerate " +
                            number_text(frames_per_second) +
                            " -i pipe:0 -map_metadata -1 -fflags +bitexact -flags:v +bitexact " +
                            std::string(kind == FilmKind::mp4 ? kMp4 : kGif));
    std::vector<std::string> words;
    for (std::string word; line >> word;) words.push_back(word);
    words.push_back("file:" + output.string()); // whatever the name holds, it is no option and no protocol
    return words;
}

/// Red, green and blue over white; the last row and column repeated up to the size asked for.
void pack_over_white(const Picture& picture, unsigned width, unsigned height, std::string& rgb) {
    rgb.resize(std::size_t{3} * width * height);
    char* to = rgb.data();
    for (unsigned y = 0; y < height; ++y) {
        const std::uint8_t* const row = picture.pixel(0, std::min(y, picture.height - 1));
        for (unsigned x = 0; x < width; ++x) {
            const std::uint8_t* const from = row + std::size_t{4} * std::min(x, picture.width - 1);
            const unsigned alpha = from[3];
            for (int i = 0; i < 3; ++i) *to++ = static_cast<char>((from[i] * alpha + 255 * (255 - alpha) + 127) / 255);
        }
    }
}

/// Where frames go, one after the other.
class FrameSink {
public:
    virtual ~FrameSink() = default;
    virtual Status add(const Picture& frame) = 0;
    virtual Status finish() = 0;
};

class NumberedPictures : public FrameSink {
public:
    NumberedPictures(NumberedName name, FileBatch files) : name_(std::move(name)), files_(std::move(files)) {}

    Status add(const Picture& frame) override {
        const fs::path target = name_.file(next_++), file = files_.path(target.filename().string());
        if (Status free = files_.check_place(target.filename().string()); !free) return free;
        const Status written = write_file(file, encode_png(frame));
        return written ? written : renamed(written.error(), file, target);
    }

    Status finish() override { return files_.finish(); }

private:
    NumberedName name_;
    FileBatch files_;
    std::size_t next_ = 1;
};

class EncodedFilm : public FrameSink {
public:
    EncodedFilm(fs::path target, TemporaryFile file) : target_(std::move(target)), file_(std::move(file)) {}

    Status start(FilmKind kind, unsigned width, unsigned height, double frames_per_second) {
        const unsigned multiple = kind == FilmKind::mp4 ? 2 : 1; // yuv420p keeps colour for blocks of two by two
        padded_width_ = (width + multiple - 1) / multiple * multiple;
        padded_height_ = (height + multiple - 1) / multiple * multiple;
        const int failed =
            ffmpeg_.start(ffmpeg_command(kind, padded_width_, padded_height_, frames_per_second, file_.path()));
        if (failed == ENOENT || failed == EACCES || failed == ENOTDIR)
            return Error{ErrorCode::unsupported, target_.string() + ": ffmpeg is not installed; " +
                                                     kHowToInstallFfmpeg +
                                                     ", or write numbered pictures (frame_%04d.png)."};
        if (failed) return cannot_write(target_, "ffmpeg cannot be started (error " + std::to_string(failed) + ")");
        return Success{};
    }

    Status add(const Picture& frame) override {
        pack_over_white(frame, padded_width_, padded_height_, rgb_);
        if (ffmpeg_.send(rgb_)) return Success{};
        ffmpeg_.finish();
        return failure();
    }

    Status finish() override {
        if (!ffmpeg_.finish()) return failure();
        FileDescriptor film(platform::open_to_write(file_.path()));
        if (!film.is_open() || platform::flush(film.get()) != 0) return cannot_write(target_, "the disk failed");
        film.close();
        if (const int failed = file_.put_in_place()) return cannot_write(target_, failed);
        return Success{};
    }

private:
    Error failure() const {
        const std::string line = first_line(ffmpeg_.complaint());
        if (line.empty()) return cannot_write(target_, "ffmpeg ended before the film did");
        return cannot_write(target_, "ffmpeg says '" + line + "'");
    }

    fs::path target_;
    TemporaryFile file_;
    ChildProcess ffmpeg_; // below the file, so that it ends before the file is removed
    unsigned padded_width_ = 0, padded_height_ = 0;
    std::string rgb_;
};

} // namespace

bool is_film_path(const fs::path& path) { return film_kind(path) != FilmKind::none; }

struct FilmWriter::Content {
    std::string name; ///< in messages
    unsigned width, height;
    std::unique_ptr<FrameSink> sink;
    unsigned frame_count = 0;
    std::optional<Error> end = {}; ///< what every call gets once the film is finished or has failed

    void end_with(Error error) {
        end = std::move(error);
        sink.reset(); // with its temporary files
    }
};

FilmWriter::FilmWriter(std::unique_ptr<Content> content) : content_(std::move(content)) {}
FilmWriter::FilmWriter(FilmWriter&&) noexcept = default;
FilmWriter& FilmWriter::operator=(FilmWriter&&) noexcept = default;
FilmWriter::~FilmWriter() = default;

Result<FilmWriter> FilmWriter::create(const fs::path& path, unsigned width, unsigned height, double frames_per_second) {
    const FilmKind kind = film_kind(path);
    if (kind == FilmKind::none)
        return Error{ErrorCode::usage, path.string() +
                                           ": is no film's name; end it in .mp4 or .gif, or number pictures "
                                           "with one %d (frame_%04d.png)."};
    if (width == 0 || height == 0) return Error{ErrorCode::usage, path.string() + ": a film without pixels."};
    constexpr double kMostFramesPerSecond = 1000;
    if (!(frames_per_second > 0 && frames_per_second <= kMostFramesPerSecond))
        return Error{ErrorCode::usage, path.string() + ": " + number_text(frames_per_second) +
                                           " frames a second make no film; choose from just above 0 to " +
                                           number_text(kMostFramesPerSecond) + "."};
    std::error_code ignored;
    if (fs::is_directory(path, ignored)) return cannot_write(path, "it is a folder");
    if (fs::exists(path, ignored) && !fs::is_regular_file(path, ignored))
        return cannot_write(path, "it is a device or pipe, and films need a file");
    if (fs::exists(path, ignored) && platform::refused_writing(path) != 0)
        return cannot_write(path, "permission is denied");

    // Whether the folder takes files is told at once.
    auto content = std::make_unique<Content>(Content{path.string(), width, height, nullptr});
    if (kind == FilmKind::numbered) {
        Result<FileBatch> files = FileBatch::create(path.parent_path());
        if (!files) return renamed(files.error(), path.parent_path().empty() ? "." : path.parent_path(), path);
        content->sink = std::make_unique<NumberedPictures>(*printf_numbered_name(path), std::move(*files));
    } else {
        Result<TemporaryFile> file = TemporaryFile::create(path);
        if (!file) return file.error();
        auto film = std::make_unique<EncodedFilm>(path, std::move(file).value());
        if (const Status started = film->start(kind, width, height, frames_per_second); !started)
            return started.error();
        content->sink = std::move(film);
    }
    return FilmWriter(std::move(content));
}

Status FilmWriter::add(const Picture& frame) {
    if (content_->end) return *content_->end;
    if (frame.width != content_->width || frame.height != content_->height)
        return Error{ErrorCode::mismatch, content_->name + ": a picture of " + std::to_string(frame.width) + " x " +
                                              std::to_string(frame.height) + " pixels does not fit a film of " +
                                              std::to_string(content_->width) + " x " +
                                              std::to_string(content_->height) + "."};
    const Status status = content_->sink->add(frame);
    if (status)
        ++content_->frame_count;
    else
        content_->end_with(status.error());
    return status;
}

Status FilmWriter::finish() {
    if (content_->end) return *content_->end;
    const std::string& name = content_->name;
    const Status status = content_->frame_count > 0
                              ? content_->sink->finish()
                              : Status(Error{ErrorCode::unsuitable, name + ": a film needs at least one picture."});
    content_->end_with(status ? Error{ErrorCode::usage, name + ": the film is finished already."} : status.error());
    return status;
}

unsigned FilmWriter::frame_count() const { return content_->frame_count; }

} // namespace filigree
