// The scene that `filigree drop` writes, for other commands that let a mesh fall.
#pragma once

#include "filigree/mesh.h"
#include "filigree/scene.h"

#include <string>

namespace filigree::cli {

/// What `filigree drop MESH` simulates without further options. mesh: of the file, or of a model's finest level.
SceneFile default_drop_scene(const std::string& path, const Mesh& mesh);

} // namespace filigree::cli
