#include "filigree/render.h"

#include "filigree/io/file.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <sstream>

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

using namespace filigree;
namespace fs = std::filesystem;

namespace {

/// A folder for films, and another for programs that the test puts on the PATH.
class Film : public testing::Test {
protected:
    Film() {
        std::string name = (fs::temp_directory_path() / "filigree-XXXXXX").string();
        root_ = ::mkdtemp(name.data());
        folder_ = root_ / "films";
        fs::create_directories(folder_);
        fs::create_directories(root_ / "programs");
    }
    ~Film() override {
        ::setenv("PATH", path_before_.c_str(), 1);
        fs::remove_all(root_);
    }

    /// Only what the test put there, or nothing, can be found on the PATH.
    void hide_programs() const { ::setenv("PATH", (root_ / "programs").c_str(), 1); }
    /// A line of shell that stands in for ffmpeg. $out is the file that it should write.
    void stand_in(const std::string& line) const {
        const fs::path program = root_ / "programs" / "ffmpeg";
        std::ofstream(program) << "#!/bin/sh\nPATH='" << path_before_ << "'\nfor out; do :; done; out=${out#file:}\n"
                               << line << "\n";
        fs::permissions(program, fs::perms::owner_all);
        hide_programs();
    }
    static bool has_ffmpeg() {
        return std::system("ffmpeg -version > /dev/null 2>&1 && ffprobe -version > /dev/null 2>&1") == 0;
    }

    std::vector<std::string> files() const {
        std::vector<std::string> names;
        for (const auto& entry : fs::directory_iterator(folder_)) names.push_back(entry.path().filename().string());
        std::sort(names.begin(), names.end());
        return names;
    }

    FilmWriter writer(const std::string& name, unsigned width = 16, unsigned height = 12, double rate = 10) const {
        Result<FilmWriter> film = FilmWriter::create(folder_ / name, width, height, rate);
        EXPECT_TRUE(film.ok()) << film.error().message;
        return std::move(film).value();
    }
    void expect_create_fails(const fs::path& path, ErrorCode code, const std::string& words) const {
        const Result<FilmWriter> film = FilmWriter::create(path, 16, 12, 10);
        ASSERT_FALSE(film.ok()) << path;
        EXPECT_EQ(film.error().code, code) << film.error().message;
        EXPECT_NE(film.error().message.find(words), std::string::npos) << film.error().message;
        EXPECT_TRUE(film.error().message.starts_with(path.string())) << film.error().message;
    }

    static std::string output_of(const std::string& command) {
        std::string text;
        FILE* const pipe = ::popen(command.c_str(), "r");
        for (char line[512]; std::fgets(line, sizeof line, pipe);) text += line;
        ::pclose(pipe);
        return text;
    }
    /// What ffprobe counts: "width,height,rate,frames".
    std::string probed(const std::string& name) const {
        return output_of("ffprobe -v error -count_frames -select_streams v -of csv=p=0 -show_entries "
                         "stream=width,height,r_frame_rate,nb_read_frames '" +
                         (folder_ / name).string() + "'");
    }
    /// A frame of a film as a picture; the first is 1.
    Picture frame_of(const std::string& name, unsigned number) const {
        const fs::path png = root_ / "frame.png";
        const std::string command = "ffmpeg -v error -y -i '" + (folder_ / name).string() + "' -vf 'select=eq(n\\," +
                                    std::to_string(number - 1) + ")' -frames:v 1 '" + png.string() + "'";
        EXPECT_EQ(std::system(command.c_str()), 0);
        const Result<Picture> picture = read_picture(png);
        EXPECT_TRUE(picture.ok()) << picture.error().message;
        return picture.ok() ? *picture : Picture();
    }

    fs::path root_, folder_;
    std::string path_before_ = std::getenv("PATH");
};

/// A smooth picture that changes from frame to frame.
Picture picture(unsigned width, unsigned height, unsigned number) {
    Picture result(width, height);
    for (unsigned y = 0; y < height; ++y)
        for (unsigned x = 0; x < width; ++x) {
            std::uint8_t* const pixel = result.pixel(x, y);
            pixel[0] = static_cast<std::uint8_t>(40 + 160 * x / width);
            pixel[1] = static_cast<std::uint8_t>(40 + 160 * y / height);
            pixel[2] = static_cast<std::uint8_t>(40 + 30 * number % 200);
            pixel[3] = 255;
        }
    return result;
}

void add(FilmWriter& film, unsigned width, unsigned height, unsigned count) {
    for (unsigned i = 1; i <= count; ++i) {
        const Status status = film.add(picture(width, height, i));
        ASSERT_TRUE(status.ok()) << status.error().message;
        EXPECT_EQ(film.frame_count(), i);
    }
}

void expect_no_children() { EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1); }

} // namespace

