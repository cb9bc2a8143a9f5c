#include "calls.h"

#include <chrono>
#include <exception>
#include <map>
#include <thread>
#include <vector>

namespace filigree::python {

namespace {

using std::chrono::milliseconds;

constexpr milliseconds kSignalsEvery(20);
constexpr milliseconds kPatience(100); ///< after an interruption, with work that may be left

/// Threads that were left. Guarded by the interpreter.
std::vector<std::thread>& left_threads() {
    static std::vector<std::thread> threads;
    return threads;
}

/// In the thread of the work, which may outlive the call.
void do_work(const std::shared_ptr<Job>& job) {
    try {
        job->work();
    } catch (...) {
        job->thrown = std::current_exception();
    }
    job->work = nullptr; // what it owns goes in this thread, also where nobody waits
    const std::lock_guard lock(job->mutex);
    job->is_done = true;
    job->changed.notify_one();
}

/// Waits a while for the end; whether it has come.
bool wait_for_end(Job& job, milliseconds duration) {
    const py::gil_scoped_release release;
    std::unique_lock lock(job.mutex);
    return job.changed.wait_for(lock, duration, [&] { return job.is_done; });
}

} // namespace

const RunContext& short_context(unsigned threads) {
    static std::map<unsigned, RunContext> contexts;
    return contexts.try_emplace(threads, threads).first->second;
}

/// The work is on a thread of its own: however seldom it reports, signals are looked at, and the callback runs in the
/// thread that called.
void LongCall::run(const std::shared_ptr<Job>& job, bool may_be_left) const {
    if (!progress.is_none()) {
        if (!PyCallable_Check(progress.ptr()))
            refuse("progress has to be None or a function of the phase's name and the fraction done.");
        job->context.progress = [&job = *job](std::string_view phase, double fraction) {
            const std::lock_guard lock(job.mutex);
            job.phase = phase;
            job.fraction = fraction;
            job.has_news = true;
        };
    }
    std::thread worker([job] { do_work(job); });

    std::exception_ptr raised; // by a signal's handler or the callback
    for (bool is_done = false; !is_done && !raised;) {
        is_done = wait_for_end(*job, kSignalsEvery);
        std::string phase;
        double fraction = 0;
        bool has_news = false;
        {
            const std::lock_guard lock(
                job->mutex); // held for a moment at a time, and never by who needs the interpreter
            has_news = std::exchange(job->has_news, false);
            phase = job->phase;
            fraction = job->fraction;
        }
        try {
            if (PyErr_CheckSignals() != 0) throw py::error_already_set();
            if (has_news && progress(phase, fraction).is(py::bool_(false))) job->context.cancel();
        } catch (const py::error_already_set&) {
            raised = std::current_exception();
            job->context.cancel();
        }
    }
    if (raised && may_be_left && !wait_for_end(*job, kPatience)) {
        left_threads().push_back(std::move(worker));
        std::rethrow_exception(raised);
    }
    without_interpreter([&] { worker.join(); });
    if (raised) std::rethrow_exception(raised);
    if (job->thrown) std::rethrow_exception(job->thrown);
}

void join_left_work() {
    for (std::thread& thread : std::exchange(left_threads(), {})) without_interpreter([&] { thread.join(); });
}

} // namespace filigree::python
