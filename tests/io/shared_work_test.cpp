// A folder in which the parts of a work gather, while others finish it.
#include "filigree/io/system/shared_work.h"

#include "filigree/io/system/file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <functional>
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

/// While one was at work its own work was finished by others, and another was begun at the same path.
TEST(SharedFolderTest, ThatIsAnotherWorksIsLeftAlone) {
    const fs::path root = fs::temp_directory_path() / ("filigree-others-" + std::to_string(::getpid()));
    fs::remove_all(root);
    fs::create_directory(root);
    const fs::path whole = root / "whole", parts = root / "whole.chunks";
    const auto is_there = [&] { return fs::exists(whole); };
    const SharedFolder late(whole, "a plan\n", is_there), other(whole, "another plan\n", is_there);
    EXPECT_FALSE(late.begin().value());
    ASSERT_TRUE(write_file(whole, "whole").ok());
    ASSERT_TRUE(late.end().ok());
    EXPECT_FALSE(other.begin().value());
    ASSERT_TRUE(other.mark("done-1").ok());

    EXPECT_FALSE(late.is_ours());
    EXPECT_TRUE(late.is_finished());
    EXPECT_FALSE(late.mark("done-2").ok());
    EXPECT_FALSE(fs::exists(parts / "done-2"));
    EXPECT_TRUE(late.end().ok());
    EXPECT_TRUE(fs::exists(parts / "done-1"));
    EXPECT_TRUE(other.is_ours());
    fs::remove_all(root);
}

TEST(SharedItemsTest, LateOnesDoNotComeIntoAnotherWork) {
    const fs::path root = fs::temp_directory_path() / ("filigree-late-" + std::to_string(::getpid()));
    fs::remove_all(root);
    fs::create_directory(root);
    const fs::path whole = root / "whole";
    const SharedItems items{.path = whole, .what = "letters", .names = {"a", "b"}, .phase = "writing"};
    using Make = std::function<Result<std::string>(std::size_t)>;
    const auto made = [&](const std::string& job, std::size_t number, const Make& make) {
        const auto place = [&](const std::function<fs::path(std::size_t)>& file) {
            return write_file(whole, read_file(file(0)).value() + read_file(file(1)).value());
        };
        return make_shared_items(
                   items, {number, 2, job}, make, place, [&] { return fs::exists(whole); }, RunContext())
            .value();
    };
    const Make small = [](std::size_t item) { return std::string(item ? "b" : "a"); };
    const Make capital = [](std::size_t item) { return std::string(item ? "B" : "A"); };
    const SharedItemsReport late = made("small", 2, [&](std::size_t item) {
        made("small", 1, small);
        EXPECT_TRUE(made("small", 2, small).is_whole);
        EXPECT_FALSE(made("capital", 1, capital).is_whole);
        return small(item);
    });
    EXPECT_TRUE(late.is_whole);
    EXPECT_EQ(read_file(whole).value(), "ab");
    EXPECT_TRUE(made("capital", 2, capital).is_whole);
    EXPECT_EQ(read_file(whole).value(), "AB");
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
                    [&] { return fs::exists(whole); }, RunContext());
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
