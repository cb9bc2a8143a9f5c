// USD as text: a mesh with its points sampled in time.
#pragma once

#include "filigree/io/point_cache_formats.h"

namespace filigree {

/// Writes a .usda: one Mesh prim with the faces, UVs and colours of the rest shape, and points, extent and (where the
/// mesh has normals) normals for every frame, by the mesh's origin, which is the prim's translation, and the
/// animation's unit (metersPerUnit) where it is known. Text of numbers,
/// some 30 bytes a vertex and frame: for small cases. Streamed; whole or not at all. Adds warnings: what is left out,
/// and that the file is large. Errors: unwritable, cancelled, and what the animation gives.
Status write_usda(const MeshAnimation& animation, const std::filesystem::path& path, std::vector<std::string>& warnings,
                  const RunContext& context);

} // namespace filigree
