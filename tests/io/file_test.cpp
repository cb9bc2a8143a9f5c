#include "filigree/io/system/file.h"
#include "filigree/io/system/temporary_file.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <csignal>
#include <fstream>
#include <thread>

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

using namespace filigree;
namespace fs = std::filesystem;

namespace {

/// A folder of its own, gone at the end.
class File : public testing::Test {
protected:
    File() {
        std::string name = (fs::temp_directory_path() / "filigree-XXXXXX").string();
        folder_ = ::mkdtemp(name.data());
    }
    ~File() override {
        std::error_code ignored;
        fs::permissions(folder_, fs::perms::owner_all, ignored);
        fs::remove_all(folder_, ignored);
    }

    std::size_t files_in_folder() const {
        return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
    }

    fs::path folder_;
};

Status write(const fs::path& path, std::string_view bytes) { return write_file(path, bytes); }

} // namespace

TEST_F(File, ComesBackAsItWasWritten) {
    std::string bytes(300000, '\0');
    for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<char>(i * i);
    const std::array<std::string_view, 3> pieces = {std::string_view(bytes).substr(0, 1000), "",
                                                    std::string_view(bytes).substr(1000)};
    ASSERT_TRUE(write_file(folder_ / "näme 日本語", pieces).ok());
    EXPECT_EQ(*read_file(folder_ / "näme 日本語"), bytes);
    EXPECT_EQ(files_in_folder(), 1u); // nothing temporary stays
    ASSERT_TRUE(write(folder_ / "empty", "").ok());
    EXPECT_EQ(*read_file(folder_ / "empty"), "");
}

TEST_F(File, MissingFilesAndFoldersAreNotFound) {
    for (const fs::path& path : {folder_ / "missing", folder_, folder_ / "missing" / "deeper"}) {
        const Result<std::string> bytes = read_file(path);
        ASSERT_FALSE(bytes.ok());
        EXPECT_EQ(bytes.error().code, ErrorCode::not_found);
        EXPECT_NE(bytes.error().message.find(path.string()), std::string::npos);
    }
}

TEST_F(File, ReadsPipes) {
    const fs::path pipe = folder_ / "pipe";
    ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
    const std::string bytes(200000, 'x');
    std::thread writer([&] { std::ofstream(pipe) << bytes; });
    EXPECT_EQ(*read_file(pipe), bytes);
    writer.join();
}

TEST_F(File, WritesToDevicesInPlace) {
    EXPECT_TRUE(write("/dev/null", "x").ok());
    const Status full = write("/dev/full", "x");
    ASSERT_FALSE(full.ok());
    EXPECT_EQ(full.error().code, ErrorCode::unwritable);
    EXPECT_NE(full.error().message.find("disk is full"), std::string::npos);
}

TEST_F(File, UnwritableTargetsAreSaid) {
    for (const fs::path& path : {folder_ / "missing" / "a.obj", folder_, folder_ / std::string(300, 'x')}) {
        const Status status = write(path, "x");
        ASSERT_FALSE(status.ok());
        EXPECT_EQ(status.error().code, ErrorCode::unwritable);
    }
    EXPECT_EQ(files_in_folder(), 0u);
}

TEST_F(File, AFailedWriteLeavesTheOldFileAndNothingElse) {
    ASSERT_TRUE(write(folder_ / "a", "old").ok());
    rlimit before{};
    ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
    const rlimit small{1000, before.rlim_max}; // stands in for a full disk
    const auto handler = std::signal(SIGXFSZ, SIG_IGN);
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
    const Status status = write(folder_ / "a", std::string(5000, 'n'));
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
    std::signal(SIGXFSZ, handler);
    ASSERT_FALSE(status.ok());
    EXPECT_EQ(status.error().code, ErrorCode::unwritable);
    EXPECT_EQ(*read_file(folder_ / "a"), "old");
    EXPECT_EQ(files_in_folder(), 1u);
}

TEST_F(File, FollowsLinksAndKeepsPermissions) {
    ASSERT_TRUE(write(folder_ / "real", "old").ok());
    fs::permissions(folder_ / "real", fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read);
    fs::create_symlink("real", folder_ / "link");
    fs::create_symlink("not there yet", folder_ / "dangling");
    ASSERT_TRUE(write(folder_ / "link", "new").ok());
    ASSERT_TRUE(write(folder_ / "dangling", "born").ok());
    EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
    EXPECT_EQ(*read_file(folder_ / "real"), "new");
    EXPECT_EQ(*read_file(folder_ / "not there yet"), "born");
    EXPECT_EQ(fs::status(folder_ / "real").permissions(),
              fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read);
    fs::create_symlink("circle", folder_ / "circle");
    EXPECT_FALSE(write(folder_ / "circle", "x").ok());
}

