// The context of a long call: threads, progress, cancelling, seed.
//
// The default uses all threads and is silent. Make one to see progress, to cancel from another thread, or to limit the
// threads. Results never depend on the number of threads.
//
//     RunContext context(4);
//     context.progress = [](std::string_view phase, double fraction) { ... };
//     strip(mesh, {}, context);
#pragma once

#include "filigree/result.h"

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string_view>

namespace filigree {

/// Passed by const reference to every long call. Cheap to copy; copies share the cancel flag and the threads.
class RunContext {
public:
    /// threads: for parallel loops; 0: all that the processor has. Never more than the processors this process may use:
    /// threads() says how many. The library never prints.
    explicit RunContext(unsigned threads = 0);

    /// Called from the calling thread with the name of the phase and the fraction done, 0 to 1. Unset: silent.
    std::function<void(std::string_view phase, double fraction)> progress;

    /// Seed of everything random in the call.
    std::uint64_t seed = 1;

    unsigned threads() const { return threads_; }
    /// Calls work() so that oneTBB inside it, and so Embree, uses no more threads than these.
    void execute(const std::function<void()>& work) const;

    /// Asks the call to stop: it returns the error `cancelled`. Safe from any thread and from a signal handler.
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
