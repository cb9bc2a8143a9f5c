// Models and poses as Python has them.
#pragma once

#include "arrays.h"
#include "calls.h"
#include "meshes.h"

#include <filigree/restore.h>
#include <filigree/strip.h>

#include <memory>
#include <optional>

namespace filigree::python {

/// A model never changes once Python has it.
struct PyModel {
    std::shared_ptr<const Model> model;
    py::dict report = {}; ///< of strip; empty for a model from a file
};

/// The finest level as a mesh: the model's own, or a copy without a driver that is behind it.
MeshPtr finest_mesh(const std::shared_ptr<const Model>& model);

std::shared_ptr<const Model> model_of(const py::handle& given, const char* name = "model");

/// A pose: one of ours, or positions of shape (d, 3), with gradients or none.
Pose pose_of(const py::handle& pose, const py::handle& gradients);
/// A sequence of poses: ours, positions of shape (f, d, 3), or a list of poses.
PoseSequence poses_of(const py::handle& poses, double frames_per_second);

} // namespace filigree::python
