// Based on: [Ericson 2005] 5.1.5 (closest point of a triangle).
#include "filigree/remesh/surface_walk.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace filigree {

namespace {

constexpr int kMostWalkSteps = 512;
constexpr int kMostAround = 64; // triangles tried around a vertex, to each side

struct Closest {
    Vec3d barycentric;
    Vec3d position;
    double squared_distance;
};

Closest closest_on_triangle(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    const auto found_at = [&](double u, double v, double w) {
        const Vec3d position = a + v * (b - a) + w * (c - a);
        return Closest{{u, v, w}, position, (p - position).squaredNorm()};
    };
    const auto found = [&](double v, double w) { return found_at(std::max(0.0, 1 - v - w), v, w); };
    const Vec3d ab = b - a, ac = c - a, ap = p - a;
    const double d1 = ab.dot(ap), d2 = ac.dot(ap);
    if (d1 <= 0 && d2 <= 0) return found(0, 0);
    const Vec3d bp = p - b;
    const double d3 = ab.dot(bp), d4 = ac.dot(bp);
    if (d3 >= 0 && d4 <= d3) return found(1, 0);
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return found(d1 == d3 ? 0 : d1 / (d1 - d3), 0);
    const Vec3d cp = p - c;
    const double d5 = ab.dot(cp), d6 = ac.dot(cp);
    if (d6 >= 0 && d5 <= d6) return found(0, 1);
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return found(0, d2 == d6 ? 0 : d2 / (d2 - d6));
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
        const double sum = (d4 - d3) + (d5 - d6), w = sum > 0 ? (d4 - d3) / sum : 0;
        return found_at(0, 1 - w, w); // exactly on the edge, or the walk would end here
    }
    const double sum = va + vb + vc;
    return sum > 0 ? found(vb / sum, vc / sum) : found(0, 0);
}

} // namespace

Vec3d SurfaceWalk::position(const TrianglePoint& point) const {
    const Triangle& t = surface_.triangles[point.triangle];
    return point.barycentric[0] * surface_.positions[t[0]] + point.barycentric[1] * surface_.positions[t[1]] +
           point.barycentric[2] * surface_.positions[t[2]];
}

Vec3d SurfaceWalk::normal(const TrianglePoint& point) const {
    const Triangle& t = surface_.triangles[point.triangle];
    const Vec3d& a = surface_.positions[t[0]];
    return (surface_.positions[t[1]] - a).cross(surface_.positions[t[2]] - a).normalized();
}

SurfaceWalk::Place SurfaceWalk::walk(const TrianglePoint& start, const Vec3d& target) const {
    const auto closest = [&](Index t) {
        const Triangle& v = surface_.triangles[t];
        return closest_on_triangle(target, surface_.positions[v[0]], surface_.positions[v[1]],
                                   surface_.positions[v[2]]);
    };
    Index triangle = start.triangle;
    Closest best = closest(triangle);
    for (int step = 0; step < kMostWalkSteps; ++step) {
        const Index here = triangle;
        const auto try_triangle = [&](Index t) {
            const Closest other = closest(t);
            if (!(other.squared_distance < best.squared_distance)) return;
            best = other;
            triangle = t;
        };
        const Vec3d& b = best.barycentric;
        const int zeros = (b[0] <= 0) + (b[1] <= 0) + (b[2] <= 0);
        if (zeros == 1) {
            const Index corner = b[0] <= 0 ? 0 : b[1] <= 0 ? 1 : 2; // the edge is the one opposite
            const Index h = 3 * triangle + (corner + 1) % 3;
            if (!features_[h]) try_triangle(twins_[h] / 3);
        } else if (zeros == 2) {
            const Index corner = b[0] > 0 ? 0 : b[1] > 0 ? 1 : 2, first = 3 * triangle + corner;
            Index h = first;
            for (int i = 0; i < kMostAround && !features_[previous_half_edge(h)]; ++i) { // counter-clockwise
                h = twins_[previous_half_edge(h)];
                if (h == first) break;
                try_triangle(h / 3);
            }
            if (h != first)
                for (Index g = first, i = 0; i < kMostAround && !features_[g]; ++i) {
                    g = next_half_edge(twins_[g]);
                    try_triangle(g / 3);
                }
        }
        if (triangle == here) break;
    }
    return {{triangle, best.barycentric}, best.position};
}

/// A feature half-edge that the point lies on.
Index SurfaceWalk::curve_at(const TrianglePoint& point) const {
    Index best = kNoIndex;
    double closest = 1e-4;
    for (Index k = 0; k < 3; ++k) { // the edge opposite corner k
        const Index h = 3 * point.triangle + (k + 1) % 3;
        if (features_[h] && point.barycentric[k] < closest) {
            closest = point.barycentric[k];
            best = h;
        }
    }
    if (best != kNoIndex) return best;
    Index corner = 0;
    point.barycentric.maxCoeff(&corner);
    const Index first = 3 * point.triangle + corner;
    for (Index h = first;;) {
        if (features_[h]) return h;
        const Index p = previous_half_edge(h);
        if (features_[p]) return p;
        h = twins_[p];
        if (h == first) break;
    }
    // further off than rounding explains: the triangle's own, if it has one
    for (Index h = 3 * point.triangle; h < 3 * point.triangle + 3; ++h)
        if (features_[h]) return h;
    return kNoIndex;
}

/// The next feature half-edge of the same curve, from where this one ends; kNoIndex at a corner.
Index SurfaceWalk::onward(Index half_edge) const {
    const Index vertex = to(half_edge);
    if (kinds_[vertex] != VertexKind::curve) return kNoIndex;
    Index h = next_half_edge(half_edge);
    while (!features_[h]) h = next_half_edge(twins_[h]); // clockwise: the far side of this sector
    return h;
}

SurfaceWalk::Place SurfaceWalk::slide(const TrianglePoint& start, const Vec3d& target) const {
    const Index first = curve_at(start);
    if (first == kNoIndex) return {start, position(start)};
    Place best;
    double closest = std::numeric_limits<double>::infinity();
    const auto project = [&](Index h) { // returns where on the line, 0 to 1 within the edge
        const Vec3d &a = surface_.positions[from(h)], &b = surface_.positions[to(h)];
        const double length = (b - a).squaredNorm(), t = length > 0 ? (target - a).dot(b - a) / length : 0;
        const double inside = std::clamp(t, 0.0, 1.0);
        const Vec3d p = a + inside * (b - a);
        const double distance = (p - target).squaredNorm();
        if (distance < closest) {
            closest = distance;
            best.position = p;
            best.point = {h / 3, Vec3d::Zero()};
            best.point.barycentric[h % 3] = 1 - inside;
            best.point.barycentric[next_half_edge(h) % 3] = inside;
        }
        return t;
    };
    const double t = project(first);
    if (t > 1) {
        Index h = first;
        for (int i = 0; i < kMostWalkSteps; ++i) {
            h = onward(h);
            if (h == kNoIndex || h == first || project(h) <= 1) break;
        }
    } else if (t < 0) {
        // backwards: along the twin, or, on a border, by the previous border edge
        Index h = first;
        for (int i = 0; i < kMostWalkSteps; ++i) {
            const Index vertex = from(h);
            if (kinds_[vertex] != VertexKind::curve) break;
            Index g = previous_half_edge(h);
            while (!features_[g]) g = previous_half_edge(twins_[g]);
            h = g; // ends where the last one began
            if (h == first || project(h) >= 0) break;
        }
    }
    return best;
}

} // namespace filigree
