// Options that deform and restore share, and poses from files.
#pragma once

#include "session.h"

#include "filigree/hierarchy/pose_mesh.h"
#include "filigree/hierarchy/restore.h"

namespace filigree::cli {

/// --law, --level and --thin-shell.
OptionList restore_options(RestoreOptions& options);

/// One of a model's own poses, counted from 1. Fails when there is no such frame.
const Pose& own_pose(const PoseSequence& poses, std::size_t frame, const std::string& path);

} // namespace filigree::cli
