// Few contact points that stand for many. Private to the layer.
#pragma once

#include "filigree/types.h"

#include <span>
#include <vector>

namespace filigree {

struct ManifoldPoint {
    Vec3f place;                 ///< world, m
    Vec3f normal;                ///< unit
    float separation;            ///< m, as it will be when the substep ends; below 0 is penetration
    Vec3f force = Vec3f::Zero(); ///< N, of the substep before: what had one is kept rather than what had none
    bool is_kept = false;        ///< by reduce_manifold
    Index group = 0;             ///< of similar normals, by reduce_manifold; 0: none yet
};

inline constexpr std::size_t kMostInManifold = 4; ///< points of a group
inline constexpr float kManifoldScale = 0.1f;     ///< spacings, of reduce_manifold

/// Keeps at most four points of each group of similar normals: the deepest, and those that span the largest area with
/// it. Forces of points that are not kept go to the nearest of their group that is. scale: m; points that are so much
/// further outside than the deepest hardly count.
void reduce_manifold(std::span<ManifoldPoint> points, float scale);

} // namespace filigree
