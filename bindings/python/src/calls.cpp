#include "calls.h"

#include <chrono>
#include <condition_variable>
#include <exception>
#include <map>
#include <mutex>
#include <thread>

namespace filigree::python {

namespace {

constexpr std::chrono::milliseconds kSignalsEvery(20);

/// What a thread at work and the one that called it know of each other.
struct Shared {
    std::mutex mutex;
    std::condition_variable changed;
    std::string phase;
    double fraction = 0;
    bool has_news = false, is_done = false;
};

} // namespace

const RunContext& short_context(unsigned threads) {
    static std::map<unsigned, RunContext> contexts;
    return contexts.try_emplace(threads, threads).first->second;
}

/// The work is on a thread of its own: however seldom it reports, signals are looked at, and the callback runs in the
/// thread that called.
void LongCall::run(RunContext& context, const std::function<void()>& work) const {
    Shared shared;
    if (!progress.is_none()) {
        if (!PyCallable_Check(progress.ptr()))
            refuse("progress has to be None or a function of the phase's name and the fraction done.");
        context.progress = [&](std::string_view phase, double fraction) {
            const std::lock_guard lock(shared.mutex);
            shared.phase = phase;
            shared.fraction = fraction;
            shared.has_news = true;
        };
    }
    std::exception_ptr thrown;
    std::thread worker([&] {
        try {
            work();
        } catch (...) {
            thrown = std::current_exception();
        }
        const std::lock_guard lock(shared.mutex);
        shared.is_done = true;
        shared.changed.notify_one();
    });

    std::exception_ptr raised; // by a signal's handler or the callback
    for (bool is_done = false; !is_done;) {
        std::string phase;
        double fraction = 0;
        bool has_news = false;
        {
            const py::gil_scoped_release release;
            std::unique_lock lock(shared.mutex);
            is_done = shared.changed.wait_for(lock, kSignalsEvery, [&] { return shared.is_done; });
            has_news = std::exchange(shared.has_news, false);
            if (has_news) phase = shared.phase, fraction = shared.fraction;
        }
        if (raised) continue; // only the end is waited for
        try {
            if (PyErr_CheckSignals() != 0) throw py::error_already_set();
            if (has_news && progress(phase, fraction).is(py::bool_(false))) context.cancel();
        } catch (const py::error_already_set&) {
            raised = std::current_exception();
            context.cancel();
        }
    }
    without_interpreter([&] { worker.join(); });
    context.progress = nullptr;
    if (raised) std::rethrow_exception(raised);
    if (thrown) std::rethrow_exception(thrown);
}

} // namespace filigree::python
