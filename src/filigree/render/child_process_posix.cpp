#if !defined(_WIN32)

#include "filigree/render/child_process.h"

#include "filigree/io/system/file_descriptor.h"

#include <algorithm>
#include <cerrno>
#include <csignal>

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

extern char** environ;

namespace filigree {

struct ChildProcess::Content {
    pid_t child = -1;
    FileDescriptor input, errors;
    std::string complaint;

    /// Waits for something on standard error, keeps the start of it, and closes it at its end.
    void listen() {
        char bytes[4096];
        const ssize_t got = ::read(errors.get(), bytes, sizeof bytes);
        if (got < 0 && errno == EINTR) return;
        if (got <= 0) {
            errors.close();
            return;
        }
        complaint.append(bytes, std::min(static_cast<std::size_t>(got), kLongestComplaint - complaint.size()));
    }

    int wait() {
        int status = -1;
        while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
        }
        child = -1;
        return status;
    }
};

ChildProcess::ChildProcess() : content_(std::make_unique<Content>()) {}

ChildProcess::~ChildProcess() {
    if (content_->child < 0) return;
    ::kill(content_->child, SIGKILL);
    content_->wait();
}

int ChildProcess::start(std::vector<std::string> words) {
    int input[2], errors[2];
    // A socket, not a pipe: sending to a process that has ended is an error then, and never a signal.
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, input) != 0) return errno;
    content_->input = FileDescriptor(input[0]);
    const FileDescriptor child_input(input[1]);
    if (::pipe2(errors, O_CLOEXEC) != 0) return errno;
    content_->errors = FileDescriptor(errors[0]);
    const FileDescriptor child_errors(errors[1]);

    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t streams;
    posix_spawn_file_actions_init(&streams);
    posix_spawn_file_actions_adddup2(&streams, child_input.get(), STDIN_FILENO);
    posix_spawn_file_actions_addopen(&streams, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_adddup2(&streams, child_errors.get(), STDERR_FILENO);
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    sigset_t defaults;
    sigemptyset(&defaults);
    sigaddset(&defaults, SIGPIPE); // we ignore it, and children inherit that
    posix_spawnattr_setsigdefault(&attributes, &defaults);
    posix_spawnattr_setpgroup(&attributes, 0); // Ctrl-C does not reach it
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
    pid_t child = -1;
    const int failed = ::posix_spawnp(&child, words[0].c_str(), &streams, &attributes, arguments.data(), environ);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&streams);
    if (!failed) content_->child = child;
    return failed;
}

/// The child is heard all the while: else it could wait for us to listen while we wait for it.
bool ChildProcess::send(std::string_view bytes) {
    while (!bytes.empty()) {
        pollfd waiting[2] = {{content_->input.get(), POLLOUT, 0}, {content_->errors.get(), POLLIN, 0}};
        if (::poll(waiting, 2, -1) < 0 && errno != EINTR) return false;
        if (waiting[1].revents) content_->listen();
        if (!waiting[0].revents) continue;
        const ssize_t sent = ::send(content_->input.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
        if (sent < 0 && errno != EINTR && errno != EAGAIN) return false;
        if (sent > 0) bytes.remove_prefix(static_cast<std::size_t>(sent));
    }
    return true;
}

bool ChildProcess::finish() {
    content_->input.close();
    while (content_->errors.is_open()) content_->listen();
    const int status = content_->wait();
    return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

const std::string& ChildProcess::complaint() const { return content_->complaint; }

} // namespace filigree

#endif
