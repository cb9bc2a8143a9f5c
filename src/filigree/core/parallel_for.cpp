#include "filigree/core/parallel_for.h"

#include <algorithm>

#ifdef __SANITIZE_THREAD__
#include <atomic>
#include <thread>
#include <vector>
#else
#include <oneapi/tbb/parallel_for.h>
#endif

namespace filigree {

void run_pieces(const RunContext& context, std::size_t count, std::size_t grain, const LoopBody& body) {
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
    context.execute([&] { tbb::parallel_for(std::size_t{0}, pieces, run_piece); });
#endif
}

} // namespace filigree
