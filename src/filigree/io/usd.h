// USD as text: a mesh with its points sampled in time.
#pragma once

#include "filigree/core/result.h"
#include "filigree/core/run_context.h"
#include "filigree/mesh/mesh_animation.h"

#include <filesystem>
#include <string>
#include <vector>

namespace filigree {

/// Writes a .usda: one Mesh prim with faces, UVs, colours and normals of the rest shape, and points, extent and (where
/// the mesh has normals) normals for every frame. Text of numbers, some 30 bytes a vertex and frame: for small cases.
/// Streamed; whole or not at all. Returns warnings: what is left out, and that a file is large. Errors: unwritable,
/// unsuitable (a position that is not finite; no frames), cancelled.
Result<std::vector<std::string>> write_usda(const MeshAnimation& animation, const std::filesystem::path& path,
                                            const RunContext& context);

} // namespace filigree
