// The scene of `filigree drop`: a mesh that falls, as the text of a scene file, for people to change.
#pragma once

#include "filigree/mesh/up_axis.h"
#include "filigree/scene/dropped_body.h"

#include <cstddef>
#include <optional>
#include <string>

namespace filigree {

/// SI units.
struct DropSceneOptions {
    std::string material = "rubber";   ///< of named_materials()
    double size = 1;                   ///< the mesh's longest side
    std::optional<double> height = {}; ///< of its lowest point above what it falls onto; unset: half of the size
    ObstacleChoice obstacle = ObstacleChoice::none;
    double tilt = 0;               ///< degrees, about a level axis
    std::optional<UpAxis> up = {}; ///< unset: as the mesh's flat base has it, else as in most files of its format
    std::optional<double> young_modulus = {}; ///< unset: the material's
    std::optional<std::size_t> pieces = {};   ///< unset: 40 of a material that breaks, else 0
    std::size_t particles = 4000;             ///< about
    double duration = 3;
};

/// mesh: as it was read. mesh_name: as a scene in its own folder names the mesh. Errors: usage (there is no such
/// material), unsuitable (all of the mesh's points lie at one place; pieces of a material that does not break).
Result<std::string> drop_scene(const Mesh& mesh, const std::string& mesh_name, const DropSceneOptions& options);

} // namespace filigree
