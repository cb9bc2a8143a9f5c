#include "filigree/io/system/file_batch.h"

#include "filigree/io/system/file.h"

#include <gtest/gtest.h>

#include <atomic>
#include <csignal>
#include <fstream>
#include <thread>

#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

using namespace filigree;
namespace fs = std::filesystem;

namespace {

class FileBatches : public testing::Test {
protected:
    FileBatches() {
        std::string name = (fs::temp_directory_path() / "filigree-XXXXXX").string();
        folder_ = ::mkdtemp(name.data());
    }
    ~FileBatches() override { fs::remove_all(folder_); }

    std::vector<std::string> files() const {
        std::vector<std::string> names;
        for (const auto& entry : fs::directory_iterator(folder_)) names.push_back(entry.path().filename().string());
        std::sort(names.begin(), names.end());
        return names;
    }
    std::string text(const std::string& name) const { return *read_file(folder_ / name); }
    void put(const std::string& name, const std::string& bytes) const {
        ASSERT_TRUE(write_file(folder_ / name, bytes).ok());
    }
    static void add(const FileBatch& batch, const std::string& name, const std::string& bytes) {
        ASSERT_TRUE(write_file(batch.path(name), bytes).ok());
    }

    /// Runs `work` in a process of its own that ends without any cleaning up.
    template <class Work>
    static void in_killed_process(const Work& work) {
        const pid_t child = ::fork();
        if (child == 0) {
            work();
            ::kill(::getpid(), SIGKILL);
        }
        int status = 0;
        ::waitpid(child, &status, 0);
    }
    /// The hidden folder of the only batch that was left.
    fs::path leftover() const {
        for (const std::string& name : files())
            if (name.starts_with(".filigree-")) return folder_ / name;
        return {};
    }
    /// A killed batch of files a and b, that was about to put them in their places.
    void leave_placing() const {
        in_killed_process([&] {
            const Result<FileBatch> batch = FileBatch::create(folder_);
            add(*batch, "a", "new");
            add(*batch, "b", "new");
            ::kill(::getpid(), SIGKILL); // before its destructor clears up
        });
        std::string before;
        for (const char* name : {"a", "b"}) {
            struct stat status {};
            if (::stat((folder_ / name).c_str(), &status) != 0) continue;
            before += std::to_string(status.st_mtim.tv_sec) + " " + std::to_string(status.st_mtim.tv_nsec) + " " +
                      std::to_string(status.st_size) + " " + name + '\0';
        }
        const fs::path making = leftover();
        ASSERT_TRUE(write_file(making / "before", before).ok());
        const std::string name = making.filename().string();
        fs::rename(making, folder_ / (name.substr(0, name.rfind('-')) + "-placing"));
    }

    fs::path folder_;
};

} // namespace

TEST_F(FileBatches, ComeTogetherAndKeepPermissions) {
    put("a", "old");
    fs::permissions(folder_ / "a", fs::perms(0640));
    Result<FileBatch> batch = FileBatch::create(folder_);
    ASSERT_TRUE(batch.ok());
    add(*batch, "a", "new"), add(*batch, "b", "new");
    EXPECT_EQ(text("a"), "old");
    FileBatch moved = std::move(*batch);
    ASSERT_TRUE(moved.finish().ok());
    EXPECT_EQ(text("a"), "new");
    EXPECT_EQ(text("b"), "new");
    EXPECT_EQ(fs::status(folder_ / "a").permissions(), fs::perms(0640));
    { const FileBatch gone = std::move(moved); }
    EXPECT_EQ(files(), (std::vector<std::string>{"a", "b"}));
}

TEST_F(FileBatches, UnfinishedOnesLeaveNothing) {
    put("a", "old");
    {
        const Result<FileBatch> batch = FileBatch::create(folder_);
        add(*batch, "a", "new"), add(*batch, "b", "new");
        EXPECT_TRUE(unplaced_files(folder_).empty());
    }
    EXPECT_EQ(files(), (std::vector<std::string>{"a"}));
    EXPECT_EQ(text("a"), "old");
    const Result<FileBatch> nowhere = FileBatch::create(folder_ / "missing");
    ASSERT_FALSE(nowhere.ok());
    EXPECT_EQ(nowhere.error().code, ErrorCode::unwritable);
}

TEST_F(FileBatches, WhatIsInTheWayIsFoundBeforeAnythingIsReplaced) {
    put("a", "old");
    fs::create_directory(folder_ / "b");
    fs::create_symlink("a", folder_ / "c");
    for (const std::string in_the_way : {"b", "c"}) {
        Result<FileBatch> batch = FileBatch::create(folder_);
        EXPECT_FALSE(batch->check_place(in_the_way).ok());
        add(*batch, "a", "new"), add(*batch, in_the_way, "new");
        const Status finished = batch->finish();
        ASSERT_FALSE(finished.ok());
        EXPECT_EQ(finished.error().code, ErrorCode::unwritable);
        EXPECT_EQ(text("a"), "old");
    }
    EXPECT_EQ(files(), (std::vector<std::string>{"a", "b", "c"}));
}

