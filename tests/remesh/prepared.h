// Surfaces ready to be remeshed, and what every map and grid over them must be.
#pragma once

#include "filigree/file.h"
#include "filigree/mesh.h"
#include "filigree/mesh/edges.h"
#include "filigree/remesh/feature_curves.h"
#include "filigree/remesh/manifold_surface.h"
#include "filigree/remesh/patch_grid.h"
#include "io/corpus.h"
#include "threads.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <map>
#include <numbers>
#include <random>
#include <set>

namespace filigree_test {

using namespace filigree;

inline double area_of(const ManifoldSurface& surface) {
    double area = 0;
    for (const auto& [a, b, c] : surface.triangles)
        area += 0.5 *
                (surface.positions[b] - surface.positions[a]).cross(surface.positions[c] - surface.positions[a]).norm();
    return area;
}

/// A surface and all that refers to it, so it stays where it is.
struct Prepared {
    ManifoldSurface surface;
    std::vector<Index> twins;
    FeatureCurves curves;
    std::vector<std::uint8_t> features;  ///< borders too
    std::vector<Index> curve_half_edges; ///< of those, one an edge
    std::vector<VertexKind> kinds;
    double diagonal = 0;

    /// patches: about how many will be wanted.
    explicit Prepared(const Mesh& mesh, std::size_t patches = 100, double angle_deg = 40) {
        CleanReport report;
        auto manifold = make_manifold(mesh, report, kOneThread);
        EXPECT_TRUE(manifold.ok());
        surface = std::move(*manifold);
        twins = opposite_half_edges(surface.triangles, surface.positions.size());
        curves = find_feature_curves(surface, twins, {angle_deg, std::sqrt(area_of(surface) / double(patches))});
        features = curves.half_edges;
        for (Index h = 0; h < twins.size(); ++h) {
            features[h] |= twins[h] == kNoIndex;
            if (features[h] && (twins[h] == kNoIndex || h < twins[h])) curve_half_edges.push_back(h);
        }
        const SurfaceMap start = map();
        for (Index v = 0; v < surface.positions.size(); ++v) kinds.push_back(start.kind(v));
        Eigen::AlignedBox3d box;
        for (const Vec3d& p : surface.positions) box.extend(p);
        diagonal = box.diagonal().norm();
    }
    Prepared(const Prepared&) = delete;
    Prepared& operator=(const Prepared&) = delete;

    SurfaceMap map() const { return SurfaceMap(surface, twins, curves.half_edges, curves.corners); }
    SurfaceWalk walk() const { return SurfaceWalk(surface, twins, features, kinds); }
    SurfaceTopology topology() const { return surface_topology(surface); }

