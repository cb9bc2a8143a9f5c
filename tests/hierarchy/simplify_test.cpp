// Levels for any mesh: counts are reached, what is closed stays closed, and the error is what it says.
#include "cases.h"
#include "filigree/hierarchy/simplify.h"

#include "filigree/mesh.h"
#include "hierarchy/part_meshes.h"
#include "threads.h"

#include <cmath>
#include <ctime>
#include <gtest/gtest.h>
#include <map>
#include <numbers>
#include <set>

namespace filigree {
namespace {

Mesh triangle_mesh(std::span<const Vec3f> positions, std::span<const Triangle> triangles) {
    Mesh mesh;
    mesh.positions.assign(positions.begin(), positions.end());
    for (const Triangle& t : triangles) mesh.add_face(t);
    return mesh;
}

/// The simplified mesh over its own triangles, after what always holds was checked.
Simplified simplified(const Mesh& mesh, const SimplifyOptions& options) {
    const std::vector<Triangle> triangles = triangulate(mesh).triangles;
    Simplified result = simplify(mesh.positions, triangles, options, RunContext());
    std::set<Index> used;
    for (const Triangle& t : result.triangles) {
        EXPECT_TRUE(t[0] != t[1] && t[1] != t[2] && t[2] != t[0]);
        used.insert(t.begin(), t.end());
    }
    EXPECT_EQ(used.size(), result.vertex_count);
    EXPECT_TRUE(used.empty() || *used.rbegin() < mesh.vertex_count());
    return result;
}

void expect_near_target(std::size_t count, std::size_t target) {
    EXPECT_LE(double(count), 1.02 * double(target) + 1) << target;
    EXPECT_GE(double(count), 0.98 * double(target) - 3) << target; // a collapse may take a whole scrap with it
}

TEST(Simplify, CountsAreReachedOnEveryShape) {
    for (const std::string_view name : shape_names()) {
        const Mesh mesh = *make_shape(name, {.resolution = 32});
        for (const std::size_t target : {3u, 30u, 300u}) {
            SCOPED_TRACE(name);
            expect_near_target(simplified(mesh, {.target_vertices = target}).vertex_count, target);
        }
    }
}

TEST(Simplify, LargeMeshesGoThroughBothStages) {
    const Mesh mesh = make_wavy_cube({.resolution = 96}); // 55,298 vertices
    for (const std::size_t target : {30000u, 5000u})
        expect_near_target(simplified(mesh, {.target_vertices = target}).vertex_count, target);
}

TEST(Simplify, SeparateTrianglesAreDroppedToTheCount) {
    Mesh mesh;
    for (Index i = 0; i < 2000; ++i) {
        const auto x = static_cast<float>(i % 50), y = static_cast<float>(i / 50);
        for (const Vec3f& p : {Vec3f(x, y, 0), Vec3f(x + 0.5f, y, 0), Vec3f(x, y + 0.5f, 0.1f)})
            mesh.positions.push_back(p);
        mesh.add_face(Triangle{3 * i, 3 * i + 1, 3 * i + 2});
    }
    for (const std::size_t target : {3u, 60u, 600u, 3000u})
        expect_near_target(simplified(mesh, {.target_vertices = target}).vertex_count, target);
}

TEST(Simplify, NonManifoldMeshesReachTheCount) {
    // Forty fins around one edge chain, and two cubes that share a face's worth of vertices twice over.
    Mesh fins;
    for (Index k = 0; k < 20; ++k) fins.positions.emplace_back(0.0f, 0.0f, static_cast<float>(k));
    for (Index f = 0; f < 40; ++f) {
        const auto first = static_cast<Index>(fins.positions.size());
        for (Index k = 0; k < 20; ++k)
            fins.positions.emplace_back(std::cos(0.15f * static_cast<float>(f)),
                                        std::sin(0.15f * static_cast<float>(f)), static_cast<float>(k));
        for (Index k = 0; k + 1 < 20; ++k) fins.add_face(std::array<Index, 4>{k, k + 1, first + k + 1, first + k});
    }
    Mesh doubled = make_wavy_plane({.resolution = 24});
    const std::size_t corners = doubled.corner_count();
    for (std::size_t c = 0; c < corners; c += 4)
        doubled.add_face(
            std::array{doubled.corners[c], doubled.corners[c + 1], doubled.corners[c + 2], doubled.corners[c + 3]});
    for (const Mesh& mesh : {fins, doubled})
        for (const std::size_t target : {10u, 100u, 400u})
            expect_near_target(simplified(mesh, {.target_vertices = target}).vertex_count, target);
}

TEST(Simplify, WhatIsClosedStaysClosedWhileNothingIsForced) {
    for (const std::string_view name : {"wavy-cube", "wavy-sphere", "bar", "cylinder", "torus"}) {
        const Mesh mesh = *make_shape(name, {.resolution = 32});
        const std::int64_t euler = analyse_topology(mesh, kOneThread).euler;
        for (const std::size_t target : {1000u, 200u, 60u}) {
            const Simplified result = simplified(mesh, {.target_vertices = target});
            if (result.forced > 0) continue;
            Mesh left = triangle_mesh(mesh.positions, result.triangles);
            const TopologyReport report = analyse_topology(left, kOneThread);
            EXPECT_TRUE(report.is_closed() && report.is_manifold() && report.is_oriented()) << name << ' ' << target;
            EXPECT_EQ(report.euler, euler) << name << ' ' << target;
        }
        EXPECT_EQ(simplified(mesh, {.target_vertices = 200}).forced, 0u) << name; // a good surface needs no force
    }
}

TEST(Simplify, TheErrorIsABound) {
    for (const std::string_view name : shape_names()) {
        const Mesh mesh = *make_shape(name, {.resolution = 48});
        for (const double most : {0.02, 0.005, 0.001}) {
            const Simplified result = simplified(mesh, {.max_error = most});
            EXPECT_LE(result.error, most * (1 + 1e-6)) << name;
            const auto apart = mesh_distance(triangle_mesh(mesh.positions, result.triangles), mesh, 20000, kOneThread);
            ASSERT_TRUE(apart.ok());
            // A root mean square over the area around a collapse: single points may lie a few times further.
            EXPECT_LE(apart->surfaces->rms_distance, most * apart->diagonal) << name << ' ' << most;
            EXPECT_LE(apart->surfaces->hausdorff, 4 * most * apart->diagonal) << name << ' ' << most;
        }
    }
}

double longest_edge(const Mesh& mesh, const Simplified& simplified) {
    float longest = 0; // squared
    for (const Triangle& t : simplified.triangles)
        for (int k = 0; k < 3; ++k)
            longest = std::max(longest, (mesh.positions[t[k]] - mesh.positions[t[(k + 1) % 3]]).squaredNorm());
    return std::sqrt(double(longest));
}

// Flat sides are worth nothing to the quadric error: without a bound their triangles get as long as they are wide.
TEST(Simplify, FlatPartsKeepVerticesForTheSakeOfTheLongestEdge) {
    constexpr double kMost = 0.06;                 // of the diagonal
    for (const unsigned resolution : {24u, 40u}) { // the latter goes through both stages
        const Mesh mesh = *make_shape("bar", {.resolution = resolution});
        const double diagonal = bounds(mesh.positions).diagonal();
        const Simplified free = simplified(mesh, {.target_vertices = 100});
        const Simplified held = simplified(mesh, {.target_vertices = 100, .max_edge = kMost});
        EXPECT_GT(longest_edge(mesh, free), 2 * kMost * diagonal);
        EXPECT_LE(longest_edge(mesh, held), kMost * diagonal);
        EXPECT_GT(held.vertex_count, 100u);
        EXPECT_LT(held.vertex_count, 2000u);
        // A count that the bound leaves room for is met as without one.
        expect_near_target(simplified(mesh, {.target_vertices = 1000, .max_edge = kMost}).vertex_count, 1000);
    }
}

/// A smooth tube beside a wavy one costs no quadric error, and still keeps vertices along its length, in both stages.
TEST(Simplify, StraightPartsAreNotLeftAsNeedles) {
    const Mesh mesh = filigree_test::make_two_tubes(160, 150); // 48,320 vertices
    for (const std::size_t target : {25'000u, 3'000u, 1'000u, 300u}) {
        const Simplified result = simplified(mesh, {.target_vertices = target});
        expect_near_target(result.vertex_count, target);
        const double even = std::sqrt(2.6 / double(target)); // of the tubes' area, a vertex's share
        EXPECT_LT(longest_edge(mesh, result), 10 * even) << target;
    }
}

/// A spike's sides are so steep that their planes hardly see it go, and its area is nothing.
TEST(Simplify, ThinTipsStay) {
    Mesh mesh = make_wavy_plane({.resolution = 80, .amplitude = 0.01});
    const std::vector<Index> tips = {1'000, 2'530, 5'011};
    for (const Index tip : tips) mesh.positions[tip].z() += 0.12f;
    const Simplified result = simplified(mesh, {.target_vertices = 300});
    for (const Index tip : tips)
        EXPECT_TRUE(std::ranges::any_of(result.triangles, [&](const Triangle& t) {
            return std::ranges::find(t, tip) != t.end();
        })) << tip;
}

TEST(Simplify, EdgesOfTheMeshMayBeLonger) {
    Mesh mesh = *make_shape("bar", {.resolution = 12});
    mesh.add_face(Triangle{0, 1, static_cast<Index>(mesh.positions.size())}); // a far point
    mesh.positions.emplace_back(20.0f, 0.0f, 0.0f);
    const Simplified held = simplified(mesh, {.target_vertices = 20, .max_edge = 0.02});
    EXPECT_GT(held.triangles.size(), 100u);
    EXPECT_LE(longest_edge(mesh, held), longest_edge(mesh, simplified(mesh, {})));
}

TEST(Simplify, FlatAndTinyMeshes) {
    const Mesh flat = make_wavy_plane({.resolution = 16, .amplitude = 0});
    const Simplified corners = simplified(flat, {.target_vertices = 4});
    EXPECT_EQ(corners.vertex_count, 4u);
    EXPECT_EQ(corners.triangles.size(), 2u);
    std::set<Index> kept;
    for (const Triangle& t : corners.triangles) kept.insert(t.begin(), t.end());
    EXPECT_EQ(kept, (std::set<Index>{0, 16, 272, 288})); // the outline stays

    const std::vector<Vec3f> points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const std::vector<Triangle> tetrahedron = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
    EXPECT_EQ(simplify(points, tetrahedron, {}, RunContext()).triangles, tetrahedron); // nothing was asked for
    EXPECT_EQ(simplify(points, tetrahedron, {.target_vertices = 4}, RunContext()).triangles, tetrahedron);
    for (const std::size_t target : {0u, 3u})
        EXPECT_EQ(simplify(points, tetrahedron, {.target_vertices = target}, RunContext()).vertex_count, 3u);
    EXPECT_TRUE(simplify({}, {}, {.target_vertices = 3}, RunContext()).triangles.empty());
}

/// Fans, where every collapse is next to one vertex of all triangles. Quadratic time would show: 10 s and more each.
enum class Hub { middle, rim, both_ends, shared_edge };

void expect_hub_simplified(Hub hub, Index corners, std::size_t target) {
    std::vector<Vec3f> points = {{0, 0, 0.5f}, {0, 0, -0.5f}};
    for (Index i = 0; i < corners; ++i) {
        const double angle = 2 * std::numbers::pi * i / corners;
        points.emplace_back(float(0.5 * std::cos(angle)), float(0.5 * std::sin(angle)), 0.0f);
    }
    std::vector<Triangle> triangles;
    for (Index i = 0; i < corners; ++i) {
        const Index a = 2 + i, b = 2 + (i + 1) % corners;
        if (hub == Hub::middle || hub == Hub::both_ends) triangles.push_back({0, a, b});
        if (hub == Hub::both_ends) triangles.push_back({1, b, a});
        if (hub == Hub::shared_edge) triangles.push_back({0, 1, a});
        if (hub == Hub::rim && a != 2 && b != 2) triangles.push_back({2, a, b});
    }
    const std::clock_t start = std::clock();
    const Simplified result = simplify(points, triangles, {.target_vertices = target}, kOneThread);
    EXPECT_LT(double(std::clock() - start) / CLOCKS_PER_SEC, 5) << int(hub);
    EXPECT_NEAR(double(result.vertex_count), double(target), 0.02 * double(target)) << int(hub);
    std::set<Triangle> distinct;
    for (Triangle t : result.triangles) {
        std::ranges::sort(t);
        EXPECT_TRUE(t[0] < t[1] && t[1] < t[2] && t[2] < points.size());
        EXPECT_TRUE(distinct.insert(t).second); // nothing is there twice
    }
    if (hub != Hub::both_ends) return;
    std::map<std::pair<Index, Index>, int> runs; // still closed: every edge one way and the other
    for (const Triangle& t : result.triangles)
        for (int k = 0; k < 3; ++k) runs[std::minmax(t[k], t[(k + 1) % 3])] += t[k] < t[(k + 1) % 3] ? 1 : -1;
    for (const auto& [edge, sum] : runs) EXPECT_EQ(sum, 0) << edge.first << ' ' << edge.second;
}

TEST(Simplify, FansTakeNoQuadraticTime) {
    for (const Hub hub : {Hub::middle, Hub::rim, Hub::both_ends}) expect_hub_simplified(hub, 60'000, 500);
    expect_hub_simplified(Hub::shared_edge, 10'000, 500);
}

/// A large mesh: still closed and oriented, and threads change nothing.
TEST(Simplify, TwoMillionTrianglesStayClosed) {
    if (!all_cases()) GTEST_SKIP() << "large: scripts/check cases runs it";
    const Mesh mesh = make_wavy_cube({.resolution = 410}); // 2,017,200 triangles
    const std::vector<Triangle> triangles = triangulate(mesh).triangles;
    const Simplified one = simplify(mesh.positions, triangles, {.target_vertices = 60'000}, RunContext(1));
    EXPECT_EQ(one.triangles, simplify(mesh.positions, triangles, {.target_vertices = 60'000}, RunContext(2)).triangles);
    // Every edge is run as often one way as the other. (meshoptimizer may bring four triangles together at an edge.)
    std::map<std::pair<Index, Index>, int> runs;
    for (const Triangle& t : one.triangles)
        for (int k = 0; k < 3; ++k) ++runs[{t[k], t[(k + 1) % 3]}];
    std::size_t open = 0;
    for (const auto& [edge, count] : runs) {
        const auto back = runs.find({edge.second, edge.first});
        open += back == runs.end() || back->second != count;
    }
    EXPECT_EQ(open, 0u);
    EXPECT_LE(one.vertex_count, 60'000 * 1.02);
}

TEST(Simplify, SameTrianglesEveryTime) {
    const Mesh mesh = make_wavy_cube({.resolution = 64});
    const Simplified first = simplified(mesh, {.target_vertices = 500});
    EXPECT_EQ(simplified(mesh, {.target_vertices = 500}).triangles, first.triangles);
    // Where the mesh lies and how large it is, in powers of two, changes nothing either.
    Mesh larger = mesh;
    for (Vec3f& p : larger.positions) p *= 1024;
    EXPECT_EQ(simplified(larger, {.target_vertices = 500}).triangles, first.triangles);
}

TEST(Simplify, WhereAllIsAtOnePlaceNothingIsOff) {
    const std::vector<Vec3f> positions(6, Vec3f(1, 2, 3));
    const std::vector<Triangle> triangles = {{0, 1, 2}, {2, 1, 3}, {3, 4, 5}, {0, 2, 4}};
    const Simplified simplified = simplify(positions, triangles, {.target_vertices = 3}, kOneThread);
    EXPECT_EQ(simplified.error, 0);
}

} // namespace
} // namespace filigree
