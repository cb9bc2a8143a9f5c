// filigree render, and compare --picture, as a user runs them.
#include "apps/program.h"

#include "filigree/render.h"

#include <algorithm>
#include <cmath>

using namespace filigree_test;
using filigree::Picture;

namespace {

/// A square of four quads in the plane z = 0 with one scalar a vertex.
const std::string kSquare = "ply\nformat ascii 1.0\nelement vertex 9\nproperty float x\nproperty float y\n"
                            "property float z\nproperty float quality\nelement face 4\n"
                            "property list uchar int vertex_indices\nend_header\n"
                            "0 0 0 0\n1 0 0 1\n2 0 0 2\n0 1 0 3\n1 1 0 4\n2 1 0 5\n0 2 0 6\n1 2 0 7\n2 2 0 8\n"
                            "4 0 1 4 3\n4 1 2 5 4\n4 3 4 7 6\n4 4 5 8 7\n";
const std::string kPoints = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
                            "property float z\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n";

class Render : public Program {
protected:
    void SetUp() override {
        write("square.ply", kSquare);
        const Ran ran = run(quick("square.ply", "first.png"));
        if (ran.code == 5 && ran.err.find("No OpenGL") != std::string::npos) GTEST_SKIP() << ran.err;
        ASSERT_EQ(ran.code, 0) << ran.err;
        std::filesystem::remove(path("first.png"));
    }

    /// The words of a small picture in one pass.
    static std::vector<std::string> quick(const std::string& input, const std::string& output,
                                          const std::vector<std::string>& more = {}) {
        std::vector<std::string> words = {"render", input, "-o", output, "--passes", "1"};
        if (std::find(more.begin(), more.end(), "--size") == more.end()) words.insert(words.end(), {"--size", "64x48"});
        words.insert(words.end(), more.begin(), more.end());
        return words;
    }
    Picture picture(const std::string& name) const {
        const filigree::Result<Picture> read = filigree::read_picture(path(name));
        EXPECT_TRUE(read.ok()) << (read.ok() ? "" : read.error().message);
        return read.ok() ? *read : Picture();
    }
    Picture drawn(const std::string& input, const std::vector<std::string>& more = {}) const {
        ok(quick(input, "drawn.png", more));
        Picture result = picture("drawn.png");
        std::filesystem::remove(path("drawn.png"));
        return result;
    }
    void make_cube() const {
        ok({"make", "wavy-cube", "-o", "cube.ply", "--resolution", "12", "--frequency", "1"});
        ok({"strip", "cube.ply", "-o", "cube.fil"});
        ok({"level", "cube.fil", "0", "-o", "driver.ply"});
        ok({"deform", "driver.ply", "-o", "bent.ply", "--bend", "90"});
        ok({"deform", "driver.ply", "-o", "twisted.ply", "--twist", "90"});
    }
    static bool has_ffmpeg() { return std::system("ffmpeg -version > /dev/null 2>&1") == 0; }

    /// Fails, and leaves nothing behind.
    void refused(int code, const std::vector<std::string>& arguments, const std::vector<std::string>& words) const {
        std::vector<std::string> before = files();
        fails(code, arguments, words);
        std::vector<std::string> after = files();
        std::sort(before.begin(), before.end());
        std::sort(after.begin(), after.end());
        EXPECT_EQ(before, after) << testing::PrintToString(arguments);
    }
};

/// Whether anything differs from what a picture without an object would be.
bool shows_something(const Picture& with, const Picture& other) { return picture_distance(with, other) > 3; }

} // namespace

