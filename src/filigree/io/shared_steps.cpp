#include "filigree/io/shared_steps.h"

#include "filigree/core/now_seconds.h"
#include "filigree/core/parallel_for.h"
#include "filigree/io/file_descriptor.h"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <mutex>
#include <optional>
#include <thread>

#include <fcntl.h>
#include <unistd.h>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace filigree {

namespace {

/// Who is at which task: a lock on a byte of a file, at the hash of the task's name.
class Claims {
public:
    explicit Claims(const std::filesystem::path& file)
        : descriptor_(::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666)) {}

    /// False: another process is at it.
    bool take(const std::string& task) const { return set(task, F_WRLCK) || (errno != EAGAIN && errno != EACCES); }
    void release(const std::string& task) const { set(task, F_UNLCK); }

private:
    bool set(const std::string& task, short kind) const {
        struct flock lock {};
        lock.l_type = kind;
        lock.l_whence = SEEK_SET;
        lock.l_start = off_t(XXH3_64bits(task.data(), task.size()) >> 2);
        lock.l_len = 1;
        return ::fcntl(descriptor_.get(), F_OFD_SETLK, &lock) == 0;
    }

    FileDescriptor descriptor_;
};

constexpr double kShortestWait = 0.01, kLongestWait = 0.25; // seconds

} // namespace

/// Of those that are not there the process's own, then the others.
std::vector<std::size_t> SharedSteps::missing(const SharedStep& step) const {
    const std::vector<bool> there = folder_.are_there(step.names);
    std::vector<std::size_t> tasks;
    const std::size_t count = step.names.size(), own = chunk_.first_of(count);
    for (std::size_t k = 0; k < count; ++k)
        if (!there[(own + k) % count]) tasks.push_back((own + k) % count);
    return tasks;
}

Result<bool> SharedSteps::take(const SharedStep& step, const RunContext& context) {
    const double start = now_seconds();
    Result<bool> is_finished = make_all(step, context);
    const auto phase = std::ranges::find(seconds_, step.phase, &std::pair<std::string, double>::first);
    const double took = now_seconds() - start;
    phase == seconds_.end() ? void(seconds_.emplace_back(step.phase, took)) : void(phase->second += took);
    return is_finished;
}

Result<bool> SharedSteps::make_all(const SharedStep& step, const RunContext& context) {
    const Claims claims(folder_.file("claims"));
    std::mutex mutex; // of what follows
    std::optional<Error> failed;
    std::size_t made = 0;
    const auto make = [&](std::size_t task) -> Status {
        const std::string& name = step.names[task];
        if (!claims.take(name)) return Success{};
        std::error_code ignored;
        const bool is_there = std::filesystem::exists(folder_.file(name), ignored);
        Status done = is_there ? Success{} : step.make(task);
        claims.release(name);
        const std::scoped_lock lock(mutex);
        if (!done && !failed) failed = done.error();
        made += done && !is_there;
        return done;
    };
    tasks_ += step.names.size();
    for (double wait = kShortestWait;;) {
        const std::vector<std::size_t> left = missing(step);
        context.report(step.phase, 1 - double(left.size()) / double(std::max<std::size_t>(step.names.size(), 1)));
        if (left.empty()) return false;
        if (folder_.is_finished()) return true;
        std::atomic<bool> stops = false;
        const std::size_t before = made;
        parallel_for(context, left.size(), 1, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end && !stops && !context.is_cancelled(); ++i)
                if (!make(left[i])) stops = true;
        });
        made_ += made - before;
        if (failed && folder_.is_finished()) return true; // another process made the same, and was the last
        if (failed) return *failed;
        if (context.is_cancelled()) return cancelled_error();
        if (made > before) continue;
        const double start = now_seconds();
        std::this_thread::sleep_for(std::chrono::duration<double>(wait));
        waited_ += now_seconds() - start;
        wait = std::min(2 * wait, kLongestWait);
    }
}

} // namespace filigree
