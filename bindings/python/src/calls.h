// How calls run: without the interpreter, and long ones so that Ctrl-C and the progress callback are heard.
#pragma once

#include "errors.h"

#include <filigree/core/run_context.h>

#include <functional>
#include <optional>

namespace filigree::python {

/// A context for short calls, made once for each number of threads. Needs the interpreter. Nothing cancels it.
const RunContext& short_context(unsigned threads);

/// What every long call takes.
struct LongCall {
    unsigned threads = 0;
    py::object progress = py::none(); ///< called with the phase and the fraction done; False cancels
    std::uint64_t seed = 1;

    /// work(context) without the interpreter; what it returns. Raises what the callback or a signal's handler raises.
    template <class Work>
    auto operator()(const Work& work) const {
        RunContext context(threads);
        context.seed = seed;
        std::optional<decltype(work(context))> value;
        run(context, [&] { value.emplace(work(context)); });
        return std::move(*value);
    }

private:
    void run(RunContext& context, const std::function<void()>& work) const;
};

/// work() without the interpreter, in this thread.
template <class Work>
auto without_interpreter(const Work& work) {
    const py::gil_scoped_release release;
    return work();
}

} // namespace filigree::python
