// The benchmark that a user runs: this machine's speeds beside their rivals, and how close restored detail comes.
#pragma once

#include "fidelity.h"
#include "measurement.h"

#include "filigree/core/run_context.h"
#include "filigree/mesh/mesh.h"

#include <optional>
#include <string>
#include <vector>

namespace filigree::bench {

struct MeasureOptions {
    std::string name = "all";             ///< one of measure_names()
    std::optional<std::size_t> base = {}; ///< driver vertices; unset: as strip chooses
    std::size_t particles = 0;            ///< of every body; 0: the sizes of docs/benchmarks.md
};

struct Measured {
    std::vector<Measurement> results;
    std::vector<FidelityRow> fidelity; ///< empty unless it was asked for
};

const std::vector<std::string>& measure_names();

/// Takes a minute or so for all. When cancelled, what was measured so far. Throws BadResultAccess where the mesh cannot
/// be stripped or simulated.
Measured measure(Mesh mesh, const MeasureOptions& options, const RunContext& context);

} // namespace filigree::bench
