// What a simulation's run says at its end.
#pragma once

#include "report.h"

#include "filigree/scene/finer_check.h"
#include "filigree/scene/scene_run.h"

#include <span>

namespace filigree::cli {

/// Of a run: so many moments are compared with those of eight times the particles.
inline constexpr std::size_t kFinerMoments = 20;

/// The bodies, the frames, what they took and met, and what was checked.
void report_run(const SceneFile& scene, const ReadyScene& ready, const SceneRun& run, Report& report);
/// How far its meshes are from those of eight times the particles: one a body, or none where that was not asked for.
void report_finer(const ReadyScene& ready, std::span<const FinerCheck> checks, Report& report);

} // namespace filigree::cli
