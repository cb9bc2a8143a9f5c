// What a ray meets first.
#pragma once

#include "filigree/core/types.h"

#include <limits>
#include <optional>

namespace filigree {

struct RayOptions {
    double reach = std::numeric_limits<double>::infinity(); ///< m; what is further is not met
    std::optional<std::size_t> ignore = std::nullopt;       ///< a body that the ray goes through
};

struct WorldHit {
    double distance = 0;                 ///< m, from the ray's origin
    Vec3d place = Vec3d::Zero();         ///< world, m
    Vec3d normal = Vec3d::Zero();        ///< unit, outwards; of walls with two sides to where the ray comes from
    std::optional<std::size_t> body;     ///< what was met: a body, or
    std::optional<std::size_t> obstacle; ///< an obstacle
    Vec3f rest = Vec3f::Zero();          ///< m, of a body: the point on the body at rest, as Hand::point wants it
};

} // namespace filigree