TEST(FilmPath, IsToldByTheName) {
    for (const char* const name :
         {"a.mp4", "A.MP4", "a.gif", "%d.png", "frame_%04d.png", "f%09d.PNG", "50%/a.mp4", "%/a%d.png"})
        EXPECT_TRUE(is_film_path(name)) << name;
    for (const char* const name : {"", "a", "a.png", "a.avi", ".mp4", "a%s.png", "a%d%d.png", "a%.png", "a%4d.png",
                                   "a%0d.png", "a%00d.png", "a%012d.png", "a%%d.png", "%d", "%d/a.png", "a%04.png"})
        EXPECT_FALSE(is_film_path(name)) << name;
}

TEST_F(Film, NumberedPicturesNeedNoOtherProgram) {
    hide_programs();
    FilmWriter film = writer("frame_%03d.png", 5, 4);
    add(film, 5, 4, 11);
    for (const std::string& name : files()) EXPECT_EQ(name[0], '.'); // nothing stands there before the end
    EXPECT_EQ(files().size(), 1u);
    ASSERT_TRUE(film.finish().ok());
    EXPECT_EQ(files().front(), "frame_001.png");
    EXPECT_EQ(files().back(), "frame_011.png");
    for (const unsigned i : {1u, 11u}) {
        const Result<Picture> back = read_picture(folder_ / (i == 1 ? "frame_001.png" : "frame_011.png"));
        ASSERT_TRUE(back.ok());
        EXPECT_EQ(back->rgba, picture(5, 4, i).rgba);
    }
    EXPECT_FALSE(film.finish().ok());
    EXPECT_FALSE(film.add(picture(5, 4, 12)).ok());
    EXPECT_EQ(files().size(), 11u);
}

TEST_F(Film, AWriterThatGoesAwayTakesItsFilesWithIt) {
    std::ofstream(folder_ / "2.png") << "old";
    {
        FilmWriter film = writer("%d.png");
        add(film, 16, 12, 3);
        FilmWriter moved = std::move(film);
        add(moved, 16, 12, 0);
    }
    EXPECT_EQ(files(), std::vector<std::string>{"2.png"});
    EXPECT_EQ(*read_file(folder_ / "2.png"), "old");
}

TEST_F(Film, AFolderInTheWayIsFoundBeforeAnythingIsReplaced) {
    FilmWriter film = writer("%d.png");
    add(film, 16, 12, 3);
    fs::create_directories(folder_ / "3.png");
    const Status status = film.finish();
    ASSERT_FALSE(status.ok());
    EXPECT_EQ(status.error().code, ErrorCode::unwritable);
    EXPECT_EQ(files(), std::vector<std::string>{"3.png"});
}

TEST_F(Film, AFailedFilmLeavesThePicturesOfAnEarlierOne) {
    for (const char* name : {"1.png", "2.png", "3.png"}) std::ofstream(folder_ / name) << "old";
    FilmWriter film = writer("%d.png");
    add(film, 16, 12, 3);
    fs::remove(folder_ / "3.png");
    fs::create_symlink("1.png", folder_ / "3.png"); // links are not replaced, nor what they lead to
    const Status status = film.finish();
    ASSERT_FALSE(status.ok());
    EXPECT_EQ(status.error().code, ErrorCode::unwritable);
    EXPECT_EQ(files(), (std::vector<std::string>{"1.png", "2.png", "3.png"}));
    EXPECT_EQ(*read_file(folder_ / "1.png"), "old");
    EXPECT_EQ(*read_file(folder_ / "2.png"), "old");
}

TEST_F(Film, ALinkToNothingYetIsFollowed) {
    stand_in("cat > \"$out\"");
    fs::create_directories(folder_ / "elsewhere");
    fs::create_symlink("elsewhere/born.mp4", folder_ / "link.mp4");
    FilmWriter film = writer("link.mp4");
    add(film, 16, 12, 1);
    ASSERT_TRUE(film.finish().ok());
    EXPECT_TRUE(fs::is_symlink(folder_ / "link.mp4"));
    EXPECT_EQ(fs::file_size(folder_ / "elsewhere/born.mp4"), 16u * 12 * 3);
    fs::create_symlink("circle.mp4", folder_ / "circle.mp4");
    expect_create_fails(folder_ / "circle.mp4", ErrorCode::unwritable, "circle");
}

