// The closest point on a set of triangles, exactly, many times.
#pragma once

#include "filigree/mesh/mesh.h"

#include <memory>

namespace filigree {

/// The closest point of triangle `triangle`: sum of barycentric[k] * corner k; barycentrics are >= 0 and sum to 1.
struct SurfacePoint {
    Index triangle = kNoIndex;
    Vec3f barycentric = Vec3f::Zero();
    Vec3f position = Vec3f::Zero();
    double distance = std::numeric_limits<double>::infinity(); ///< model units
};

/// The point of the triangle (a, b, c) closest to p and its barycentrics; defined for degenerate triangles too.
/// Method: regions of the triangle's plane [Ericson 2005, 5.1.5].
SurfacePoint closest_point_on_triangle(const Vec3f& p, const Vec3f& a, const Vec3f& b, const Vec3f& c);

/// A bounding-volume hierarchy over triangles (Embree). Built once in O(F log F), asked in about O(log F); queries
/// from many threads at once are safe. Copies nothing: positions and triangles must outlive it.
class ClosestPointTree {
public:
    ClosestPointTree(std::span<const Vec3f> positions, std::span<const Triangle> triangles);
    ~ClosestPointTree();
    ClosestPointTree(ClosestPointTree&&) noexcept;
    ClosestPointTree& operator=(ClosestPointTree&&) noexcept;

    /// The closest point to `query` no further than max_distance; triangle is kNoIndex when there is none.
    /// facing: when not zero, only triangles whose normal has a positive dot product with it count.
    SurfacePoint closest(const Vec3f& query, double max_distance = std::numeric_limits<double>::infinity(),
                         const Vec3f& facing = Vec3f::Zero()) const;

private:
    struct Tree;
    std::unique_ptr<Tree> tree_;
};

} // namespace filigree
