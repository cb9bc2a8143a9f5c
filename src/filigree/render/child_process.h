// Another program that reads what we send. POSIX is in child_process_posix.cpp, Windows in child_process_windows.cpp.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace filigree {

/// A program that reads our bytes on its standard input and whose standard error we hear; its standard output goes
/// nowhere. It is killed when it goes away unfinished.
class ChildProcess {
public:
    ChildProcess();
    ChildProcess(const ChildProcess&) = delete;
    ChildProcess& operator=(const ChildProcess&) = delete;
    ~ChildProcess();

    /// words: the program's name, looked for where the system has its programs, and its arguments, in UTF-8. 0 or the
    /// error number; ENOENT when there is no such program. Ctrl-C does not reach it: we say when it ends.
    int start(std::vector<std::string> words);
    /// False when it has stopped listening.
    bool send(std::string_view bytes);
    /// Says that this was all and waits for the end; whether its exit code is 0.
    bool finish();
    /// The start of what it said on standard error.
    const std::string& complaint() const;

private:
    struct Content;
    std::unique_ptr<Content> content_;
};

/// Of what a program says on standard error, so many bytes are kept.
inline constexpr std::size_t kLongestComplaint = 4096;

} // namespace filigree
