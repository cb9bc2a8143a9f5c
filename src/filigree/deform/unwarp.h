// The way back through a warp.
#pragma once

#include "filigree/pose.h"

namespace filigree {

/// The point that the warp takes to `place`: Newton's method from `guess`, each step halved until it comes nearer; both
/// in the world. Where it does not arrive in 20 steps, or the gradient has no inverse: the best point found.
Vec3d unwarped(const SpaceWarp& warp, const Vec3d& place, const Vec3d& guess);

} // namespace filigree
