// Whether a surface is a solid's: seen from outside, only its front faces are to be seen.
#pragma once

#include "filigree/mesh.h"

#include <span>

namespace filigree {

/// True where every edge has as many triangles on one side as on the other and each part encloses a volume above zero:
/// then all back faces lie behind front faces, also where parts run through each other. Vertices at the same place
/// count as one. Cost O(n log n).
bool is_solid(std::span<const Vec3f> positions, std::span<const Triangle> triangles);

} // namespace filigree
