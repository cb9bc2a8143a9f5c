// Meshes as arguments: our own, and whatever has vertices and faces.
#pragma once

#include "arrays.h"

#include <filigree/mesh.h>
#include <filigree/sample.h>

#include <memory>

namespace filigree::python {

/// A mesh never changes once Python has it, so that many threads may use it, and arrays may look into it.
using MeshPtr = std::shared_ptr<Mesh>;

/// Whether something is a mesh: one of ours, an object that has vertices and faces (as trimesh's) or triangles (as
/// Open3D's), or a tuple (V, F) of positions and whole numbers (as libigl's).
bool is_mesh_like(const py::handle& given);
/// The mesh. name: of the argument.
MeshPtr mesh_of(const py::handle& given, const char* name = "mesh");

/// The same, or points of shape (n, 3), which become a mesh without faces.
MeshPtr mesh_or_points_of(const py::handle& given, const char* name);

/// Of a mesh, a model, or points: where they are in the world, and their box.
std::vector<Vec3d> world_points_of(const py::handle& given);
Box box_of(const py::handle& given);

/// Warns of what of a mesh counts as turned, if anything does. Needs the interpreter.
void warn_of_turns(const OutwardReport& outward);

} // namespace filigree::python
