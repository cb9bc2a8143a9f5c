// How calls run: without the interpreter, and long ones so that Ctrl-C and the progress callback are heard.
#pragma once

#include "errors.h"

#include <filigree/context.h>

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>

namespace filigree::python {

/// A context for short calls, made once for each number of threads. Needs the interpreter. Nothing cancels it.
const RunContext& short_context(unsigned threads);

/// What a thread at work and the one that called it know of each other.
struct Job {
    RunContext context;
    std::function<void()> work;
    std::exception_ptr thrown; ///< by the work, once it is done

    std::mutex mutex; ///< guards what follows
    std::condition_variable changed;
    std::string phase;
    double fraction = 0;
    bool has_news = false, is_done = false;

    explicit Job(unsigned threads) : context(threads) {}
};

/// What every long call takes.
struct LongCall {
    unsigned threads = 0;
    py::object progress = py::none(); ///< called with the phase and the fraction done; False cancels
    std::uint64_t seed = 1;

    /// work(context) without the interpreter; what it returns. Raises what the callback or a signal's handler raises,
    /// once the work has ended.
    template <class Work>
    auto operator()(const Work& work) const {
        return start(work, false);
    }
    /// The same of work that owns all it needs. Where it does not end soon after an interruption (a step that cannot be
    /// broken off), it is left to itself.
    template <class Work>
    auto owning(Work work) const {
        return start(std::move(work), true);
    }

private:
    template <class Work>
    auto start(Work work, bool may_be_left) const {
        using Value = decltype(work(std::declval<const RunContext&>()));
        const auto job = std::make_shared<Job>(threads);
        const auto value = std::make_shared<std::optional<Value>>();
        job->context.seed = seed;
        job->work = [context = &job->context, value, work = std::move(work)] { value->emplace(work(*context)); };
        run(job, may_be_left);
        return std::move(**value);
    }
    void run(const std::shared_ptr<Job>& job, bool may_be_left) const;
};

/// Waits for work that was left to itself; at the interpreter's end.
void join_left_work();

/// work() without the interpreter, in this thread.
template <class Work>
auto without_interpreter(const Work& work) {
    const py::gil_scoped_release release;
    return work();
}

} // namespace filigree::python
