// The point of one triangle that is closest to another point.
#pragma once

#include "filigree/types.h"

namespace filigree {

struct ClosestTrianglePoint {
    Vec3d barycentric;
    Vec3d position;
    double squared_distance = std::numeric_limits<double>::infinity();
};

/// Defined for triangles without an area too, where it is the closest point of the edges. Method: [Ericson 2005, 5.1],
/// in double.
ClosestTrianglePoint closest_on_triangle(const Vec3d& p, const std::array<Vec3d, 3>& corners);

} // namespace filigree