TEST_F(Film, OddRequestsAreRefused) {
    expect_create_fails(folder_ / "film.avi", ErrorCode::usage, ".mp4");
    expect_create_fails(folder_ / "film.png", ErrorCode::usage, "frame_%04d.png");
    expect_create_fails(folder_ / "missing" / "%d.png", ErrorCode::unwritable, "no such");
    expect_create_fails(folder_ / "missing" / "a.mp4", ErrorCode::unwritable, "no such");
    fs::create_directories(folder_ / "folder.mp4");
    expect_create_fails(folder_ / "folder.mp4", ErrorCode::unwritable, "folder");
    ASSERT_EQ(::mkfifo((folder_ / "pipe.gif").c_str(), 0600), 0);
    expect_create_fails(folder_ / "pipe.gif", ErrorCode::unwritable, "pipe");
    for (const double rate : {0.0, -1.0, 1e9, std::nan("")})
        EXPECT_FALSE(FilmWriter::create(folder_ / "%d.png", 4, 4, rate).ok());
    EXPECT_FALSE(FilmWriter::create(folder_ / "%d.png", 0, 4, 10).ok());
    EXPECT_EQ(files(), (std::vector<std::string>{"folder.mp4", "pipe.gif"}));
}

TEST_F(Film, APictureOfAnotherSizeDoesNotFit) {
    FilmWriter film = writer("%d.png");
    const Status status = film.add(picture(16, 13, 1));
    ASSERT_FALSE(status.ok());
    EXPECT_EQ(status.error().code, ErrorCode::mismatch);
    add(film, 16, 12, 1); // and the film goes on
    EXPECT_TRUE(film.finish().ok());
    FilmWriter empty = writer("e%d.png");
    EXPECT_EQ(empty.finish().error().code, ErrorCode::unsuitable);
}

TEST_F(Film, WithoutFfmpegItSaysWhatToDo) {
    hide_programs();
    for (const char* const name : {"film.mp4", "film.gif"})
        expect_create_fails(
            folder_ / name, ErrorCode::unsupported,
            "ffmpeg is not installed; apt-get install ffmpeg, or write numbered pictures (frame_%04d.png)");
    EXPECT_TRUE(files().empty());
    expect_no_children();
}

TEST_F(Film, WhenFfmpegFailsItsOwnWordsSayWhy) {
    // At once, in the middle, at the end, and silently; the first line is the cause.
    for (const std::string line : {"echo '[mp4 @ 0x55] No space left.' >&2; echo 'Conversion failed!' >&2; exit 1",
                                   "head -c 100000 > /dev/null; echo 'No space left' >&2; exit 1",
                                   "cat > /dev/null; echo 'No space left' >&2; exit 1", "cat > /dev/null; exit 3",
                                   "cat > \"$out\"; kill -9 $$"}) {
        SCOPED_TRACE(line);
        stand_in(line);
        std::ofstream(folder_ / "film.mp4") << "old";
        FilmWriter film = writer("film.mp4", 200, 200);
        Status status = Success{};
        for (int i = 0; i < 20 && status; ++i) status = film.add(picture(200, 200, 1));
        if (status) status = film.finish();
        ASSERT_FALSE(status.ok());
        EXPECT_EQ(status.error().code, ErrorCode::unwritable);
        const std::string cause = line.find("echo") == std::string::npos ? "ffmpeg ended before the film did."
                                                                         : "ffmpeg says 'No space left'.";
        EXPECT_EQ(status.error().message, (folder_ / "film.mp4").string() + ": cannot be written: " + cause);
        EXPECT_EQ(film.finish().error().message, status.error().message);
        EXPECT_EQ(files(), std::vector<std::string>{"film.mp4"});
        EXPECT_EQ(*read_file(folder_ / "film.mp4"), "old");
        expect_no_children();
    }
}

TEST_F(Film, AChattyFfmpegIsHeardWhileItIsFed) {
    stand_in("head -c 1000000 /dev/zero | tr '\\0' x >&2; cat > \"$out\""); // more than a pipe holds
    FilmWriter film = writer("film.mp4", 300, 300);
    add(film, 300, 300, 10);
    ASSERT_TRUE(film.finish().ok());
    EXPECT_EQ(fs::file_size(folder_ / "film.mp4"), 10u * 300 * 300 * 3);
    EXPECT_EQ(files(), std::vector<std::string>{"film.mp4"});
}

