#include "filigree/core/parallel_for.h"

#include "filigree/core/thread_pool.h"

#include <algorithm>

namespace filigree {

void run_pieces(const RunContext& context, std::size_t count, std::size_t grain, const LoopBody& body) {
    const std::size_t pieces = (count + grain - 1) / grain;
    const auto run = [&](std::size_t first, std::size_t last) {
        for (std::size_t piece = first; piece < last; ++piece)
            body(piece * grain, std::min(count, (piece + 1) * grain));
    };
    if (pieces <= 1 || context.threads() == 1)
        run(0, pieces);
    else
        run_on_pool(pieces, context.threads(), context.shared_->helpers, LoopBody(run));
}

} // namespace filigree
