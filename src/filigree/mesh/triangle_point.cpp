// Based on: [Ericson 2005] 5.1.2 and 5.1.5 (closest point on a segment and a triangle). We try the plane, then the
// edges that the point is beyond, in place of the regions: this is right for triangles without an area as well.
#include "filigree/mesh/triangle_point.h"

#include <algorithm>

namespace filigree {

namespace {

constexpr double kFlat = 1e-20; // squared sine of a corner, below which a triangle has no plane in double

ClosestTrianglePoint closest_on_edge(const Vec3d& p, const std::array<Vec3d, 3>& corners, int from, int to) {
    // one direction for both triangles of an edge, so that they are equally close to the bit
    if (std::ranges::lexicographical_compare(corners[to], corners[from])) std::swap(from, to);
    const Vec3d edge = corners[to] - corners[from];
    const double squared_length = edge.squaredNorm();
    const double t = squared_length > 0 ? std::clamp(edge.dot(p - corners[from]) / squared_length, 0.0, 1.0) : 0;
    ClosestTrianglePoint result;
    result.barycentric.setZero();
    result.barycentric[from] = 1 - t;
    result.barycentric[to] = t;
    result.position = t == 1 ? corners[to] : Vec3d(corners[from] + t * edge); // corners exactly
    result.squared_distance = (p - result.position).squaredNorm();
    return result;
}

} // namespace

ClosestTrianglePoint closest_on_triangle(const Vec3d& p, const std::array<Vec3d, 3>& corners) {
    const Vec3d ab = corners[1] - corners[0], ac = corners[2] - corners[0], ap = p - corners[0];
    const Vec3d normal = ab.cross(ac);
    const double squared_area = normal.squaredNorm();
    std::array<bool, 3> beyond = {true, true, true}; // corner k's opposite edge, where nothing better is known
    if (squared_area > kFlat * ab.squaredNorm() * ac.squaredNorm()) {
        const double v = ap.cross(ac).dot(normal), w = ab.cross(ap).dot(normal), u = squared_area - v - w;
        if (u >= 0 && v >= 0 && w >= 0) {
            ClosestTrianglePoint result;
            result.barycentric = Vec3d(u, v, w) / squared_area;
            result.position = corners[0] + result.barycentric[1] * ab + result.barycentric[2] * ac;
            result.squared_distance = (p - result.position).squaredNorm();
            return result;
        }
        beyond = {u < 0, v < 0, w < 0}; // p sees no other edge
    }
    ClosestTrianglePoint best;
    for (int k = 0; k < 3; ++k) {
        if (!beyond[k]) continue;
        const ClosestTrianglePoint candidate = closest_on_edge(p, corners, (k + 1) % 3, (k + 2) % 3);
        if (candidate.squared_distance < best.squared_distance) best = candidate;
    }
    return best;
}

} // namespace filigree
