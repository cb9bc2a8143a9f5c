// What long work needs from its caller: progress, cancel, threads, a seed. The library never prints.
#pragma once

#include "filigree/core/result.h"

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string_view>

namespace filigree {

/// Passed by const reference down every long call. Cheap to copy; copies share the cancel flag and the arena.
class RunContext {
public:
    /// threads: workers for parallel loops, 0 for all the processor has. No more than the processors we may run on, as
    /// more would only wait for each other: threads() says how many it became. Results never depend on it.
    explicit RunContext(unsigned threads = 0);

    /// Called from the calling thread with the phase's name and the fraction done, 0 to 1. Unset: silent.
    std::function<void(std::string_view phase, double fraction)> progress;

    /// Seed of everything random in the call.
    std::uint64_t seed = 1;

    unsigned threads() const { return threads_; }
    /// Calls work() such that oneTBB inside it, and so Embree, takes no more threads than these.
    void execute(const std::function<void()>& work) const;

    /// Asks the work to stop; safe from any thread and from a signal handler.
    void cancel() const { cancelled_->store(true, std::memory_order_relaxed); }
    bool is_cancelled() const { return cancelled_->load(std::memory_order_relaxed); }

    void report(std::string_view phase, double fraction) const {
        if (progress) progress(phase, fraction);
    }

private:
    struct Arena; ///< oneTBB's: no header includes it, or every file would compile it
    unsigned threads_;
    std::shared_ptr<Arena> arena_;
    std::shared_ptr<std::atomic<bool>> cancelled_;
};

/// The error that cancelled work returns.
inline Error cancelled_error() { return {ErrorCode::cancelled, "Cancelled; nothing was written."}; }

} // namespace filigree
