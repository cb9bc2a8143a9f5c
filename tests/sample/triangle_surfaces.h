// Surfaces that are open, turned or in pieces, and their winding numbers as plain sums.
#pragma once

#include "filigree/mesh.h"
#include "filigree/sample/inside_scan.h"

#include <cmath>
#include <numbers>
#include <random>

namespace filigree {

struct TriangleSurface {
    std::vector<Vec3f> positions;
    std::vector<Triangle> triangles;

    ScanMesh view() const { return {positions, triangles}; }
};

inline TriangleSurface shape(std::string_view name, unsigned resolution, float size = 2) {
    const Mesh mesh = make_shape(name, {.resolution = resolution, .frequency = 2, .amplitude = 0.1}).value();
    TriangleSurface surface{mesh.positions, triangulate(mesh).triangles};
    for (Vec3f& p : surface.positions) p *= size;
    return surface;
}

inline TriangleSurface box(const Vec3f& low, const Vec3f& high) {
    TriangleSurface surface;
    for (int corner = 0; corner < 8; ++corner)
        surface.positions.emplace_back(corner & 1 ? high[0] : low[0], corner & 2 ? high[1] : low[1],
                                       corner & 4 ? high[2] : low[2]);
    surface.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                         {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    return surface;
}

template <class Keep>
inline TriangleSurface only(TriangleSurface surface, const Keep& keep) {
    std::erase_if(surface.triangles, [&](const Triangle& t) {
        return !keep(Vec3f((surface.positions[t[0]] + surface.positions[t[1]] + surface.positions[t[2]]) / 3));
    });
    return surface;
}

inline TriangleSurface without_cap(TriangleSurface surface) {
    return only(std::move(surface), [](const Vec3f& p) { return p[2] < 0.6f; });
}

inline TriangleSurface with_some_turned(TriangleSurface surface) {
    std::mt19937 random(2);
    for (Triangle& t : surface.triangles)
        if (random() % 50 == 0) std::swap(t[0], t[1]);
    return surface;
}

/// Every triangle for itself.
inline TriangleSurface soup(const TriangleSurface& surface) {
    TriangleSurface result;
    for (const Triangle& t : surface.triangles) {
        const auto first = static_cast<Index>(result.positions.size());
        for (const Index v : t) result.positions.push_back(surface.positions[v]);
        result.triangles.push_back({first, first + 1, first + 2});
    }
    return result;
}

inline double brute_force(const TriangleSurface& surface, const Vec3d& point) {
    double sum = 0;
    for (const Triangle& t : surface.triangles) {
        const Vec3d a = surface.positions[t[0]].cast<double>() - point,
                    b = surface.positions[t[1]].cast<double>() - point,
                    c = surface.positions[t[2]].cast<double>() - point;
        const double la = a.norm(), lb = b.norm(), lc = c.norm();
        sum += std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
    }
    return sum / (2 * std::numbers::pi);
}

inline std::vector<Vec3d> random_points(const TriangleSurface& surface, int count, double beyond = 0.3) {
    std::mt19937 random(4);
    std::uniform_real_distribution<double> unit(-beyond, 1 + beyond);
    const Box around = bounds(surface.positions);
    std::vector<Vec3d> points;
    for (int i = 0; i < count; ++i) {
        const Vec3d share(unit(random), unit(random), unit(random));
        points.push_back(around.min + share.cwiseProduct(around.size()));
    }
    return points;
}

} // namespace filigree
