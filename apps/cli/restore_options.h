// Options that deform and restore share, and poses from files.
#pragma once

#include "session.h"

#include "filigree/hierarchy/restore.h"

namespace filigree::cli {

/// --law, --level and --thin-shell.
OptionList restore_options(RestoreOptions& options);

/// A pose from a moved level 0: its positions, and the gradients in its vertex scalars f00 .. f22 where it has them.
Pose pose_from_mesh(const Mesh& mesh, const Model& model);

/// One of a model's own poses, counted from 1. Fails when there is no such frame.
const Pose& own_pose(const PoseSequence& poses, std::size_t frame, const std::string& path);

/// Level 0 for others to move: without scalars of the mesh's own that pose_from_mesh would take for gradients.
Mesh driver_mesh(const Model& model);

/// Level 0 as the pose moves it, with the scalars f00 .. f22 that pose_from_mesh reads where the pose has gradients,
/// and without the normals of the driver at rest.
Mesh posed_driver(const Model& model, const Pose& pose);

} // namespace filigree::cli
