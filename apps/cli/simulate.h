// One run of a scene with all of its outputs: `simulate` reads the scene, `drop` writes it.
#pragma once

#include "animation_output.h"
#include "session.h"

#include "filigree/scene.h"

#include <cstddef>
#include <string>
#include <vector>

namespace filigree::cli {

struct SimulateArguments {
    std::string scene; ///< its file; "": it has none
    std::string save, resume;
    std::vector<std::string> outputs;
    std::size_t frames = 0, stop_at = 0; ///< 0: as the scene says; not before the end
    bool check = false, finer = false, keys = false, as_surfels = false, draft = false;
    AnimationOutput animation;
};

/// Simulates, writes every output, reports. Refuses outputs that cannot be written before the work.
void run_scene(SceneFile scene, const SimulateArguments& options, Session& session);

} // namespace filigree::cli