TEST_F(FileBatches, WhenOneCannotBePlacedThoseBeforeItAreTakenBack) {
    put("b", "old"), put("c", "old");
    {
        Result<FileBatch> batch = FileBatch::create(folder_);
        add(*batch, "a", "new"), add(*batch, "b", "new");
        fs::create_directory(batch->path("c")); // a folder cannot replace a file
        EXPECT_FALSE(batch->finish().ok());
        EXPECT_EQ(text("b"), "old");
    }
    EXPECT_EQ(files(), (std::vector<std::string>{"b", "c"}));
    EXPECT_EQ(text("b"), "old");
    EXPECT_EQ(text("c"), "old");
}

TEST_F(FileBatches, ThoseOfManyThreadsDoNotDisturbEachOther) {
    std::atomic<int> failures = 0;
    std::vector<std::thread> threads;
    for (int t = 0; t < 8; ++t)
        threads.emplace_back([&, t] {
            for (int round = 0; round < 5; ++round) {
                Result<FileBatch> batch = FileBatch::create(folder_);
                if (!batch) {
                    ++failures;
                    continue;
                }
                for (int i = 0; i < 10; ++i)
                    if (!write_file(batch->path(std::to_string(t) + "_" + std::to_string(i)), "new")) ++failures;
                if (!batch->finish()) ++failures;
            }
        });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(failures, 0);
    EXPECT_EQ(files().size(), 80u);
}

TEST_F(FileBatches, WhatKilledOnesMadeIsRemovedByTheNext) {
    put("a", "old");
    in_killed_process([&] {
        const Result<FileBatch> batch = FileBatch::create(folder_);
        add(*batch, "a", "new");
        // Killed while it noted what it replaces, half way through that file.
        std::ofstream(batch->path("a").parent_path().parent_path() / ".filigree-0123.tmp") << "half";
        ::kill(::getpid(), SIGKILL); // before its destructor clears up
    });
    EXPECT_EQ(files().size(), 2u);
    EXPECT_TRUE(unplaced_files(folder_).empty());                             // nothing was to be placed yet
    fs::create_directories(folder_ / ".filigree-of-somebody-making" / "new"); // without our lock: not ours
    { ASSERT_TRUE(FileBatch::create(folder_).ok()); }
    EXPECT_EQ(files(), (std::vector<std::string>{".filigree-of-somebody-making", "a"}));
    EXPECT_EQ(text("a"), "old");
}

TEST_F(FileBatches, WhatKilledOnesHadToPlaceIsPlacedByTheNext) {
    put("a", "old");
    leave_placing();
    const std::vector<fs::path> unplaced = unplaced_files(folder_);
    ASSERT_EQ(unplaced.size(), 2u);
    EXPECT_EQ(*read_file(unplaced[0]), "new");
    EXPECT_EQ(text("a"), "old");
    { ASSERT_TRUE(FileBatch::create(folder_).ok()); }
    EXPECT_EQ(text("a"), "new");
    EXPECT_EQ(text("b"), "new");
    EXPECT_EQ(files(), (std::vector<std::string>{"a", "b"}));
    EXPECT_TRUE(unplaced_files(folder_).empty());
}

TEST_F(FileBatches, WhatCameAfterAKillStays) {
    put("a", "old");
    leave_placing();
    put("a", "newer still"), put("b", "of somebody else");
    { ASSERT_TRUE(FileBatch::create(folder_).ok()); }
    EXPECT_EQ(text("a"), "newer still");
    EXPECT_EQ(text("b"), "of somebody else");
    EXPECT_EQ(files(), (std::vector<std::string>{"a", "b"}));
}

TEST_F(FileBatches, AKillAtAnyMomentLeavesTheOldOrTheNewOnes) {
    constexpr int kFiles = 200;
    const auto name = [](int i) { return "f" + std::to_string(1000 + i); };
    for (int trial = 0; trial < 8; ++trial) {
        for (int i = 0; i < kFiles; ++i) std::ofstream(folder_ / name(i)) << "old";
        std::string last = "old";
        in_killed_process([&] {
            Result<FileBatch> batch = FileBatch::create(folder_);
            for (int i = 0; i < kFiles; ++i) std::ofstream(batch->path(name(i))) << "new";
            std::thread killer([&] { // when so many have their places
                while (!unplaced_files(folder_).empty() || batch.ok()) {
                    std::ifstream file(folder_ / name(trial * kFiles / 8));
                    std::string word;
                    if (file >> word && word == "new") ::kill(::getpid(), SIGKILL);
                }
            });
            (void)batch->finish();
            killer.join();
        });
        { ASSERT_TRUE(FileBatch::create(folder_).ok()); }
        const std::string first = text(name(0));
        for (int i = 0; i < kFiles; ++i) ASSERT_EQ(text(name(i)), first) << i;
        EXPECT_EQ(first, "new"); // it was killed after the first was placed
        EXPECT_EQ(files().size(), std::size_t(kFiles));
    }
}
