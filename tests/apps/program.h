// Runs the command line as a user does, in a folder of the test's own.
#pragma once

#include "sanitized.h"

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

extern char** environ;

namespace filigree_test {

using Json = nlohmann::json;

struct Ran {
    int code = -1;      ///< exit code, -1 when a signal ended it
    double seconds = 0; ///< until it ended
    std::string out, err;
};

inline std::string bytes_of(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    std::ostringstream bytes;
    bytes << file.rdbuf();
    return bytes.str();
}

class Program : public testing::Test {
protected:
    Program() {
        const auto* info = testing::UnitTest::GetInstance()->current_test_info();
        folder_ = std::filesystem::temp_directory_path() /
                  ("filigree-" + std::string(info->name()) + "-" + std::to_string(::getpid()));
        std::filesystem::create_directories(folder_ / "streams");
    }
    ~Program() override { std::filesystem::remove_all(folder_); }

    std::string path(const std::string& name) const { return (folder_ / name).string(); }
    void write(const std::string& name, const std::string& bytes) const {
        std::ofstream(path(name), std::ios::binary) << bytes;
    }
    /// What lies in the test's folder, temporary files included.
    std::vector<std::string> files() const {
        std::vector<std::string> names;
        for (const auto& entry : std::filesystem::directory_iterator(folder_))
            if (entry.path().filename() != "streams") names.push_back(entry.path().filename().string());
        return names;
    }

    /// Runs `filigree` in the folder. input: a file for standard input. interrupt_after: seconds until `signal`, from
    /// when the program listens to signals, which is when its work begins.
    /// A program that takes longer than kMostSeconds is killed, and its code is -1.
    Ran run(const std::vector<std::string>& arguments, const std::string& input = "/dev/null",
            double interrupt_after = -1, int signal = SIGINT) const {
        return run_shell("exec \"$0\" \"$@\"", arguments, input, interrupt_after, signal);
    }

    /// Runs a line of shell, with the program as $0 and `arguments` behind it.
    Ran run_shell(const std::string& line, const std::vector<std::string>& arguments = {},
                  const std::string& input = "/dev/null", double interrupt_after = -1, int signal = SIGINT) const {
        const std::string out = path("streams/out"), err = path("streams/err");
        std::vector<std::string> words = {"sh", "-c", "cd '" + folder_.string() + "' && " + line, FILIGREE_PROGRAM};
        words.insert(words.end(), arguments.begin(), arguments.end());
        std::vector<char*> argv;
        for (std::string& word : words) argv.push_back(word.data());
        argv.push_back(nullptr);
        posix_spawn_file_actions_t streams;
        posix_spawn_file_actions_init(&streams);
        posix_spawn_file_actions_addopen(&streams, 0, input.c_str(), O_RDONLY, 0);
        posix_spawn_file_actions_addopen(&streams, 1, out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
        posix_spawn_file_actions_addopen(&streams, 2, err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
        pid_t child = 0;
        const auto start = std::chrono::steady_clock::now();
        const auto seconds = [&] {
            return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        };
        EXPECT_EQ(posix_spawn(&child, "/bin/sh", &streams, nullptr, argv.data(), environ), 0);
        posix_spawn_file_actions_destroy(&streams);
        int status = 0;
        bool interrupted = interrupt_after < 0, listens = false;
        double listens_from = 0;
        while (::waitpid(child, &status, WNOHANG) == 0) {
            if (!interrupted && !listens && (listens = catches(child, signal == SIGKILL ? SIGINT : signal)))
                listens_from = seconds();
            if (!interrupted && listens && seconds() > listens_from + interrupt_after)
                interrupted = ::kill(child, signal) == 0;
            if (seconds() > kMostSeconds) ::kill(child, SIGKILL);
            std::this_thread::sleep_for(std::chrono::milliseconds(2));
        }
        return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, seconds(), bytes_of(out), bytes_of(err)};
    }

    /// Runs and expects success.
    Ran ok(const std::vector<std::string>& arguments, const std::string& input = "/dev/null") const {
        Ran ran = run(arguments, input);
        EXPECT_EQ(ran.code, 0) << testing::PrintToString(arguments) << "\n" << ran.err;
        return ran;
    }
    /// Runs with --json and gives the object.
    Json json(std::vector<std::string> arguments) const {
        arguments.push_back("--json");
        return Json::parse(ok(arguments).out, nullptr, false);
    }
    /// Runs and expects this code, one line on stderr with every one of `words` in it, nothing on stdout.
    void fails(int code, const std::vector<std::string>& arguments, const std::vector<std::string>& words) const {
        const Ran ran = run(arguments);
        SCOPED_TRACE(testing::PrintToString(arguments) + "\n" + ran.err);
        EXPECT_EQ(ran.code, code);
        EXPECT_EQ(ran.out, "");
        EXPECT_EQ(std::count(ran.err.begin(), ran.err.end(), '\n'), 1);
        EXPECT_TRUE(ran.err.starts_with("filigree: ") && ran.err.ends_with(".\n"));
        for (const std::string& word : words) EXPECT_NE(ran.err.find(word), std::string::npos) << word;
    }

private:
    static constexpr double kMostSeconds = kSanitized ? 600 : 180;

    static bool catches(pid_t process, int signal) {
        std::ifstream status("/proc/" + std::to_string(process) + "/status");
        for (std::string word; status >> word;) {
            if (word != "SigCgt:") continue;
            std::uint64_t caught = 0;
            status >> std::hex >> caught;
            return caught >> (signal - 1) & 1;
        }
        return false;
    }

    std::filesystem::path folder_;
};

} // namespace filigree_test
