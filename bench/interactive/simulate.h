// What bodies cost, and how near they come: the part of `filigree bench` about physics.
#pragma once

#include "measurement.h"

#include "filigree/context.h"
#include "filigree/mesh.h"

#include <optional>
#include <vector>

namespace filigree::bench {

struct SimulateBenchOptions {
    std::size_t particles = 0;            ///< of every body; 0: the sizes of docs/benchmarks.md
    std::optional<std::size_t> base = {}; ///< driver vertices of the falling mesh; unset: 1,000
};

/// Times are the least of a few runs of the same bytes, frame by frame. With several threads, their gain over one and
/// the number of bytes in which the final states differ are measured as well. When cancelled, the figures so far.
std::vector<Measurement> measure_simulation(const Mesh& mesh, const SimulateBenchOptions& options,
                                            const RunContext& context);

} // namespace filigree::bench
