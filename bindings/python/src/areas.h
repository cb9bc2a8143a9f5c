// The parts of the module, one source each; module.cpp calls them in this order.
#pragma once

#include <pybind11/pybind11.h>
// Here, for all: a source that lacks a converter compiles, and fails when it is called.
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

namespace filigree::python {

namespace py = pybind11;

void add_errors(py::module_& m);
void add_meshes(py::module_& m);
void add_poses(py::module_& m);
void add_models(py::module_& m);
void add_files(py::module_& m);
void add_restoring(py::module_& m);
void add_reference(py::module_& m);
void add_warps(py::module_& m);
void add_handles(py::module_& m);
void add_comparing(py::module_& m);
void add_sampling(py::module_& m);
void add_remeshing(py::module_& m);
void add_fracturing(py::module_& m);
void add_bodies(py::module_& m);
void add_world(py::module_& m);
void add_simulation(py::module_& m);
void add_scenes(py::module_& m);
void add_exporting(py::module_& m);
void add_fitting(py::module_& m);
void add_flesh(py::module_& m);
void add_matrices(py::module_& m);
void add_geometry(py::module_& m);
void add_pictures(py::module_& m);
void mend_calls(py::module_& m); ///< of all that was added

} // namespace filigree::python
