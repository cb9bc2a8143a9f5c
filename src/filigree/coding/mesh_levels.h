// The levels of a mesh's code, for those who write them and those who read a beginning of them.
#pragma once

#include "filigree/coding/level_reader.h"
#include "filigree/coding/level_writer.h"
#include "filigree/coding/mesh_code.h"

namespace filigree {

/// How a mesh's levels are coded: steps four times as long first, then quarters of them, unless they are long already.
LevelCodeOptions level_options(const PackOptions& options);

/// What a reader of levels has so far, as triangles: texture coordinates, materials and colours where levels have any,
/// no normals. Copies of vertices where sheets meet.
Mesh mesh_of_levels(const LevelReader& levels, const PackedMesh& coded);

} // namespace filigree
