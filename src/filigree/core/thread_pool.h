// The threads that help with parallel loops. Private to the library; loops go through core/parallel_for.h.
#pragma once

#include "filigree/core/parallel_for.h"

#include <atomic>
#include <cstddef>

namespace filigree {

/// What copies of a RunContext share.
struct RunContext::Shared {
    std::atomic<bool> cancelled = false;
    std::atomic<unsigned> helpers = 0; ///< threads at work in the context's loops, but for those that called them
};

/// Processors this process may run on.
unsigned processors();

/// Calls body(begin, end) for consecutive parts of [0, pieces) on the calling thread and up to `threads` - 1 of the
/// process's pool, which are counted in `helpers`. Returns when all are done. The first exception stops the loop and is
/// thrown again.
void run_on_pool(std::size_t pieces, unsigned threads, std::atomic<unsigned>& helpers, const LoopBody& body);

} // namespace filigree
