// Points spread evenly over a surface, with the areas they stand for.
#pragma once

#include "filigree/mesh.h"

namespace filigree {

struct SurfacePoints {
    std::vector<Vec3f> positions; ///< on the surface
    std::vector<Vec3f> normals;   ///< unit: the mean of the surface around
    std::vector<float> areas;     ///< share of the surface; all of it together
};

/// One point for each cube of this size that the surface passes through (but where it only touches one): the
/// outermost, so that corners and ridges have theirs. Positions are multiplied by `scale` first; `spacing` is in those
/// units. Degenerate triangles do not count. Ascending by cube. Cost O(triangles + area / spacing^2).
SurfacePoints spread_on_surface(std::span<const Vec3f> positions, std::span<const Triangle> triangles, double scale,
                                double spacing);

} // namespace filigree