TEST_F(File, PieceByPieceIsWholeOrNotAtAll) {
    const fs::path target = folder_ / "a";
    ASSERT_TRUE(write(target, "old").ok());
    fs::permissions(target, fs::perms::owner_read | fs::perms::owner_write | fs::perms::others_read);
    {
        Result<FileWriter> unfinished = FileWriter::create(target);
        ASSERT_TRUE(unfinished.ok());
        ASSERT_TRUE(unfinished->write("half").ok());
        EXPECT_LE(files_in_folder(), 2u); // the temporary file is beside it, where it needs a name
    }
    EXPECT_EQ(*read_file(target), "old");
    EXPECT_EQ(files_in_folder(), 1u);

    Result<FileWriter> writer = FileWriter::create(target);
    ASSERT_TRUE(writer.ok());
    FileWriter moved = std::move(*writer);
    for (const std::string_view piece : {"n", "", "ew"}) ASSERT_TRUE(moved.write(piece).ok());
    EXPECT_EQ(*read_file(target), "old"); // until it is finished
    ASSERT_TRUE(moved.finish().ok());
    EXPECT_EQ(*read_file(target), "new");
    EXPECT_EQ(fs::status(target).permissions(),
              fs::perms::owner_read | fs::perms::owner_write | fs::perms::others_read);
    EXPECT_EQ(files_in_folder(), 1u);

    ASSERT_TRUE(FileWriter::create("/dev/full")->write("").ok());
    EXPECT_EQ(FileWriter::create("/dev/full")->write("x").error().code, ErrorCode::unwritable);
    EXPECT_EQ(FileWriter::create(folder_ / "missing" / "a").error().code, ErrorCode::unwritable);
    EXPECT_EQ(FileWriter::create(folder_).error().code, ErrorCode::unwritable);
}

TEST_F(File, PiecesGoToStandardOutput) {
    const int kept = ::dup(STDOUT_FILENO);
    ASSERT_NE(std::freopen((folder_ / "out").c_str(), "w", stdout), nullptr);
    Result<FileWriter> writer = FileWriter::create("-");
    const bool done =
        writer.ok() && writer->write("to ").ok() && writer->write("standard output").ok() && writer->finish().ok();
    std::fflush(stdout);
    ::dup2(kept, STDOUT_FILENO);
    ::close(kept);
    EXPECT_TRUE(done);
    EXPECT_EQ(*read_file(folder_ / "out"), "to standard output");
}

TEST_F(File, LeftoversHinderNobodyAndAKillLeavesNone) {
    // names that a process of our number made, as they were until they became random
    for (int i = 0; i < 300; ++i)
        std::ofstream(folder_ / (".filigree-" + std::to_string(::getpid()) + "-" + std::to_string(i) + ".tmp"));
    ASSERT_TRUE(write(folder_ / "a", "new").ok());
    EXPECT_EQ(*read_file(folder_ / "a"), "new");
    EXPECT_EQ(files_in_folder(), 301u);
    const pid_t child = ::fork();
    if (child == 0) {
        Result<FileWriter> writer = FileWriter::create(folder_ / "b");
        (void)writer->write("half");
        ::kill(::getpid(), SIGKILL);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    EXPECT_FALSE(fs::exists(folder_ / "b"));
    const int unnamed = ::open(folder_.c_str(), O_WRONLY | O_TMPFILE | O_CLOEXEC, 0600);
    if (unnamed < 0) GTEST_SKIP() << "the file system has no files without a name";
    ::close(unnamed);
    EXPECT_EQ(files_in_folder(), 301u);
}

TEST_F(File, WhatAKilledWriterLeftGoesWithTheNextWriting) {
    fs::path left, beside, again;
    const int alive = create_beside(folder_ / "a", left);
    ASSERT_GE(alive, 0);
    ASSERT_TRUE(write(folder_ / "a", "one").ok()); // its owner lives
    EXPECT_TRUE(fs::exists(left));
    const int other = create_beside(folder_ / "a", beside);
    EXPECT_NE(beside, left);
    ::close(alive);
    ASSERT_TRUE(write(folder_ / "b", "another file").ok());
    EXPECT_TRUE(fs::exists(left));
    ASSERT_TRUE(write(folder_ / "a", "two").ok());
    EXPECT_FALSE(fs::exists(left));
    EXPECT_TRUE(fs::exists(beside));
    const int next = create_beside(folder_ / "a", again);
    EXPECT_EQ(again, left);
    EXPECT_EQ(fs::file_size(again), 0u);
    ::close(other);
    ::close(next);
    EXPECT_EQ(*read_file(folder_ / "a"), "two");
}

TEST_F(File, ManyThreadsWriteOneFile) {
    std::atomic<int> failures = 0;
    std::vector<std::thread> threads;
    for (int t = 0; t < 8; ++t)
        threads.emplace_back([&] {
            for (int i = 0; i < 20; ++i)
                if (!write(folder_ / "a", "whole")) ++failures;
        });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(failures, 0);
    EXPECT_EQ(*read_file(folder_ / "a"), "whole");
    EXPECT_EQ(files_in_folder(), 1u);
}

TEST_F(File, WhatIsLargerThanMemoryIsRefusedBeforeItIsRead) {
    const fs::path path = folder_ / "sparse.stl";
    std::ofstream(path) << "solid";
    std::error_code failed;
    fs::resize_file(path, std::uintmax_t{1} << 42, failed);
    if (failed) GTEST_SKIP() << "no such large files here";
    const Result<std::string> whole = read_file(path);
    ASSERT_FALSE(whole.ok());
    EXPECT_EQ(whole.error().code, ErrorCode::out_of_memory);
    EXPECT_NE(whole.error().message.find("sparse.stl"), std::string::npos);
    EXPECT_NE(whole.error().message.find("of memory"), std::string::npos) << whole.error().message;
    const Result<FileReader> reader = FileReader::open(path);
    ASSERT_TRUE(reader.ok());
    std::array<char, 5> beginning;
    EXPECT_TRUE(reader->read(0, beginning).ok()); // a part of it is read all the same
    EXPECT_EQ(reader->read_all().error().code, ErrorCode::out_of_memory);
}
