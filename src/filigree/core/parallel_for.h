// Loops over index ranges on all threads of a RunContext.
#pragma once

#include "filigree/core/run_context.h"

#include <algorithm>
#include <cstddef>

#ifdef __SANITIZE_THREAD__
#include <atomic>
#include <thread>
#include <vector>
#else
#include <oneapi/tbb/parallel_for.h>
#endif

namespace filigree {

/// Calls body(begin, end) for consecutive pieces of [0, count), each of `grain` indices (the last may be shorter).
/// Pieces run in any order and at the same time, so a body writes only what its own indices own; the pieces
/// themselves do not depend on the number of threads. Small loops run inline.
template <class Body>
void parallel_for(const RunContext& context, std::size_t count, std::size_t grain, const Body& body) {
    const std::size_t pieces = (count + grain - 1) / grain;
    const auto run_piece = [&](std::size_t piece) { body(piece * grain, std::min(count, (piece + 1) * grain)); };
    if (pieces <= 1 || context.threads() == 1) {
        for (std::size_t piece = 0; piece < pieces; ++piece) run_piece(piece);
        return;
    }
#ifdef __SANITIZE_THREAD__
    // The thread sanitizer cannot see inside oneTBB and takes every hand-over there for a race: plain threads, then.
    std::atomic<std::size_t> next = 0;
    std::vector<std::jthread> workers;
    for (unsigned i = 0; i < context.threads(); ++i)
        workers.emplace_back([&] {
            for (std::size_t piece = next++; piece < pieces; piece = next++) run_piece(piece);
        });
#else
    context.arena().execute([&] { tbb::parallel_for(std::size_t{0}, pieces, run_piece); });
#endif
}

} // namespace filigree