    /// How far a place is from the nearest feature edge or border edge.
    double distance_to_curves(const Vec3d& p) const {
        double least = std::numeric_limits<double>::infinity();
        for (const Index h : curve_half_edges) {
            const Vec3d &a = surface.positions[half_edge_start(surface.triangles, h)],
                        &b = surface.positions[half_edge_end(surface.triangles, h)];
            const double length = (b - a).squaredNorm();
            const double t = length > 0 ? std::clamp((p - a).dot(b - a) / length, 0.0, 1.0) : 0;
            least = std::min(least, (a + t * (b - a) - p).norm());
        }
        return least;
    }
};

inline Mesh triangle_mesh(std::vector<Vec3f> positions, const std::vector<Triangle>& triangles) {
    Mesh mesh;
    mesh.positions = std::move(positions);
    for (const Triangle& t : triangles) mesh.add_face(t);
    return mesh;
}

inline Mesh bumpy_torus() { return make_torus({.resolution = 16, .frequency = 4, .amplitude = 0.05}); }

/// An open square with a sharp ridge along the middle, and waves.
inline Mesh ridged_sheet(unsigned resolution = 16) {
    Mesh mesh = make_wavy_plane({.resolution = resolution, .frequency = 1, .amplitude = 0.02});
    for (Vec3f& p : mesh.positions) p.z() += 0.8f - 1.6f * std::abs(p.x());
    return mesh;
}

/// A cube of twelve triangles.
inline Mesh plain_cube(float side = 1) {
    std::vector<Vec3f> positions;
    for (int k = 0; k < 8; ++k)
        positions.emplace_back(side * float(k & 1), side * float(k >> 1 & 1), side * float(k >> 2));
    std::vector<Triangle> triangles;
    for (const auto& [a, b, c, d] :
         {std::array<Index, 4>{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}) {
        triangles.push_back({a, b, c});
        triangles.push_back({a, c, d});
    }
    return triangle_mesh(positions, triangles);
}

/// A part as CAD programs make them: an outline with a straight, an inner corner of 90 degrees and a quarter circle,
/// drawn out. `waist`: curved along the height too. Closed.
inline Mesh machined_part(int arc = 24, int layers = 12, double waist = 0.15) {
    std::vector<Vec2d> outline = {{0, 0}, {2, 0}, {2, 0.7}, {1.2, 0.7}}; // counter-clockwise; the last corner is inner
    for (int i = 0; i <= arc; ++i) {                                     // from (1.2, 1.0) round to (0.7, 1.5)
        const double angle = 0.5 * std::numbers::pi * i / arc;
        outline.push_back(Vec2d(0.7, 1.0) + 0.5 * Vec2d(std::cos(angle), std::sin(angle)));
    }
    outline.push_back({0, 1.5});
    const Index n = static_cast<Index>(outline.size());
    std::vector<Vec3f> positions;
    for (int k = 0; k <= layers; ++k) {
        const double z = double(k) / layers, scale = 1 - waist * std::sin(std::numbers::pi * z);
        for (const Vec2d& p : outline)
            positions.push_back(Vec3d(1 + scale * (p.x() - 1), 0.5 + scale * (p.y() - 0.5), z).cast<float>());
    }
    std::vector<Triangle> triangles;
    for (Index k = 0; k < Index(layers); ++k)
        for (Index i = 0; i < n; ++i) {
            const Index a = k * n + i, b = k * n + (i + 1) % n, c = b + n, d = a + n;
            triangles.push_back({a, b, c});
            triangles.push_back({a, c, d});
        }
    // caps: fans from the inner corner, from which the whole outline is seen
    const Index inner = 3, top = Index(layers) * n;
    for (Index i = 0; i < n; ++i) {
        const Index j = (i + 1) % n;
        if (i == inner || j == inner) continue;
        triangles.push_back({inner, j, i});
        triangles.push_back({top + inner, top + i, top + j});
    }
    return triangle_mesh(positions, triangles);
}

/// A strip that closes with half a turn: one side, one border.
inline Mesh moebius_strip(int around = 96, int across = 8) {
    Mesh mesh;
    for (int i = 0; i < around; ++i)
        for (int j = 0; j <= across; ++j) {
            const double angle = 2 * std::numbers::pi * i / around, w = 0.4 * (double(j) / across - 0.5);
            const double r = 1 + w * std::cos(angle / 2);
            mesh.positions.push_back(
                Vec3d(r * std::cos(angle), r * std::sin(angle), w * std::sin(angle / 2)).cast<float>());
        }
    const auto at = [&](int i, int j) {
        return i < around ? Index(i * (across + 1) + j) : Index(across - j); // the last column meets the first turned
    };
    for (int i = 0; i < around; ++i)
        for (int j = 0; j < across; ++j)
            mesh.add_face(std::array<Index, 4>{at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
    return mesh;
}

/// The map's triangles as a surface of their own.
inline ManifoldSurface surface_of(const SurfaceMap& map) {
    ManifoldSurface surface;
    std::vector<Index> id(map.vertex_count(), kNoIndex);
    for (Index s = 0; s < map.slot_count(); ++s) {
        if (map.is_removed(s)) continue;
        Triangle t = map.triangle(s);
        for (Index& v : t) {
            if (id[v] == kNoIndex) {
                id[v] = static_cast<Index>(surface.positions.size());
                surface.positions.push_back(map.position(v));
            }
            v = id[v];
        }
        surface.triangles.push_back(t);
    }
    return surface;
}

/// Fails unless half-edges, flags, stars and counts are those of an oriented manifold with the surface's topology.
inline void expect_sound(const SurfaceMap& map, const Prepared& on) {
    std::map<std::pair<Index, Index>, Index> directed;
    std::vector<Index> triangles_at(map.vertex_count(), 0), border_out(map.vertex_count(), kNoIndex);
    std::size_t count = 0;
    for (Index s = 0; s < map.slot_count(); ++s) {
        if (map.is_removed(s)) continue;
        ++count;
        for (Index h = 3 * s; h < 3 * s + 3; ++h) {
            ASSERT_TRUE(directed.emplace(std::pair(map.from(h), map.to(h)), h).second) << "an edge twice the same way";
            ASSERT_FALSE(map.is_vertex_removed(map.from(h)));
            ++triangles_at[map.from(h)];
            if (!map.is_border(h)) continue;
            ASSERT_EQ(border_out[map.from(h)], kNoIndex) << "two fans at vertex " << map.from(h);
            border_out[map.from(h)] = h;
        }
    }
    ASSERT_EQ(count, map.triangle_count());
    for (const auto& [ends, h] : directed) {
        const auto back = directed.find({ends.second, ends.first});
        ASSERT_EQ(map.twin(h), back == directed.end() ? kNoIndex : back->second) << "half-edge " << h;
        ASSERT_EQ(map.is_feature(h), map.is_border(h) || map.is_feature(map.twin(h)));
    }
    std::vector<Index> curve_edges(map.vertex_count(), 0);
    for (const auto& [ends, h] : directed)
        if (map.is_feature(h) && (map.is_border(h) || h < map.twin(h)))
            ++curve_edges[ends.first], ++curve_edges[ends.second];
    Star star;
    for (Index v = 0; v < map.vertex_count(); ++v) {
        if (map.is_vertex_removed(v)) {
            ASSERT_EQ(triangles_at[v], 0u);
            continue;
        }
        ASSERT_EQ(map.from(map.out(v)), v);
        ASSERT_EQ(map.valence(v), triangles_at[v]);
        ASSERT_TRUE(border_out[v] == kNoIndex || map.out(v) == border_out[v]) << "out of vertex " << v;
        map.star(v, star);
        ASSERT_EQ(star.triangle_count(), triangles_at[v]) << "one fan at vertex " << v;
        ASSERT_EQ(star.open, border_out[v] != kNoIndex);
        ASSERT_TRUE(map.kind(v) == VertexKind::corner ||
                    curve_edges[v] == (map.kind(v) == VertexKind::curve ? 2u : 0u));
    }
    const SurfaceTopology now = surface_topology(surface_of(map)), was = on.topology();
    ASSERT_EQ(now.euler, was.euler);
    ASSERT_EQ(now.components, was.components);
    ASSERT_EQ(now.border_loops, was.border_loops);
}

/// Fails unless corners trace to their positions, the map is one from both sides of every edge, and what lies on a
/// curve stays on one. every: of how many half-edges one is looked at.
inline void expect_continuous(const SurfaceMap& map, const Prepared& on, Index every = 1) {
    const double tolerance = 1e-6 * on.diagonal;
    for (Index s = 0; s < map.slot_count(); ++s)
        for (Index k = 0; k < 3 && !map.is_removed(s); ++k) {
            const Index h = 3 * s + k;
            if (h % every != 0) continue;
            const TrianglePoint corner = map.trace({s, Vec3d::Unit(k)});
            ASSERT_LT((map.original_position(corner) - map.position(map.from(h))).norm(), tolerance)
                << "corner " << k << " of slot " << s;
            for (const double t : {0.07, 0.3, 0.5, 0.81}) {
                TrianglePoint here{s, Vec3d::Zero()};
                here.barycentric[k] = 1 - t;
                here.barycentric[next_half_edge(h) % 3] = t;
                const TrianglePoint traced = map.trace(here);
                ASSERT_LT(traced.triangle, on.surface.triangles.size());
                ASSERT_GE(traced.barycentric.minCoeff(), 0);
                ASSERT_NEAR(traced.barycentric.sum(), 1, 1e-9);
                const Vec3d place = map.original_position(traced);
                const double off_curve = map.is_feature(h) ? on.distance_to_curves(place) : 0;
                ASSERT_LT(off_curve, tolerance) << "off the curve, half-edge " << h;
                if (map.is_border(h)) continue;
                const Index g = map.twin(h);
                TrianglePoint there{g / 3, Vec3d::Zero()};
                there.barycentric[g % 3] = t;
                there.barycentric[next_half_edge(g) % 3] = 1 - t;
                ASSERT_LT((map.original_position(map.trace(there)) - place).norm(), tolerance)
                    << "jump over half-edge " << h;
            }
        }
}

/// The file of the corpus with this end of its path; empty without a corpus.
inline std::filesystem::path corpus_file(const std::string& name) {
    for (const CorpusRow& row : read_corpus())
        if (row.file.ends_with(name)) return row.path;
    return {};
}

} // namespace filigree_test