TEST_F(Render, DrawsMeshesPointSetsAndModels) {
    make_cube();
    write("points.ply", kPoints);
    const Ran ran = ok(quick("cube.ply", "cube.png", {"--size", "80x60"}));
    EXPECT_TRUE(ran.out.starts_with("cube.png: 80 by 60 pixels in ")) << ran.out;
    const Picture mesh = picture("cube.png");
    EXPECT_EQ(mesh.width, 80u);
    EXPECT_EQ(mesh.height, 60u);
    EXPECT_LT(picture_distance(drawn("cube.fil", {"--size", "80x60"}), mesh), 1); // the model at rest is the mesh
    EXPECT_GT(picture_distance(drawn("cube.fil", {"--size", "80x60", "--level", "0"}), mesh), 0.1);
    EXPECT_TRUE(shows_something(drawn("points.ply"), drawn("square.ply")));
    EXPECT_TRUE(shows_something(drawn("cube.ply", {"--points"}), drawn("cube.ply")));

    const Json info = json(quick("cube.fil", "again.png"));
    EXPECT_EQ(info["output"], "again.png");
    EXPECT_EQ(info["width"], 64);
    EXPECT_EQ(info["height"], 48);
    EXPECT_EQ(info["frames"], 1);
    EXPECT_EQ(info["triangles"], 2 * 6 * 12 * 12);
    EXPECT_EQ(info["points"], 0);
    EXPECT_FALSE(info["renderer"].get<std::string>().empty());
    EXPECT_EQ(json(quick("points.ply", "again.png"))["points"], 4);
    const Ran quiet = ok(quick("cube.ply", "quiet.png", {"--quiet"}));
    EXPECT_EQ(quiet.out + quiet.err, "");
    const Ran piped = ok(quick("-", "piped.png"), path("square.ply"));
    EXPECT_EQ(bytes_of(path("piped.png")).substr(1, 3), "PNG");
}

TEST_F(Render, SurfelsLookLikeTheirSurface) {
    ok({"make", "wavy-sphere", "-o", "ball.ply", "--resolution", "64", "--quiet"});
    ok({"strip", "ball.ply", "-o", "ball.fil", "--quiet"});
    const Picture mesh = drawn("ball.ply", {"--size", "200x150"});
    EXPECT_LT(picture_distance(drawn("ball.ply", {"--as", "surfels", "--size", "200x150"}), mesh), 12);
    EXPECT_LT(picture_distance(drawn("ball.fil", {"--as", "surfels", "--size", "200x150"}), mesh), 12);
    ok({"level", "ball.fil", "0", "-o", "driver.ply", "--quiet"});
    ok({"deform", "driver.ply", "-o", "moved.ply", "--bend", "90", "--axis", "z", "--quiet"});
    ok({"restore", "ball.fil", "--pose", "moved.ply", "-o", "bent.ply", "--quiet"});
    ok({"restore", "ball.fil", "--pose", "moved.ply", "--surfels", "-o", "surfels.ply", "--quiet"});
    EXPECT_LT(picture_distance(drawn("surfels.ply", {"--as", "surfels", "--size", "200x150"}),
                               drawn("bent.ply", {"--size", "200x150"})),
              14);
    write("points.ply", kPoints);
    const Ran points = run(quick("points.ply", "none.png", {"--as", "surfels"})); // a warning, and why not
    EXPECT_EQ(points.code, 7);
    EXPECT_NE(points.err.find("neither faces to make surfels of nor surfels"), std::string::npos) << points.err;
    fails(2, quick("ball.ply", "none.png", {"--as", "surfels", "--edges"}), {"--edges"});
    fails(2, {"restore", "ball.fil", "--frames", "--surfels", "-o", "x/"}, {"--surfels", "one moment"});
}

TEST_F(Render, SameBytesWhateverTheThreads) {
    make_cube();
    ok(quick("cube.ply", "one.png", {"--threads", "1"}));
    ok(quick("cube.ply", "many.png", {"--threads", "8"}));
    EXPECT_EQ(bytes_of(path("one.png")), bytes_of(path("many.png")));
}

