#include "calls.h"

#include <chrono>
#include <exception>
#include <map>
#include <pthread.h>
#include <thread>
#include <vector>

namespace filigree::python {

namespace {

using std::chrono::milliseconds;

constexpr milliseconds kSignalsEvery(20);
constexpr milliseconds kPatience(100); ///< after an interruption, with work that may be left

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

/// A thread that does one job after the other: to start one takes longer than a small job.
class Worker {
public:
    Worker() : thread_([this] { work(); }) {}
    ~Worker() {
        give(nullptr);
        thread_.join();
    }
    Worker(const Worker&) = delete;
    Worker& operator=(const Worker&) = delete;

    /// Null: no more will come.
    void give(std::shared_ptr<Job> job) {
        const std::lock_guard lock(mutex_);
        next_ = std::move(job);
        has_next_ = true;
        changed_.notify_one();
    }

private:
    void work() {
        for (;;) {
            std::shared_ptr<Job> job;
            {
                std::unique_lock lock(mutex_);
                changed_.wait(lock, [&] { return has_next_; });
                has_next_ = false;
                job = std::move(next_);
            }
            if (!job) return;
            do_work(job);
        }
    }

    std::mutex mutex_;
    std::condition_variable changed_;
    std::shared_ptr<Job> next_;
    bool has_next_ = false;
    std::thread thread_; ///< the last member: it uses the others
};

/// Workers that wait, and those that were left at work. Guarded by the interpreter. A forked process has none of these
/// threads, so it forgets them.
struct Workers {
    std::vector<std::unique_ptr<Worker>> idle, left;
};
Workers*& workers() {
    static Workers* all = [] {
        ::pthread_atfork(nullptr, nullptr, [] { workers() = new Workers; });
        return new Workers;
    }();
    return all;
}
std::unique_ptr<Worker> idle_worker() {
    auto& idle = workers()->idle;
    if (idle.empty()) return std::make_unique<Worker>();
    std::unique_ptr<Worker> worker = std::move(idle.back());
    idle.pop_back();
    return worker;
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
    std::unique_ptr<Worker> worker = idle_worker();
    worker->give(job);

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
        workers()->left.push_back(std::move(worker));
        std::rethrow_exception(raised);
    }
    while (!wait_for_end(*job, kPatience)) {
    }
    workers()->idle.push_back(std::move(worker));
    if (raised) std::rethrow_exception(raised);
    if (job->thrown) std::rethrow_exception(job->thrown);
}

void join_left_work() {
    Workers ended = std::move(*workers());
    *workers() = {};
    without_interpreter([&] { ended = {}; });
}

} // namespace filigree::python
