// What a simulation's run says at its end.
#pragma once

#include "report.h"

#include "filigree/scene/scene_run.h"

namespace filigree::cli {

/// The bodies, the frames, what they took and met, and what was checked.
void report_run(const SceneFile& scene, const ReadyScene& ready, const SceneRun& run, Report& report);

} // namespace filigree::cli