TEST_F(Film, FfmpegIsStoppedWithTheWriter) {
    stand_in("echo half > \"$out\"; exec sleep 100");
    { FilmWriter film = writer("film.gif"); }
    EXPECT_TRUE(files().empty());
    expect_no_children();
}

TEST_F(Film, PixelsAreSentOverWhiteWithTheLastRowAndColumnRepeated) {
    stand_in("cat > \"$out\"");
    Picture odd(1, 3);
    odd.rgba = {10, 20, 30, 255, 0, 0, 0, 0, 200, 100, 0, 127};
    FilmWriter film = writer("film.mp4", 1, 3);
    ASSERT_TRUE(film.add(odd).ok());
    ASSERT_TRUE(film.finish().ok());
    const unsigned char expected[] = {
        10,  20,  30,  10,  20,  30,  255, 255, 255, 255, 255, 255, // two columns, four rows
        228, 178, 128, 228, 178, 128, 228, 178, 128, 228, 178, 128};
    EXPECT_EQ(*read_file(folder_ / "film.mp4"), std::string(std::begin(expected), std::end(expected)));
}

TEST_F(Film, Mp4HoldsEveryFrame) {
    if (!has_ffmpeg()) GTEST_SKIP() << "needs ffmpeg";
    FilmWriter film = writer("film.mp4", 64, 48, 25);
    add(film, 64, 48, 7);
    ASSERT_TRUE(film.finish().ok());
    EXPECT_EQ(files(), std::vector<std::string>{"film.mp4"});
    EXPECT_EQ(probed("film.mp4"), "64,48,25/1,7\n");
    for (const unsigned number : {1u, 7u})
        EXPECT_LT(picture_distance(frame_of("film.mp4", number), picture(64, 48, number)), 4);
    const std::string bytes = *read_file(folder_ / "film.mp4");
    EXPECT_LT(bytes.find("moov"), bytes.find("mdat")); // it starts before it is loaded
}

TEST_F(Film, Mp4OfOddSizesAndRatesPlays) {
    if (!has_ffmpeg()) GTEST_SKIP() << "needs ffmpeg";
    FilmWriter film = writer("odd size.mp4", 33, 17, 12.5);
    add(film, 33, 17, 3);
    ASSERT_TRUE(film.finish().ok());
    EXPECT_EQ(probed("odd size.mp4"), "34,18,25/2,3\n");
    const Picture back = frame_of("odd size.mp4", 2), sent = picture(33, 17, 2);
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(back.pixel(33, 17)[i], sent.pixel(32, 16)[i], 16); // no dark edge
}

TEST_F(Film, GifHoldsEveryFrameInColorsOfItsOwn) {
    if (!has_ffmpeg()) GTEST_SKIP() << "needs ffmpeg";
    FilmWriter film = writer("film.gif", 33, 17, 10);
    add(film, 33, 17, 4);
    ASSERT_TRUE(film.finish().ok());
    EXPECT_EQ(files(), std::vector<std::string>{"film.gif"});
    EXPECT_EQ(probed("film.gif"), "33,17,10/1,4\n");
    EXPECT_LT(picture_distance(frame_of("film.gif", 3), picture(33, 17, 3)), 12);
}

TEST_F(Film, TheSameFramesGiveTheSameBytes) {
    if (!has_ffmpeg()) GTEST_SKIP() << "needs ffmpeg";
    for (const std::string ending : {".mp4", ".gif"}) {
        for (const std::string name : {"a", "b"}) {
            FilmWriter film = writer(name + ending, 48, 32);
            add(film, 48, 32, 5);
            ASSERT_TRUE(film.finish().ok());
        }
        EXPECT_EQ(*read_file(folder_ / ("a" + ending)), *read_file(folder_ / ("b" + ending)));
    }
}

TEST_F(Film, AFilmReplacesAnOldOneThroughItsLink) {
    stand_in("cat > \"$out\"");
    std::ofstream(folder_ / "real.mp4") << "old";
    fs::permissions(folder_ / "real.mp4", fs::perms::owner_read | fs::perms::owner_write);
    fs::create_symlink("real.mp4", folder_ / "link.mp4");
    FilmWriter film = writer("link.mp4");
    add(film, 16, 12, 1);
    ASSERT_TRUE(film.finish().ok());
    EXPECT_TRUE(fs::is_symlink(folder_ / "link.mp4"));
    EXPECT_EQ(fs::file_size(folder_ / "real.mp4"), 16u * 12 * 3);
    EXPECT_EQ(fs::status(folder_ / "real.mp4").permissions(), fs::perms::owner_read | fs::perms::owner_write);
}
