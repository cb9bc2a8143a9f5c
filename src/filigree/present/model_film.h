// A film of one model: its motion, or once around it.
#pragma once

#include "filigree/render.h"
#include "filigree/restore.h"
#include "filigree/scene/dropped_body.h"
#include "filigree/strip.h"

#include <memory>
#include <optional>
#include <string>

namespace filigree {

/// All that a film needs, so that it can be made in another thread.
struct ModelFilm {
    std::shared_ptr<const Model> model;
    RestoreOptions restore;
    SurfaceOptions surface;
    Appearance look;
    PoseSequence poses; ///< no frames: a turntable of `pose`, 90 pictures, 30 a second
    Pose pose;          ///< no positions: at rest
    /// Of poses: what is drawn in place of the restored mesh; null, and beyond the end: nothing.
    std::vector<std::shared_ptr<const Mesh>> surfaces = {};
    std::optional<Surroundings> surroundings; ///< drawn, and their ground; unset: the ground is below all
    Camera camera;                            ///< its `up` is taken from below
    std::vector<Camera> cameras = {};         ///< of poses: one a frame, the last one also beyond; empty: `camera`
    UpAxis up = UpAxis::y;
    bool ground = true; ///< where surroundings do not say
    unsigned width = 960, height = 720, passes = 8;
};

/// Makes its own OpenGL context. Returns the number of pictures. Progress: "drawing the film". Errors: as of
/// FilmWriter, HeadlessRenderer, Drawable; cancelled. Nothing stands at `path` then.
Result<std::size_t> film_model(const ModelFilm& film, const std::string& path, const RunContext& context);

} // namespace filigree
