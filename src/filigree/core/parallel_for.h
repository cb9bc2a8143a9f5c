// Loops over index ranges on all threads of a RunContext.
#pragma once

#include "filigree/core/run_context.h"

#include <algorithm>
#include <cstddef>

#include <oneapi/tbb/parallel_for.h>

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
    context.arena().execute([&] { tbb::parallel_for(std::size_t{0}, pieces, run_piece); });
}

} // namespace filigree
