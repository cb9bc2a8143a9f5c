// A mesh stripped by many processes, on one machine or many: the tasks of a strip, each from files to a file.
#pragma once

#include "filigree/hierarchy/strip.h"
#include "filigree/io/shared_work.h"

#include <functional>

namespace filigree {

struct SharedStrip {
    std::filesystem::path path;           ///< of the model
    StripOptions options;                 ///< of the blend code
    std::function<Result<Mesh>()> read;   ///< the mesh: called when one is needed, by few of the processes
    std::size_t bound_together = 1 << 18; ///< vertices that one task binds; the result does not depend on it
};

struct SharedStripReport {
    std::size_t made = 0, tasks = 0; ///< here; of all, as far as they were seen (none: the model was there before)
    double waited = 0;               ///< seconds, for what other processes were at
    /// Of each kind of step, with waiting: "mesh", "cut", "reduce", "join", "finish", "bind", "write".
    std::vector<std::pair<std::string, double>> step_seconds = {};
};

/// Makes a model together with other processes, and returns when it is in its place: byte for byte what strip and
/// write_model make of the mesh. Tasks gather in PATH.chunks; chunk says with which of each step's tasks this process
/// begins, see SharedSteps. Of the mesh as a whole five kinds of tasks know something, all of which one process does at
/// a time:
///   mesh     reads and welds it                            join-R    what a round's clusters left
///   cut-R    cuts what is left into clusters               finish    the smaller levels and the driver
///   model    reads the mesh again and writes the model
/// The others, which take most of the time, read their own part: left-R-C takes a cluster down, bound-P hangs vertices
/// on the driver. Errors: as of check_strip, SharedFolder::begin and SharedSteps::take; usage (the reference code);
/// mismatch (the mesh has changed meanwhile).
Result<SharedStripReport> strip_in_chunks(const SharedStrip& strip, const WorkChunk& chunk, const RunContext& context);

} // namespace filigree