TEST_F(Render, LooksAreAskedFor) {
    make_cube();
    const Picture plain = drawn("cube.ply");
    for (const std::vector<std::string>& look :
         std::vector<std::vector<std::string>>{{"--edges"},
                                               {"--wireframe"},
                                               {"--edges", "--edge-color", "#ff0000"},
                                               {"--color", "#204080"},
                                               {"--shading", "flat", "--color", "#a05050"},
                                               {"--no-ground"},
                                               {"--background", "#ffd0a0"},
                                               {"--background", "#000000,#ffffff"},
                                               {"--view", "front"},
                                               {"--view", "top"},
                                               {"--up", "z"},
                                               {"--field-of-view", "0"},
                                               {"--camera", "-1", "-2", "3", "0", "0", "0"},
                                               {"--camera=3,1,1,0,0,0,0,0,1"},
                                               {"--clip", "y=0.5"},
                                               {"--clip", "-y=0.5"},
                                               {"--points", "--point-radius", "0.02"}})
        EXPECT_GT(picture_distance(drawn("cube.ply", look), plain), 0.5) << testing::PrintToString(look);
    const Picture transparent = drawn("cube.ply", {"--background", "transparent"});
    EXPECT_EQ(transparent.pixel(0, 0)[3], 0);
    EXPECT_EQ(transparent.pixel(32, 24)[3], 255);
    const Picture red = drawn("cube.ply", {"--color", "#d02010"});
    EXPECT_GT(red.pixel(32, 24)[0], red.pixel(32, 24)[1] + 40);
}

TEST_F(Render, ClippingKeepsOneHalfOrTheOther) {
    const auto covered = [&](const std::string& clip) {
        std::vector<std::string> more = {"--background", "transparent", "--no-ground", "--view", "front"};
        if (!clip.empty()) more.insert(more.end(), {"--clip", clip});
        const Picture picture = drawn("square.ply", more);
        double area = 0;
        for (std::size_t i = 3; i < picture.rgba.size(); i += 4) area += picture.rgba[i] / 255.0;
        return area;
    };
    const double whole = covered("");
    EXPECT_NEAR(covered("x=0.5"), 0.5 * whole, 0.03 * whole);
    EXPECT_NEAR(covered("x=0.25"), 0.25 * whole, 0.03 * whole);
    EXPECT_NEAR(covered("-x=0.25"), 0.75 * whole, 0.03 * whole);
    EXPECT_NEAR(covered("y=1e0"), whole, 0.03 * whole);
    EXPECT_EQ(covered("x=-1"), 0);
    EXPECT_NEAR(covered("x=2"), whole, 1e-9);
}

TEST_F(Render, SeveralFilesStandSideBySide) {
    write("points.ply", kPoints);
    const auto three = [&](const std::vector<std::string>& more) {
        std::vector<std::string> words = quick("square.ply", "three.png", {"--size", "400x200"});
        words.insert(words.begin() + 2, {"points.ply", "square.ply"});
        words.insert(words.end(), more.begin(), more.end());
        ok(words);
        return picture("three.png");
    };
    const Picture plain = three({"--no-captions"}), named = three({}),
                  captions = three({"--caption", "left", "--caption", "in the middle", "--caption", "right"});
    EXPECT_EQ(plain.width, 400u);
    EXPECT_EQ(plain.height, 200u);
    EXPECT_GT(picture_distance(plain, named), 1);
    EXPECT_GT(picture_distance(named, captions), 1);
    EXPECT_GT(picture_distance(three({"--shared-camera"}), named), 1);
    // A caption takes one word, so that files may follow it.
    ok({"render", "--caption", "one", "square.ply", "-o", "one.png", "--passes", "1", "--size", "100x100"});
    refused(2, quick("square.ply", "x.png", {"--size", "60x40", "--caption", "no room"}), {"--size", "60x40"});
}

