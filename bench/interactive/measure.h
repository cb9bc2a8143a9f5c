// The benchmark that a user runs: this machine's speeds beside their rivals, and how close restored detail comes.
#pragma once

#include "measurement.h"
#include "named_mesh.h"

#include "filigree/context.h"

#include <optional>
#include <string>
#include <vector>

namespace filigree::bench {

struct MeasureOptions {
    std::string name = "all";             ///< one of measure_names()
    std::optional<std::size_t> base = {}; ///< driver vertices; unset: as strip chooses
    std::size_t particles = 0;            ///< of every body; 0: the sizes of docs/benchmarks.md
    std::size_t poses = 1000;             ///< of estimate
};

/// Suites, and all: those that take one mesh.
const std::vector<std::string>& measure_names();
/// Whether a suite goes through many meshes; built-in ones where none are given.
bool takes_many_meshes(const std::string& name);

/// Takes a minute or so for all. meshes: one, or some for the suites that take many. When cancelled, what was measured
/// so far. Throws BadResultAccess where a mesh cannot be stripped or simulated.
Measured measure(std::vector<NamedMesh> meshes, const MeasureOptions& options, const RunContext& context);

} // namespace filigree::bench
