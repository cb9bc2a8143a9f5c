// A folder in which the parts of a work gather, while others finish it.
#include "filigree/io/shared_work.h"

#include "filigree/io/file.h"

#include <gtest/gtest.h>
#include <unistd.h>

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

} // namespace
} // namespace filigree
