// Options that deform and restore share, and poses from files.
#pragma once

#include "session.h"

#include "filigree/hierarchy/restore.h"

namespace filigree::cli {

/// Adds --law, --level and --thin-shell.
void add_restore_options(CLI::App& command, RestoreOptions& options);

/// A pose from a moved level 0: its positions, and the gradients in its vertex scalars f00 .. f22 where it has them.
Pose pose_from_mesh(const Mesh& mesh, const Model& model);

/// The scalars f00 .. f22 that pose_from_mesh reads.
std::vector<VertexScalar> gradient_scalars(std::span<const Mat3f> gradients);

} // namespace filigree::cli
