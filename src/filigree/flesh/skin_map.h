// Numbers of a skinned mesh's vertices by name: those of its mesh, and how much joints carry. Private to the library.
#pragma once

#include "filigree/skin.h"

namespace filigree {

/// One number a vertex. from: as of mesh_map, or "joint NAME": the weights of the joints that are called so and of all
/// joints below them, 0 to 1; * stands for any letters. Errors: those of mesh_map. Cost O(V + weights).
Result<std::vector<float>> skin_map(const SkinnedMesh& skin, std::string_view from);

} // namespace filigree
