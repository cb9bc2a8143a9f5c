// Poses as meshes: the driver for other programs to move, and the pose that comes back.
#pragma once

#include "filigree/strip.h"

#include <string_view>

namespace filigree {

/// Whether a vertex scalar is one of f00 .. f22: a deformation gradient's entry in that row and column, as the mesh of
/// a moved driver holds it.
bool is_gradient_name(std::string_view scalar);

/// Puts a pose's gradients, where it has any, into a mesh of its vertices as those nine scalars. Nothing is checked.
void add_gradients(Mesh& mesh, const Pose& pose);

/// The pose that a moved driver is in: its positions, and the gradients in its vertex scalars f00 .. f22 where all nine
/// are there. origin: the model's. The mesh is not checked; whether the pose fits a model, check_pose says.
Pose pose_of_mesh(const Mesh& moved, const Vec3d& origin);

/// Level 0 for others to move: without scalars of the mesh's own that pose_of_mesh would take for gradients.
Mesh driver_mesh(const Model& model);
/// The same of a coarsest level, as level_mesh(model, 0) gives it.
Mesh driver_mesh(Mesh driver);

/// Level 0 as the pose moves it, with the scalars that pose_of_mesh reads where the pose has gradients, and without the
/// normals of the driver at rest. pose: of this model (check_pose).
Mesh posed_driver(const Model& model, const Pose& pose);

} // namespace filigree
