// What is around bodies, and how they start, as Python has it.
#pragma once

#include "bodies.h"

#include <filigree/physics/simulation.h>

namespace filigree::python {

/// A body with how it starts.
struct PyActor {
    PyBody body;
    Actor actor;
};

PyActor make_actor(const PyBody& body, const py::object& move, const py::object& axis, double degrees,
                   const py::object& velocity, const py::object& spin, const py::object& spin_degrees, bool may_sleep);

/// A number, or (times, values).
Keyed<double> keyed_number_of(const py::object& given, const char* name);

} // namespace filigree::python
