// Meshes that bodies meet: sheets, terrain, rooms, boxes.
#pragma once

#include "filigree/mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <initializer_list>
#include <numbers>

namespace filigree::obstacle_meshes {

inline void add_polygon(Mesh& mesh, std::initializer_list<Index> corners) {
    mesh.corners.insert(mesh.corners.end(), corners);
    mesh.face_offsets.push_back(Index(mesh.corners.size()));
}

/// n * n quads over u, v in 0 .. 1; faces look to where u x v does.
inline Mesh grid_mesh(Index n, const std::function<Vec3d(double, double)>& at, Index rows = 0) {
    const Index m = rows == 0 ? n : rows;
    Mesh mesh;
    for (Index j = 0; j <= m; ++j)
        for (Index i = 0; i <= n; ++i) mesh.positions.push_back(at(double(i) / n, double(j) / m).cast<float>());
    for (Index j = 0; j < m; ++j)
        for (Index i = 0; i < n; ++i) {
            const Index a = j * (n + 1) + i;
            add_polygon(mesh, {a, a + 1, a + n + 2, a + n + 1});
        }
    return mesh;
}

inline double terrain_height(double x, double z) { return 0.15 * std::sin(3 * x) * std::cos(3 * z); }
/// 4 m wide, faces up.
inline Mesh terrain(Index n) {
    return grid_mesh(n, [](double u, double v) {
        const double x = 4 * u - 2, z = 2 - 4 * v;
        return Vec3d(x, terrain_height(x, z), z);
    });
}
inline Mesh flat_sheet(Index n, double half = 1) {
    return grid_mesh(n, [half](double u, double v) { return Vec3d(half * (2 * u - 1), 0, half * (1 - 2 * v)); });
}

inline Mesh turned_over(Mesh mesh) {
    for (std::size_t f = 0; f + 1 < mesh.face_offsets.size(); ++f)
        std::reverse(mesh.corners.begin() + mesh.face_offsets[f], mesh.corners.begin() + mesh.face_offsets[f + 1]);
    return mesh;
}

inline Mesh joined(Mesh mesh, const Mesh& more) {
    const Index first = Index(mesh.positions.size()), corners = Index(mesh.corners.size());
    mesh.positions.insert(mesh.positions.end(), more.positions.begin(), more.positions.end());
    for (const Index corner : more.corners) mesh.corners.push_back(first + corner);
    for (std::size_t f = 1; f < more.face_offsets.size(); ++f)
        mesh.face_offsets.push_back(corners + more.face_offsets[f]);
    return mesh;
}
/// Each face twice, once either way round.
inline Mesh doubled(const Mesh& mesh) { return joined(mesh, turned_over(mesh)); }

/// Closed, faces outwards, each side of n * n quads.
inline Mesh box_mesh(const Vec3f& low, const Vec3f& high, Index n = 1) {
    Mesh mesh;
    for (int axis = 0; axis < 3; ++axis)
        for (const bool top : {false, true}) {
            const Mesh side = grid_mesh(n, [&](double u, double v) {
                Vec3d p = low.cast<double>();
                const Vec3d size = (high - low).cast<double>();
                const int a = (axis + 1) % 3, b = (axis + 2) % 3;
                p[a] += size[a] * (top ? u : v);
                p[b] += size[b] * (top ? v : u);
                if (top) p[axis] += size[axis];
                return p;
            });
            mesh = mesh.positions.empty() ? side : joined(mesh, side);
        }
    return mesh;
}
/// A room without thickness, its faces inwards.
inline Mesh box_shell(float half, Index n) {
    return turned_over(box_mesh(Vec3f::Constant(-half), Vec3f::Constant(half), n));
}
/// A room whose walls are closed, `wall` thick.
inline Mesh thick_shell(float half, float wall, Index n = 4) {
    return joined(box_shell(half, n), box_mesh(Vec3f::Constant(-half - wall), Vec3f::Constant(half + wall), n));
}

/// A cone without a bottom, its tip at the origin; 1 m long.
inline Mesh needle(float radius, Index around = 16) {
    Mesh mesh;
    mesh.positions.push_back(Vec3f::Zero());
    for (Index i = 0; i < around; ++i) {
        const double phi = 2 * std::numbers::pi * i / around;
        mesh.positions.push_back(Vec3f(radius * float(std::cos(phi)), -1, -radius * float(std::sin(phi))));
    }
    for (Index i = 0; i < around; ++i) add_polygon(mesh, {0, 1 + i, 1 + (i + 1) % around});
    return mesh;
}

/// Closed, faces outwards; poles along y.
inline Mesh sphere(float radius, Index around, Index down) {
    Mesh mesh;
    const Vec3f pole(0, radius, 0);
    mesh.positions.push_back(pole);
    for (Index j = 1; j < down; ++j)
        for (Index i = 0; i < around; ++i) {
            const double theta = std::numbers::pi * j / down, phi = 2 * std::numbers::pi * i / around;
            mesh.positions.push_back(radius * Vec3f(float(std::sin(theta) * std::cos(phi)), float(std::cos(theta)),
                                                    float(-std::sin(theta) * std::sin(phi))));
        }
    mesh.positions.push_back(-pole);
    const auto at = [&](Index j, Index i) { return 1 + (j - 1) * around + i % around; };
    for (Index i = 0; i < around; ++i) {
        add_polygon(mesh, {0, at(1, i), at(1, i + 1)});
        for (Index j = 1; j + 1 < down; ++j)
            add_polygon(mesh, {at(j, i), at(j + 1, i), at(j + 1, i + 1), at(j, i + 1)});
        add_polygon(mesh, {Index(mesh.positions.size() - 1), at(down - 1, i + 1), at(down - 1, i)});
    }
    return mesh;
}

} // namespace filigree::obstacle_meshes
