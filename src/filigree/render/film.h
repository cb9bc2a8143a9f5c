// Films: pictures one after the other into an .mp4, a .gif, or numbered PNG files.
#pragma once

#include "filigree/core/run_context.h"
#include "filigree/render/picture.h"

#include <filesystem>
#include <memory>

namespace filigree {

/// Whether a name stands for a film: .mp4, .gif, or a .png whose name holds a number pattern ("frame_%04d.png").
bool is_film_path(const std::filesystem::path& path);

/// Writes a film frame by frame. Nothing stands at `path` until finish(); a writer that goes away before takes its
/// unfinished files (temporary ones beside the target) and the ffmpeg that it started with it, also when it was
/// cancelled. Numbers of pictures count from 1. Transparent parts of .mp4 and .gif become white. A symbolic link to a
/// film is followed; numbered pictures replace files, but no links (io/file_batch.h says what holds when the process is
/// killed). A killed process leaves `.filigree-X.tmp` of an .mp4 or .gif, which may be deleted.
class FilmWriter {
public:
    /// .mp4 (H.264, yuv420p; odd sizes are padded by a row or column of the last pixel) and .gif (a palette of its own)
    /// need the program ffmpeg; numbered PNGs do not. A .gif is kept in memory (by ffmpeg) until its palette is known.
    /// Errors: usage (no film's name, no pixels, no such rate), unsupported (ffmpeg is missing: says what to install),
    /// unwritable.
    static Result<FilmWriter> create(const std::filesystem::path& path, unsigned width, unsigned height,
                                     double frames_per_second);
    FilmWriter(FilmWriter&&) noexcept;
    FilmWriter& operator=(FilmWriter&&) noexcept;
    ~FilmWriter();

    /// Errors: mismatch (another size), unwritable (disk full, ffmpeg failed: with its last words).
    Status add(const Picture& frame);
    /// Puts the film in place: all numbered pictures or none. Errors: unsuitable (no frames), unwritable.
    Status finish();

    unsigned frame_count() const;

private:
    struct Content;
    explicit FilmWriter(std::unique_ptr<Content> content);
    std::unique_ptr<Content> content_;
};

} // namespace filigree
