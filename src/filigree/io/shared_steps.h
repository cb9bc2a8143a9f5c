// Works whose parts need each other, shared by processes that know nothing of each other: steps, one after the other.
#pragma once

#include "filigree/io/shared_work.h"

#include <utility>

namespace filigree {

/// Tasks that need nothing of each other, and all of which the next step needs.
struct SharedStep {
    std::vector<std::string> names; ///< of the tasks' files in the folder
    std::string phase;              ///< of the progress
    /// Makes a task's file, whole or not at all, and the same in every process. On several threads at once.
    std::function<Status(std::size_t task)> make;
};

/// Goes through the steps of a work. A task is made by whoever comes to it first: each process begins with its own
/// share of a step, then takes what nobody has begun, and waits for what others are at. While it makes a task it holds
/// a lock, which goes with it when it is killed, so another one takes that task. Nobody waits for a process that has
/// not been started. Where the file system has no locks some tasks are made twice, to the same bytes.
class SharedSteps {
public:
    SharedSteps(const SharedFolder& folder, const WorkChunk& chunk) : folder_(folder), chunk_(chunk) {}

    /// Returns when all tasks of a step are there. True: the whole work is finished meanwhile. Errors: the tasks',
    /// cancelled; what was made stays.
    Result<bool> take(const SharedStep& step, const RunContext& context);

    std::size_t made() const { return made_; }   ///< tasks, here
    std::size_t tasks() const { return tasks_; } ///< of the steps so far
    double waited() const { return waited_; }    ///< seconds
    /// How long each phase took here, with waiting, in the order in which they came first.
    const std::vector<std::pair<std::string, double>>& seconds() const { return seconds_; }

private:
    std::vector<std::size_t> missing(const SharedStep& step) const;
    Result<bool> make_all(const SharedStep& step, const RunContext& context);

    const SharedFolder& folder_;
    const WorkChunk& chunk_;
    std::size_t made_ = 0, tasks_ = 0;
    double waited_ = 0;
    std::vector<std::pair<std::string, double>> seconds_;
};

} // namespace filigree
