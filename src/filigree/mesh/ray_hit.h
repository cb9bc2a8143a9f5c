// Which triangle a ray meets first.
#pragma once

#include "filigree/context.h"
#include "filigree/mesh.h"

#include <optional>

namespace filigree {

/// position = origin + distance * direction = sum of barycentric[k] * corner k.
struct RayHit {
    Index triangle = kNoIndex;
    Vec3f barycentric = Vec3f::Zero();
    double distance = 0; ///< in lengths of the direction
};

/// The nearest triangle in front of the ray, from either side; the lowest of equally near ones. Tries all of them, on
/// all threads: about 10 ms for a million on two, without a tree to build, so that shapes that move can be picked.
/// Degenerate triangles are never met. Method: [Moeller 1997], in double.
std::optional<RayHit> first_hit(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                                const Vec3d& origin, const Vec3d& direction, const RunContext& context);

} // namespace filigree
