// Films of scenes: all bodies restored on the GPU, obstacles and the ground, from one camera.
#pragma once

#include "simulate_recording.h"
#include "stage.h"

namespace filigree::cli {

/// Draws every frame into every writer, which then is to be finished. Returns seconds.
double film_scene(const SceneFile& scene, const SetUpScene& ready, const Recording& recording, Stage& stage,
                  std::span<FilmWriter> writers, Session& session);

} // namespace filigree::cli
