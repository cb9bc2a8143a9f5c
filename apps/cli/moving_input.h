// Any file that moves, as an animation of a mesh: for `fit` and `convert`.
#pragma once

#include "session.h"

#include "filigree/file.h"
#include "filigree/io/animation/point_cache.h"
#include "filigree/restore.h"

#include <cstddef>
#include <optional>
#include <string>

namespace filigree::cli {

/// What a command line names.
struct MovingFiles {
    std::string input;
    std::string mesh; ///< at rest; "": the input has it, or its first frame stands for it
    PoseFileOptions options;
};

/// The animation, and what it refers to: leave it where it is made.
struct MovingInput {
    std::optional<Model> model; ///< of a .fil
    PoseSequence poses;
    std::optional<Restorer> restorer;
    Mesh rest;
    MeshAnimation animation;
    std::size_t joints = 0;  ///< of an animated glTF's skins
    bool needs_rest = false; ///< no mesh at rest was given: a frame stands for it
};

/// The first mesh of a sequence, for its faces.
Mesh first_mesh(const std::string& path, Session& session);

/// Throws a Failure where nothing moves: .pc2, .mdd, numbered meshes, an animated glTF, USD text or a model
/// with poses do.
void open_moving_input(const MovingFiles& files, Session& session, MovingInput& input);

} // namespace filigree::cli
