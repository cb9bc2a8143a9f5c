// Films of what the window shows, drawn without it.
#pragma once

#include "playback.h"
#include "view.h"
#include "workbench.h"

namespace filigree::studio {

/// All that a film needs, so that it can be made in another thread while the window goes on.
struct FilmJob {
    State state;
    PoseSequence poses;        ///< no frames: a turntable of the pose shown
    Pose pose;                 ///< shown
    Surroundings surroundings; ///< around a body; none: nothing is drawn, the ground is below all
    bool has_surroundings = false;
    Camera camera;
    ViewSettings view;
    FilmSettings film;
};

/// Makes its own OpenGL context. Errors: as FilmWriter and HeadlessContext, cancelled. Nothing stands at `path` then.
/// Returns the number of pictures.
Result<std::size_t> export_film(const FilmJob& job, const std::string& path, const RunContext& context);

} // namespace filigree::studio