TEST_F(Render, ScalarsAreColorsWithALegend) {
    make_cube();
    ok({"deform", "cube.ply", "-o", "moved.ply", "--bend", "40"});
    const std::vector<std::string> size = {"--size", "300x200"};
    const auto shown = [&](const std::string& input, std::vector<std::string> more) {
        more.insert(more.end(), size.begin(), size.end());
        const Picture picture = drawn(input, more);
        EXPECT_EQ(picture.width, 300u);
        std::size_t colored = 0; // in the object's part, left of the legend
        for (unsigned y = 0; y < picture.height; ++y)
            for (unsigned x = 0; x < 170; ++x) {
                const std::uint8_t* p = picture.pixel(x, y);
                colored += std::max({p[0], p[1], p[2]}) > std::min({p[0], p[1], p[2]}) + 60;
            }
        EXPECT_GT(colored, 1000u) << testing::PrintToString(more);
        return picture;
    };
    const Picture quality = shown("square.ply", {"--scalar", "quality"});
    EXPECT_GT(picture_distance(shown("square.ply", {"--scalar", "quality", "--map", "diverging"}), quality), 5);
    EXPECT_GT(picture_distance(shown("square.ply", {"--scalar", "quality", "--range", "-8", "8"}), quality), 5);
    EXPECT_GT(picture_distance(shown("square.ply", {"--scalar", "quality", "--unit", "mm"}), quality), 0.1);
    shown("square.ply", {"--scalar", "quality", "--points"});
    shown("moved.ply", {"--scalar", "error", "--against", "cube.ply"});
    shown("moved.ply", {"--scalar", "error", "--against", "square.ply"}); // of another number of vertices
    shown("moved.ply", {"--scalar", "strain", "--against", "cube.ply"});
    shown("cube.fil", {"--scalar", "level"});
    shown("cube.fil", {"--scalar", "level", "--level", "0", "--range", "-1", "1"});
    shown("cube.fil", {"--scalar", "level", "--poses", "bent.ply"});

    refused(7, quick("square.ply", "x.png", {"--scalar", "colour", "--size", "300x200"}),
            {"square.ply", "'colour'", "quality"});
    refused(2, quick("cube.ply", "x.png", {"--scalar", "error", "--size", "300x200"}), {"--against"});
    refused(2, quick("cube.ply", "x.png", {"--scalar", "level", "--size", "300x200"}), {"--scalar level", "mesh"});
    refused(8, quick("cube.ply", "x.png", {"--scalar", "strain", "--against", "square.ply", "--size", "300x200"}),
            {"Strain"});
    refused(2, quick("square.ply", "x.png", {"--scalar", "quality", "--range", "2", "1", "--size", "300x200"}),
            {"--range"});
}

TEST_F(Render, ModelsArePosed) {
    make_cube();
    const Picture rest = drawn("cube.fil"), bent = drawn("cube.fil", {"--poses", "bent.ply"});
    EXPECT_TRUE(shows_something(bent, rest));
    EXPECT_LT(picture_distance(drawn("cube.fil", {"--poses", "driver.ply"}), rest), 2);
    ok({"restore", "cube.fil", "--pose", "bent.ply", "-o", "restored.ply"});
    // Normals are computed anew there, and turned along here; the outlines are one.
    const std::vector<std::string> alone = {"--no-ground", "--background", "transparent"};
    std::vector<std::string> posed = alone;
    posed.insert(posed.end(), {"--poses", "bent.ply"});
    const Picture restored = drawn("restored.ply", alone), in_shader = drawn("cube.fil", posed);
    EXPECT_LT(picture_distance(restored, in_shader), 10);
    for (std::size_t p = 3; p < restored.rgba.size(); p += 4) EXPECT_NEAR(restored.rgba[p], in_shader.rgba[p], 40);
    EXPECT_TRUE(
        shows_something(drawn("cube.fil", {"--poses", "bent.ply", "--points"}), drawn("cube.fil", {"--points"})));

    refused(2, quick("cube.ply", "x.png", {"--poses", "bent.ply"}), {"cube.ply", "mesh", "--poses", "strip"});
    refused(8, quick("cube.fil", "x.png", {"--poses", "square.ply"}), {"9"});
    refused(2, {"render", "cube.fil", "cube.fil", "-o", "x.png", "--poses", "bent.ply"}, {"--poses"});
    refused(2, quick("cube.fil", "x.png", {"--poses", "bent.ply", "twisted.ply"}), {"film"});
    refused(2, quick("cube.fil", "x.png", {"--poses", "bent.ply", "--scalar", "f00", "--size", "300x200"}),
            {"--poses"});
}

