#include "filigree/context.h"

#include "filigree/core/thread_pool.h"

#include <algorithm>

namespace filigree {

RunContext::RunContext(unsigned threads)
    : threads_(threads == 0 ? processors() : std::min(threads, processors())), // more would only wait for each other
      shared_(std::make_shared<Shared>()) {}

void RunContext::cancel() const { shared_->cancelled.store(true, std::memory_order_relaxed); }
bool RunContext::is_cancelled() const { return shared_->cancelled.load(std::memory_order_relaxed); }

} // namespace filigree
