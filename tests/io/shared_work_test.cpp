// A folder in which the parts of a work gather, while others finish it.
#include "filigree/io/shared_work.h"

#include "filigree/io/file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <thread>

namespace filigree {
namespace {

namespace fs = std::filesystem;

/// As one who comes late finds it: somebody finished the work, and somebody else made the folder anew a moment ago.
TEST(SharedFolderTest, IsFinishedThoughSomebodyJustMadeItAnew) {
    const fs::path root = fs::temp_directory_path() / ("filigree-shared-" + std::to_string(::getpid()));
    fs::remove_all(root);
    fs::create_directory(root);
    const fs::path whole = root / "whole", parts = root / "whole.chunks";
    const SharedFolder folder(whole, "a plan\n", [&] { return fs::exists(whole); });
    EXPECT_FALSE(folder.begin().value());
    EXPECT_TRUE(folder.mark("done-1").ok());
    EXPECT_TRUE(folder.mark("done-1").ok());
    EXPECT_TRUE(fs::exists(parts / "done-1"));
    EXPECT_FALSE(folder.is_finished());
    ASSERT_TRUE(write_file(whole, "whole").ok());
    ASSERT_TRUE(folder.end().ok());
    EXPECT_TRUE(folder.is_finished());
    EXPECT_FALSE(fs::exists(parts));

    fs::create_directory(parts);
    EXPECT_TRUE(folder.is_finished());
    EXPECT_TRUE(folder.begin().value());
    EXPECT_FALSE(folder.mark("done-1").ok()); // nothing is put into what is not ours
    EXPECT_TRUE(fs::is_empty(parts));

    // One who was killed before it took the folder away left a plan in it: that has to be taken away.
    ASSERT_TRUE(write_file(parts / "plan", "a plan\n").ok());
    EXPECT_FALSE(folder.is_finished());
    EXPECT_FALSE(folder.begin().value());
    ASSERT_TRUE(folder.end().ok());
    EXPECT_FALSE(fs::exists(parts));
    fs::remove_all(root);
}

/// All of them come to the same end, and none is told of an error, though each may be the one that joins the parts.
TEST(SharedItemsTest, ManyAtTheSameTime) {
    const fs::path root = fs::temp_directory_path() / ("filigree-items-" + std::to_string(::getpid()));
    constexpr std::size_t kMakers = 8, kItems = 4, kRounds = 60;
    for (std::size_t round = 0; round < kRounds; ++round) {
        fs::remove_all(root);
        fs::create_directory(root);
        const fs::path whole = root / "whole";
        const SharedItems items{.path = whole, .what = "letters", .names = {"a", "b", "c", "d"}, .phase = "writing"};
        const auto place = [&](const std::function<fs::path(std::size_t)>& file) -> Status {
            std::string all;
            for (std::size_t item = 0; item < kItems; ++item) {
                const Result<std::string> part = read_file(file(item));
                if (!part) return part.error();
                all += *part;
            }
            return write_file(whole, all);
        };
        std::vector<std::string> wrong(kMakers);
        std::vector<std::thread> makers;
        for (std::size_t maker = 0; maker < kMakers; ++maker)
            makers.emplace_back([&, maker] {
                const auto made = make_shared_items(
                    items, {.number = 1 + maker % 2, .count = 2, .job = "j"},
                    [&](std::size_t item) { return Result<std::string>(items.names[item]); }, place,
                    [&] { return fs::exists(whole); }, {});
                if (!made) wrong[maker] = made.error().message;
            });
        for (std::thread& maker : makers) maker.join();
        for (const std::string& message : wrong) ASSERT_EQ(message, "") << "round " << round;
        ASSERT_EQ(read_file(whole).value(), "abcd");
        ASSERT_EQ(std::distance(fs::directory_iterator(root), {}), 2) << "the whole and its plan; round " << round;
    }
    fs::remove_all(root);
}

} // namespace
} // namespace filigree