TEST_F(Render, WritesVectorPages) {
    ok(quick("square.ply", "page.svg", {"--size", "300x200", "--scalar", "quality"}));
    const std::string svg = bytes_of(path("page.svg"));
    EXPECT_NE(svg.find("<svg"), std::string::npos);
    EXPECT_NE(svg.find("<image"), std::string::npos);
    EXPECT_NE(svg.find("</svg>"), std::string::npos);
    ok(quick("square.ply", "page.pdf", {"--size", "300x200"}));
    EXPECT_TRUE(bytes_of(path("page.pdf")).starts_with("%PDF"));
}

TEST_F(Render, WrongArgumentsAreRefusedInASentence) {
    make_cube();
    const auto wrong = [&](int code, const std::vector<std::string>& more, const std::vector<std::string>& words) {
        std::vector<std::string> arguments = {"render", "square.ply", "-o", "x.png"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        refused(code, arguments, words);
    };
    for (const char* size : {"640", "640x", "x480", "0x10", "10x0", "-5x5", "640x480x3", "1e3x5", "99999999999x2", ""})
        wrong(2, {"--size", size}, {"--size", "1920x1080"});
    wrong(2, {"--size", "4x4"}, {"--size"});
    wrong(7, {"--size", "1000000x20"}, {"1000000 by 20"});
    for (const char* color : {"red", "#12345", "#1234567", "#12345g", "#+12345", "123456"})
        wrong(2, {"--color", color}, {"--color", color, "#rrggbb"});
    wrong(2, {"--background", "#ffffff,blue"}, {"--background", "blue"});
    wrong(2, {"--edges", "--edge-color", "dark"}, {"--edge-color", "dark"});
    for (const char* clip : {"w=0.5", "z", "z=", "z=a", "=0.5", "z=0.5x", "--z=1", "z=nan", "", "-"})
        wrong(2, {"--clip=" + std::string(clip)}, {"--clip"});
    wrong(2, {"--camera", "1", "2", "3", "4", "5", "6", "7"}, {"--camera", "6", "9"});
    wrong(2, {"--camera", "1", "2", "3"}, {"--camera"});
    wrong(2, {"--camera", "1", "2", "3", "1", "2", "3"}, {"--camera", "same point"});
    wrong(2, {"--camera", "1", "2", "3", "4", "5", "nan"}, {"nan"});
    wrong(2, {"--field-of-view", "180"}, {"--field-of-view"});
    wrong(2, {"--view", "left"}, {"--view", "left"});
    wrong(2, {"--up", "w"}, {"--up"});
    wrong(2, {"--passes", "0"}, {"--passes"});
    wrong(2, {"--point-radius", "-1"}, {"--point-radius"});
    wrong(2, {"--turntable"}, {"--turntable", ".mp4"});
    wrong(2, {"--scalar", "quality", "--range", "1"}, {"--range"});
    refused(2, quick("square.ply", "x_%d.png"), {"film"});
    refused(2, quick("square.ply", "x_%d.png", {"--turntable", "--frames", "0"}), {"--frames"});
    refused(2, quick("square.ply", "x_%d.png", {"--turntable", "--fps", "0"}), {"--fps"});
    refused(2, quick("cube.fil", "x.png", {"--level", "7"}), {"cube.fil", "level 7"});
    refused(5, quick("square.ply", "x.bmp"), {"x.bmp", ".png"});
    refused(5, quick("square.ply", "-"), {".png"});
    refused(3, quick("nowhere.ply", "x.png"), {"nowhere.ply"});
    refused(2, {"render", "-o", "x.png"}, {"files"});
    refused(2, {"render", "square.ply"}, {"--output"});
    refused(6, quick("square.ply", "nowhere/x.png"), {"nowhere/x.png"});
    refused(6, quick("square.ply", "nowhere/x.svg"), {"nowhere/x.svg"});
    refused(6, quick("square.ply", "nowhere/x_%d.png", {"--turntable", "--frames", "2"}), {"nowhere"});
    write("broken.ply", kSquare.substr(0, 240));
    refused(4, quick("broken.ply", "x.png"), {"broken.ply"});
    write("empty.ply", "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\n"
                       "property float z\nend_header\n");
    const Ran empty = run(quick("empty.ply", "x.png"));
    EXPECT_TRUE(empty.code == 4 || empty.code == 7) << empty.err;
}

TEST_F(Render, FilmsAreNumberedPictures) {
    make_cube();
    ok(quick("square.ply", "turn_%03d.png", {"--turntable", "--frames", "3"}));
    const Picture first = picture("turn_001.png"), second = picture("turn_002.png"), third = picture("turn_003.png");
    EXPECT_EQ(first.width, 64u);
    EXPECT_TRUE(shows_something(first, second));
    EXPECT_TRUE(shows_something(second, third));
    EXPECT_FALSE(std::filesystem::exists(path("turn_004.png")));

    const Json posed = json(quick("cube.fil", "pose_%d.png", {"--poses", "driver.ply", "bent.ply", "twisted.ply"}));
    EXPECT_EQ(posed["frames"], 3);
    EXPECT_TRUE(shows_something(picture("pose_1.png"), picture("pose_2.png")));
    ok(quick("cube.fil", "ball_%d.png", {"--poses", "driver.ply", "bent.ply", "--points"}));
    EXPECT_TRUE(shows_something(picture("ball_1.png"), picture("ball_2.png")));
    // One camera for the whole film: the first frame is not framed as it would be alone.
    ok(quick("cube.fil", "level_%d.png",
             {"--poses", "driver.ply", "bent.ply", "--scalar", "level", "--size", "300x200"}));
    EXPECT_EQ(picture("level_2.png").width, 300u);

    // The motion of the driver as one file, a moment of it, and a draft.
    ok({"deform", "cube.fil", "-o", "bending.fil", "--bend", "90", "--frames", "2"});
    ok({"restore", "cube.fil", "--poses", "bending.fil", "-o", "moved.fil"});
    EXPECT_EQ(json(quick("cube.fil", "motion_%d.png", {"--poses", "moved.fil"}))["frames"], 2);
    EXPECT_TRUE(shows_something(drawn("cube.fil", {"--poses", "moved.fil", "--frame", "2"}), drawn("cube.fil")));
    refused(2, quick("cube.fil", "x.png", {"--poses", "moved.fil"}), {"moved.fil", "--frame"});
    const Json draft = json({"render", "moved.fil", "-o", "draft_%d.png", "--draft"});
    EXPECT_EQ(draft["width"], 480);
    EXPECT_EQ(draft["height"], 360);
    refused(2, quick("cube.fil", "x.png", {"--draft"}), {"--draft", "films"});

    std::vector<std::string> files_film = quick("cube.ply", "file_%d.png");
    files_film.insert(files_film.begin() + 2, "square.ply");
    EXPECT_EQ(json(files_film)["frames"], 2);
    EXPECT_TRUE(shows_something(picture("file_1.png"), picture("file_2.png")));
}

TEST_F(Render, FilmsInChunksAreTheSamePictures) {
    ok(quick("square.ply", "whole_%d.png", {"--turntable", "--frames", "5"}));
    for (const char* chunk : {"3/3", "1/3", "2/3"})
        ok(quick("square.ply", "part_%d.png", {"--turntable", "--frames", "5", "--chunk", chunk}));
    for (const char* number : {"1", "2", "3", "4", "5"})
        EXPECT_EQ(bytes_of(path(std::string("part_") + number + ".png")),
                  bytes_of(path(std::string("whole_") + number + ".png")));
    EXPECT_EQ(json(quick("square.ply", "no_%d.png", {"--turntable", "--frames", "2", "--chunk", "1/3"}))["count"], 0);
    refused(2, quick("square.ply", "x.mp4", {"--turntable", "--chunk", "1/2"}), {"--chunk"});
}

TEST_F(Render, FilmsNeedFfmpegOrSayHowToDoWithout) {
    const std::vector<std::string> film = quick("square.ply", "film.mp4", {"--turntable", "--frames", "4"});
    const Ran without = run_shell("PATH=/nonexistent; exec \"$0\" \"$@\"", film);
    EXPECT_EQ(without.code, 5);
    EXPECT_EQ(without.err, "filigree: film.mp4: ffmpeg is not installed; apt-get install ffmpeg, or write numbered "
                           "pictures (frame_%04d.png).\n");
    EXPECT_EQ(files(), std::vector<std::string>{"square.ply"});
    if (!has_ffmpeg()) GTEST_SKIP() << "no ffmpeg";
    ok(film);
    EXPECT_EQ(bytes_of(path("film.mp4")).substr(4, 4), "ftyp");
    ok(quick("square.ply", "film.gif", {"--turntable", "--frames", "4", "--background", "transparent"}));
    EXPECT_EQ(bytes_of(path("film.gif")).substr(0, 4), "GIF8");
    EXPECT_EQ(files().size(), 3u); // and no temporary files
}

TEST_F(Render, AFilmThatIsStoppedLeavesNothing) {
    std::vector<std::string> names = {"film_%03d.png"};
    if (has_ffmpeg()) names.push_back("film.mp4");
    for (const std::string& name : names) {
        const Ran ran =
            run({"render", "square.ply", "-o", name, "--turntable", "--frames", "100000", "--size", "64x48"},
                "/dev/null", 0.7);
        EXPECT_EQ(ran.code, 130) << ran.err;
        EXPECT_EQ(ran.err, "filigree: Cancelled; nothing was written.\n");
        EXPECT_LT(ran.seconds, 5);
        EXPECT_EQ(files(), std::vector<std::string>{"square.ply"}) << name;
    }
    write("kept.png", "as it was");
    const Ran ran = run({"render", "square.ply", "-o", "kept.png", "--passes", "1000000", "--size", "64x48"},
                        "/dev/null", 0.7, SIGTERM);
    EXPECT_EQ(ran.code, 130) << ran.err;
    EXPECT_EQ(bytes_of(path("kept.png")), "as it was");
}

TEST_F(Render, WithoutOpenGLItSaysWhatToInstall) {
    const Ran ran =
        run_shell("__EGL_VENDOR_LIBRARY_FILENAMES=/dev/null exec \"$0\" \"$@\"", quick("square.ply", "x.png"));
    if (ran.code == 0) GTEST_SKIP() << "EGL here does not ask for vendors";
    EXPECT_EQ(ran.code, 5);
    EXPECT_TRUE(ran.err.starts_with("filigree: No OpenGL 4.3 was found")) << ran.err;
    EXPECT_NE(ran.err.find("apt-get install"), std::string::npos) << ran.err;
    EXPECT_EQ(files(), std::vector<std::string>{"square.ply"});
}

TEST_F(Render, NeedsNoDisplayAndNoHome) {
    const Ran ran = run_shell("unset DISPLAY WAYLAND_DISPLAY HOME XDG_RUNTIME_DIR XDG_CACHE_HOME; exec \"$0\" \"$@\"",
                              quick("square.ply", "page.svg", {"--size", "300x200", "--scalar", "quality"}));
    EXPECT_EQ(ran.code, 0) << ran.err;
    EXPECT_EQ(ran.err, "");
}

TEST_F(Render, ReadsColorsAndTexturesOfObj) {
    write("paint.mtl", "newmtl red\nKd 0.8 0.05 0.05\nnewmtl lost\nmap_Kd nowhere.png\n");
    write("painted.obj",
          "mtllib paint.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nusemtl red\nf 1/1 2/1 3/1 4/1\n");
    const Picture red = drawn("painted.obj", {"--view", "front"});
    EXPECT_GT(red.pixel(32, 24)[0], red.pixel(32, 24)[1] + 60);
    const Picture blue = drawn("painted.obj", {"--view", "front", "--color", "#2040d0"});
    EXPECT_GT(blue.pixel(32, 24)[2], blue.pixel(32, 24)[0] + 60);
    write("lost.obj", "mtllib paint.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nusemtl lost\nf 1/1 2/1 3/1\n");
    const Ran lost = ok(quick("lost.obj", "lost.png"));
    EXPECT_NE(lost.err.find("nowhere.png"), std::string::npos) << lost.err;
}

TEST_F(Render, ComparesInAPicture) {
    make_cube();
    ok({"deform", "cube.ply", "-o", "moved.ply", "--bend", "20"});
    const Json compared = json({"compare", "moved.ply", "cube.ply", "--samples", "100", "--picture", "heat.png"});
    EXPECT_EQ(compared["picture"], "heat.png");
    EXPECT_EQ(compared["up"], "y"); // the mesh says nothing, and it is a PLY
    const Picture heat = picture("heat.png");
    EXPECT_GT(heat.width, 1000u);
    EXPECT_GT(heat.height, 700u);
    refused(5, {"compare", "moved.ply", "cube.ply", "--picture", "heat.jpg"}, {"heat.jpg", ".png"});
    refused(6, {"compare", "moved.ply", "cube.ply", "--samples", "0", "--picture", "nowhere/heat.png"}, {"nowhere"});
    write("points.ply", kPoints); // of another number of vertices, and without faces
    const Ran none = run({"compare", "cube.ply", "points.ply", "--samples", "0", "--picture", "x.png", "--quiet"});
    EXPECT_EQ(none.code, 7);
    EXPECT_NE(none.err.find("no faces"), std::string::npos) << none.err;
    EXPECT_FALSE(std::filesystem::exists(path("x.png")));
}

TEST_F(Render, RestoreDrawsTheErrorToExpect) {
    ok({"make", "wavy-sphere", "-o", "sphere.ply", "--resolution", "32"});
    ok({"strip", "sphere.ply", "-o", "sphere.fil", "--base", "40"});
    ok({"deform", "sphere.fil", "-o", "bent.ply", "--bend", "150", "--pose", "pose.ply"});
    const Json restored = json({"restore", "sphere.fil", "--pose", "pose.ply", "-o", "r.ply", "--picture", "heat.png"});
    EXPECT_EQ(restored["picture"], "heat.png");
    EXPECT_EQ(restored["up"], "y");
    const Picture heat = picture("heat.png");
    EXPECT_GT(heat.width, 1000u);
    ok({"restore", "sphere.fil", "--pose", "pose.ply", "-o", "again.ply"});
    EXPECT_EQ(bytes_of(path("again.ply")), bytes_of(path("r.ply"))) << "the mesh is the same";

    const std::vector<std::string> one = {"restore", "sphere.fil", "--pose", "pose.ply", "-o", "x.ply", "--picture"};
    const auto with = [&](std::vector<std::string> more) {
        more.insert(more.begin(), one.begin(), one.end());
        return more;
    };
    refused(5, with({"heat.jpg"}), {"heat.jpg", ".png"});
    refused(2, with({"x.png", "--level", "0"}), {"finest"});
    refused(2, {"restore", "sphere.fil", "--frames", "-o", "x.pc2", "--picture", "x.png"}, {"--picture"});
    ok({"make", "wavy-plane", "-o", "plane.ply", "--resolution", "16"});
    ok({"strip", "plane.ply", "-o", "plane.fil", "--code", "reference"});
    ok({"level", "plane.fil", "0", "-o", "driver.ply"});
    refused(7, {"restore", "plane.fil", "--pose", "driver.ply", "-o", "x.ply", "--picture", "x.png"}, {"reference"});
    EXPECT_FALSE(std::filesystem::exists(path("x.png")));
    EXPECT_FALSE(std::filesystem::exists(path("x.ply")));
}
