// A simulation as Python has it.
#pragma once

#include "calls.h"
#include "world.h"

#include <mutex>
#include <optional>

namespace filigree::python {

/// One thread moves it at a time.
struct PySimulation {
    std::vector<std::optional<PyBody>> bodies; ///< by number; none: it was removed
    Simulation simulation;
    unsigned threads;
    std::mutex mutex = {};

    /// work() without the interpreter, alone.
    template <class Work>
    auto alone(const Work& work) {
        return without_interpreter([&] {
            const std::lock_guard lock(mutex);
            return work();
        });
    }
    /// A number of a body that is there; raises where it is not.
    std::size_t checked(std::size_t body) {
        alone([&] { return simulation.check_body(body).value(); });
        return body;
    }
};
using SimulationPtr = std::shared_ptr<PySimulation>;

/// A Body or an Actor; `what` begins the sentence where it is neither.
PyActor actor_of(const py::handle& given, const char* what);

/// That a body's own weight would flatten it, with what would do; "": it would not.
std::string weight_warning(const World& world, const Actor& actor, std::size_t number);

/// A world that changes.
void add_changes(py::class_<PySimulation, SimulationPtr>& simulation);

} // namespace filigree::python
