// What deform and restore share: options, and what is expected of a pose.
#pragma once

#include "report.h"
#include "session.h"

#include "filigree/hierarchy/pose_mesh.h"
#include "filigree/restore.h"

namespace filigree::cli {

/// --level.
OptionList restore_options(RestoreOptions& options);

/// Into the JSON, with a warning where the driver is too coarse for the pose, as the pose alone shows.
void note_expected_error(const PoseError::Estimate& estimate, const Model& model, const Pose& pose, Report& report,
                         Session& session);

/// One of a model's own poses, counted from 1. Fails when there is no such frame.
const Pose& own_pose(const PoseSequence& poses, std::size_t frame, const std::string& path);

} // namespace filigree::cli
