// Meshes as arguments: our own, and whatever has vertices and faces.
#pragma once

#include "arrays.h"

#include <filigree/mesh.h>
#include <filigree/sample.h>

#include <memory>

namespace filigree::python {

/// A mesh never changes once Python has it, so that many threads may use it, and arrays may look into it.
using MeshPtr = std::shared_ptr<Mesh>;

/// A mesh, or an object that has vertices and faces (as trimesh's) or triangles (as Open3D's). name: of the argument.
MeshPtr mesh_of(const py::handle& given, const char* name = "mesh");

/// Of a mesh, a model, or points: their box in the world.
Box box_of(const py::handle& given);

/// Warns of what of a mesh counts as turned, if anything does. Needs the interpreter.
void warn_of_turns(const OutwardReport& outward);

} // namespace filigree::python
