#include "filigree/core/run_context.h"

#include <algorithm>

#include <oneapi/tbb/info.h>
#include <oneapi/tbb/task_arena.h>

namespace filigree {

namespace {

/// More workers than processors only wait for each other (and oneTBB would print that they do).
unsigned clamp_threads(unsigned wanted) {
    const unsigned processors = static_cast<unsigned>(tbb::info::default_concurrency()); // those we may run on
    return wanted == 0 ? processors : std::min(wanted, processors);
}

} // namespace

struct RunContext::Arena {
    explicit Arena(unsigned threads) : arena(static_cast<int>(threads)) {}
    tbb::task_arena arena;
};

RunContext::RunContext(unsigned threads)
    : threads_(clamp_threads(threads)), arena_(std::make_shared<Arena>(threads_)),
      cancelled_(std::make_shared<std::atomic<bool>>(false)) {}

void RunContext::execute(const std::function<void()>& work) const { arena_->arena.execute(work); }

} // namespace filigree
