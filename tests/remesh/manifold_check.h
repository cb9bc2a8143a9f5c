// What every manifold surface must be, found with plain maps, and voxel bodies to try it on.
#pragma once

#include "filigree/mesh.h"
#include "filigree/remesh/manifold_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <functional>
#include <gtest/gtest.h>
#include <map>
#include <numeric>
#include <random>
#include <set>

namespace filigree_test {

using namespace filigree;

inline ManifoldSurface manifold(const Mesh& mesh) {
    CleanReport report;
    return *make_manifold(mesh, report, RunContext(1));
}

/// The sets that `count` things fall into when those that `join` names are joined.
inline std::size_t set_count(std::size_t count,
                             const std::function<void(const std::function<void(std::size_t, std::size_t)>&)>& joins) {
    std::vector<std::size_t> parent(count);
    std::iota(parent.begin(), parent.end(), std::size_t{0});
    const std::function<std::size_t(std::size_t)> root = [&](std::size_t i) {
        while (parent[i] != i) i = parent[i] = parent[parent[i]];
        return i;
    };
    std::size_t sets = count;
    joins([&](std::size_t a, std::size_t b) {
        a = root(a), b = root(b);
        if (a != b) parent[a] = b, --sets;
    });
    return sets;
}

/// Fails unless the triangles are an oriented manifold in which an edge or a triangle is known by its vertices.
inline void expect_manifold(const ManifoldSurface& surface) {
    const auto& triangles = surface.triangles;
    ASSERT_TRUE(surface.source_corners.empty() || surface.source_corners.size() == triangles.size());
    std::map<std::pair<Index, Index>, std::vector<std::size_t>> edges;
    std::set<std::array<Index, 3>> vertex_sets;
    std::vector<std::vector<std::size_t>> at(surface.positions.size());
    for (std::size_t t = 0; t < triangles.size(); ++t) {
        std::array<Index, 3> sorted = triangles[t];
        std::ranges::sort(sorted);
        ASSERT_LT(sorted[2], surface.positions.size());
        ASSERT_TRUE(sorted[0] != sorted[1] && sorted[1] != sorted[2]) << "triangle " << t << " repeats a vertex";
        ASSERT_TRUE(vertex_sets.insert(sorted).second) << "triangle " << t << " is there twice";
        for (std::size_t i = 0; i < 3; ++i) {
            at[triangles[t][i]].push_back(t);
            auto& direction = edges[{triangles[t][i], triangles[t][(i + 1) % 3]}];
            direction.push_back(t);
            ASSERT_EQ(direction.size(), 1u) << "two triangles run along an edge the same way";
        }
    }
    for (std::size_t v = 0; v < at.size(); ++v) {
        ASSERT_FALSE(at[v].empty()) << "vertex " << v << " is not used";
        const std::size_t fans = set_count(at[v].size(), [&](const auto& join) {
            std::map<Index, std::size_t> neighbour;
            for (std::size_t k = 0; k < at[v].size(); ++k)
                for (const Index other : triangles[at[v][k]]) {
                    if (other == v) continue;
                    const auto [place, is_new] = neighbour.try_emplace(other, k);
                    if (!is_new) join(place->second, k);
                }
        });
        ASSERT_EQ(fans, 1u) << "at vertex " << v;
    }
    for (const Vec3d& p : surface.positions) ASSERT_TRUE(p.allFinite());
}

/// Fails unless each triangle lies on three corners of one face, or on none.
inline void expect_sources(const ManifoldSurface& surface, const Mesh& mesh) {
    ASSERT_EQ(surface.source_corners.size(), surface.triangles.size());
    for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
        const Triangle& corners = surface.source_corners[t];
        if (corners == Triangle{kNoIndex, kNoIndex, kNoIndex}) continue;
        std::set<std::ptrdiff_t> faces;
        for (std::size_t i = 0; i < 3; ++i) {
            ASSERT_LT(corners[i], mesh.corner_count());
            ASSERT_EQ(surface.positions[surface.triangles[t][i]],
                      mesh.positions[mesh.corners[corners[i]]].cast<double>());
            faces.insert(std::ranges::upper_bound(mesh.face_offsets, corners[i]) - mesh.face_offsets.begin());
        }
        ASSERT_EQ(faces.size(), 1u);
        ASSERT_EQ((std::set<Index>(corners.begin(), corners.end()).size()), 3u);
    }
}

inline double volume(const ManifoldSurface& surface) {
    double six = 0;
    for (const auto& [a, b, c] : surface.triangles)
        six += surface.positions[a].dot(surface.positions[b].cross(surface.positions[c]));
    return six / 6;
}

inline void add_triangle(Mesh& mesh, Index a, Index b, Index c) { mesh.add_face(std::array<Index, 3>{a, b, c}); }

/// Adds the mesh `part`, moved.
inline void append(Mesh& mesh, const Mesh& part, const Vec3f& move = Vec3f::Zero()) {
    const Index first = static_cast<Index>(mesh.vertex_count());
    for (const Vec3f& p : part.positions) mesh.positions.push_back(p + move);
    for (std::size_t f = 0; f < part.face_count(); ++f) {
        std::vector<Index> face(part.face(f).begin(), part.face(f).end());
        for (Index& vertex : face) vertex += first;
        mesh.add_face(face);
    }
}

/// The side of a unit cube that lies at the high (1) or low (0) end of an axis, counter-clockwise seen from outside.
inline std::array<Eigen::Vector3i, 4> cube_side(const Eigen::Vector3i& cell, int axis, int high) {
    Eigen::Vector3i u = Eigen::Vector3i::Zero(), v = u, corner = cell;
    u[(axis + 1) % 3] = v[(axis + 2) % 3] = 1;
    corner[axis] += high;
    std::array<Eigen::Vector3i, 4> side = {corner, corner + u, corner + u + v, corner + v};
    if (!high) std::ranges::reverse(side);
    return side;
}

/// A closed cube of six quads for each cell, over shared vertices. walls: also between two cells, once for each.
inline Mesh voxel_body(const std::set<std::array<int, 3>>& cells, bool walls) {
    Mesh mesh;
    std::map<std::array<int, 3>, Index> vertices;
    for (const auto& cell : cells)
        for (int axis = 0; axis < 3; ++axis)
            for (int high = 0; high < 2; ++high) {
                std::array<int, 3> beside = cell;
                beside[std::size_t(axis)] += high ? 1 : -1;
                if (!walls && cells.contains(beside)) continue;
                std::vector<Index> face;
                for (const Eigen::Vector3i& p : cube_side({cell[0], cell[1], cell[2]}, axis, high)) {
                    const auto [place, is_new] =
                        vertices.try_emplace({p.x(), p.y(), p.z()}, static_cast<Index>(mesh.vertex_count()));
                    if (is_new) mesh.positions.push_back(p.cast<float>());
                    face.push_back(place->second);
                }
                mesh.add_face(face);
            }
    return mesh;
}

/// Each cell of a cube of n^3 is there with the given chance.
inline std::set<std::array<int, 3>> random_cells(unsigned seed, int n, double chance) {
    std::mt19937 random(seed);
    std::set<std::array<int, 3>> cells;
    for (int i = 0; i < n * n * n; ++i)
        if (double(random() % 1000) < 1000 * chance) cells.insert({i % n, i / n % n, i / n / n});
    return cells;
}

} // namespace filigree_test
