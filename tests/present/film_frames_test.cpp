#include "filigree/present/film_frames.h"

#include "filigree/mesh.h"
#include "filigree/strip.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <filesystem>

namespace filigree {
namespace {

namespace fs = std::filesystem;

class FilmFrames : public testing::Test {
protected:
    void SetUp() override {
        folder_ = fs::temp_directory_path() /
                  (std::string("filigree_frames_") + testing::UnitTest::GetInstance()->current_test_info()->name());
        fs::create_directories(folder_);
        for (const char* name : {"a_%02d.png", "b_%02d.png"})
            writers.push_back(FilmWriter::create(folder_ / name, 4, 4, 30).value());
    }
    void TearDown() override {
        writers.clear();
        fs::remove_all(folder_);
    }
    static Picture blank() {
        Picture picture;
        picture.width = picture.height = 4;
        picture.rgba.assign(4 * 4 * 4, 255);
        return picture;
    }
    bool is_there(const char* name) const { return fs::exists(folder_ / name); }

    std::vector<FilmWriter> writers;

private:
    fs::path folder_;
};

TEST_F(FilmFrames, EveryFrameGoesToEveryWriter) {
    std::vector<std::size_t> drawn;
    std::vector<double> progress;
    RunContext context(1);
    context.progress = [&](std::string_view phase, double fraction) {
        EXPECT_EQ(phase, "filming");
        progress.push_back(fraction);
    };
    const auto draw = [&](std::size_t frame, const RunContext& quiet) -> Result<Picture> {
        EXPECT_FALSE(quiet.progress);
        drawn.push_back(frame);
        return blank();
    };
    ASSERT_TRUE(film_frames(3, draw, writers, "filming", context));
    EXPECT_EQ(drawn, (std::vector<std::size_t>{0, 1, 2}));
    EXPECT_EQ(progress, (std::vector<double>{0, 1 / 3.0, 2 / 3.0, 1}));
    for (FilmWriter& writer : writers) {
        EXPECT_EQ(writer.frame_count(), 3U);
        EXPECT_TRUE(writer.finish());
    }
    EXPECT_TRUE(is_there("a_03.png") && is_there("b_03.png"));
}

TEST_F(FilmFrames, StopsAtAnErrorAndWhenCancelled) {
    const auto fails = [&](std::size_t frame, const RunContext&) -> Result<Picture> {
        if (frame == 1) return Error{ErrorCode::out_of_memory, "no room"};
        return blank();
    };
    EXPECT_EQ(film_frames(3, fails, writers, "filming", kOneThread).error().code, ErrorCode::out_of_memory);
    RunContext context(1);
    const auto cancels = [&](std::size_t, const RunContext& quiet) -> Result<Picture> {
        quiet.cancel();
        return blank();
    };
    EXPECT_EQ(film_frames(3, cancels, writers, "filming", context).error().code, ErrorCode::cancelled);
    EXPECT_EQ(writers[0].frame_count(), 2U);
}

TEST(LevelWithin, IsTheFinestThatFits) {
    StripOptions options;
    options.levels = 3;
    const Model model = strip(make_wavy_cube({.resolution = 24}), options, kOneThread)->model;
    const auto triangles = [&](unsigned level) {
        const Mesh mesh = level_mesh(model, level);
        return mesh.corner_count() - 2 * mesh.face_count();
    };
    for (unsigned level = 0; level <= model.finest_level(); ++level) {
        EXPECT_EQ(level_within(model, triangles(level)), level);
        if (level > 0) {
            EXPECT_EQ(level_within(model, triangles(level) - 1), level - 1);
        }
    }
    EXPECT_EQ(level_within(model, 1), 0U);
}

} // namespace
} // namespace filigree
