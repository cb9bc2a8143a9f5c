// The closest point on a set of triangles, exactly, many times.
#pragma once

#include "filigree/context.h"
#include "filigree/mesh.h"

#include <memory>

namespace filigree {

/// The closest point of triangle `triangle`: sum of barycentric[k] * corner k; barycentrics are >= 0 and sum to 1.
struct SurfacePoint {
    Index triangle = kNoIndex;
    Vec3f barycentric = Vec3f::Zero();
    Vec3f position = Vec3f::Zero();
    double distance = std::numeric_limits<double>::infinity(); ///< model units
};

/// The point of the triangle (a, b, c) closest to p and its barycentrics; defined for degenerate triangles too, where
/// it is the closest point of the edges. `triangle` is left at kNoIndex. Method: [Ericson 2005, 5.1], in double.
SurfacePoint closest_point_on_triangle(const Vec3f& p, const Vec3f& a, const Vec3f& b, const Vec3f& c);

/// A bounding-volume hierarchy over triangles. Built once in O(F log F), asked in about O(log F); queries
/// from many threads at once are safe. Copies nothing: positions and triangles must outlive it. Any scale that floats
/// can hold will do. The constructor throws std::bad_alloc when there is no memory for the hierarchy.
class ClosestPointTree {
public:
    ClosestPointTree(std::span<const Vec3f> positions, std::span<const Triangle> triangles,
                     const RunContext& context = RunContext());
    ~ClosestPointTree();
    ClosestPointTree(ClosestPointTree&&) noexcept;
    ClosestPointTree& operator=(ClosestPointTree&&) noexcept;

    /// The closest point to `query` no further than max_distance; triangle is kNoIndex when there is none, and for a
    /// query that is not finite. The lowest of equally close triangles. The same answer, to the bit, as from trying all
    /// triangles, as long as the query is within 10,000 sizes of the triangles' box; further out the distance is right
    /// to 1e-8 of itself.
    /// facing: when not zero, only triangles whose normal has a positive dot product with it count.
    SurfacePoint closest(const Vec3f& query, double max_distance = std::numeric_limits<double>::infinity(),
                         const Vec3f& facing = Vec3f::Zero()) const;
    /// Calls visit(triangle) for every triangle within `radius` of a point, some others, and some more than once.
    template <class Visit>
    void each_near(const Vec3f& point, double radius, const Visit& visit) const {
        visit_near(point, radius, &visit,
                   [](const void* of, Index triangle) { (*static_cast<const Visit*>(of))(triangle); });
    }

private:
    void visit_near(const Vec3f& point, double radius, const void* of, void (*visit)(const void*, Index)) const;
    struct Tree;
    std::unique_ptr<Tree> tree_;
};

} // namespace filigree
