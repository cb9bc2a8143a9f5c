// Few contact points that stand for many. Private to the layer.
#pragma once

#include "filigree/core/types.h"

#include <span>
#include <vector>

namespace filigree {

struct ManifoldPoint {
    Vec3f place;                 ///< world, m
    Vec3f normal;                ///< unit
    float separation;            ///< m; below 0 is penetration
    Vec3f force = Vec3f::Zero(); ///< N, of the substep before: what had one is kept rather than what had none
    bool is_kept = false;        ///< by reduce_manifold
};

/// Keeps at most four points of each group of similar normals: the deepest, and those that span the largest area with
/// it. Forces of points that are not kept go to the nearest of their group that is. margin: m, about the separation at
/// which points begin to count.
void reduce_manifold(std::span<ManifoldPoint> points, float margin);

} // namespace filigree
