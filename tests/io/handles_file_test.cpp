#include "filigree/io/animation/handles_file.h"

#include "filigree/io/system/file.h"

#include <gtest/gtest.h>
#include <unistd.h>

namespace filigree {
namespace {

namespace fs = std::filesystem;

class HandlesFile : public ::testing::Test {
protected:
    void SetUp() override { fs::create_directories(folder_); }
    void TearDown() override { fs::remove_all(folder_); }
    Result<std::vector<HandleRegion>> read(const std::string& text) const {
        const fs::path path = folder_ / "pull.json";
        EXPECT_TRUE(write_file(path, text));
        return read_handles(path);
    }
    void refuses(const std::string& text, ErrorCode code, const std::string& word) const {
        const Error error = read(text).error();
        EXPECT_EQ(error.code, code) << text;
        EXPECT_NE(error.message.find("pull.json"), std::string::npos) << error.message;
        EXPECT_NE(error.message.find(word), std::string::npos) << error.message;
    }

private:
    fs::path folder_ = fs::temp_directory_path() / ("filigree_handles_" + std::to_string(::getpid()));
};

TEST_F(HandlesFile, ReadsAllThatAHandleCanSay) {
    const std::vector<HandleRegion> handles = read(R"({"handles": [
        {"name": "head", "box": {"min": [0, 1, 2], "max": [3, 4, 5]}, "move": [1, 0, 0], "comment": "up"},
        {"vertices": [4, 7], "axis": [0, 0, 2], "degrees": 90, "centre": [1, 1, 1]},
        {"sphere": {"centre": [1, 2, 3], "radius": 0.5}}]})")
                                                  .value();
    ASSERT_EQ(handles.size(), 3u);
    EXPECT_EQ(handles[0].name, "head");
    EXPECT_EQ(handles[0].box->max, Vec3d(3, 4, 5));
    EXPECT_EQ(handles[0].move, Vec3d(1, 0, 0));
    EXPECT_EQ(handles[1].vertices, (std::vector<Index>{4, 7}));
    EXPECT_LT((handles[1].rotation * Vec3d::UnitX() - Vec3d::UnitY()).norm(), 1e-12);
    EXPECT_EQ(*handles[1].centre, Vec3d(1, 1, 1));
    EXPECT_EQ(handles[2].sphere->second, 0.5);
    EXPECT_FALSE(handles[2].centre);
}

TEST_F(HandlesFile, SaysWhatIsWrongAndWhere) {
    refuses("{'handles': [", ErrorCode::bad_file, "docs/handles.md");
    refuses("{}", ErrorCode::bad_file, "handles");
    refuses(R"({"handles": []})", ErrorCode::usage, "no handles");
    refuses(R"({"handles": [{"vertices": [0]}, {"vertices": [0], "mvoe": [1, 0, 0]}]})", ErrorCode::usage, "handle 2");
    refuses(R"({"handles": [{"vertices": [-1]}]})", ErrorCode::usage, "-1 is no vertex id");
    refuses(R"({"handles": [{"move": [1, 0, 0]}]})", ErrorCode::usage, "exactly one");
    refuses(R"({"handles": [{"vertices": [0], "axis": [0, 0, 1]}]})", ErrorCode::usage, "go together");
    refuses(R"({"handles": [{"vertices": [0], "axis": [0, 0, 0], "degrees": 3}]})", ErrorCode::usage, "zero");
    refuses(R"({"handles": [{"vertices": [0], "move": [1, 0]}]})", ErrorCode::usage, "three numbers");
    refuses(R"([])", ErrorCode::bad_file, "the file must be an object");
    refuses(R"({"handles": {}})", ErrorCode::bad_file, "'handles' must be a list");
    refuses(R"({"handles": [], "unit": "m"})", ErrorCode::bad_file, "'unit' is not a word of the file");
    refuses(R"({"handles": [], "handles": []})", ErrorCode::bad_file, "'handles' stands there twice");
    refuses(R"({"handles": [{"vertices": [0], "name": 5}]})", ErrorCode::usage, "'name' must be text");
    refuses(R"({"handles": [7]})", ErrorCode::usage, "a handle must be an object");
    refuses(R"({"handles": [{"vertices": [0], "move": [1, 0, "2"]}]})", ErrorCode::usage, "three numbers");
    refuses(R"({"handles": [{"box": {"min": [0, 0, 0]}}]})", ErrorCode::usage, "the box has no 'max'");
    refuses(R"({"handles": [{"sphere": {"centre": [0, 0, 0], "radius": -1}}]})", ErrorCode::usage, "below 0");
    refuses(R"({"handles": [{"sphere": {"center": [0, 0, 0], "radius": 1}}]})", ErrorCode::usage,
            "'center' is not a word of a sphere");
    EXPECT_EQ(read_handles("no/such/file.json").error().code, ErrorCode::not_found);
}

} // namespace
} // namespace filigree
