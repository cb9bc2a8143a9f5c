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

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string_view>

namespace filigree {

class LoopBody;

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

    /// Asks the call to stop: it returns the error `cancelled`. Safe from any thread and from a signal handler.
    void cancel() const;
    bool is_cancelled() const;

    void report(std::string_view phase, double fraction) const {
        if (progress) progress(phase, fraction);
    }

private:
    struct Shared; ///< by copies
    friend void run_pieces(const RunContext&, std::size_t, std::size_t, const LoopBody&);
    unsigned threads_;
    std::shared_ptr<Shared> shared_;
};

/// The error that cancelled work returns.
inline Error cancelled_error() { return {ErrorCode::cancelled, "Cancelled; nothing was written."}; }

} // namespace filigree
