#include "filigree/mesh/closest_point.h"

#include "filigree/mesh.h"
#include "sanitized.h"

#include <Eigen/Geometry>
#include <cmath>
#include <gtest/gtest.h>
#include <random>

#if defined(__GLIBC__)
#include <malloc.h>
#endif

namespace filigree {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

SurfacePoint brute_force(const std::vector<Vec3f>& positions, const std::vector<Triangle>& triangles,
                         const Vec3f& query, double max_distance = kInfinity, const Vec3f& facing = Vec3f::Zero()) {
    SurfacePoint best;
    for (Index t = 0; t < triangles.size(); ++t) {
        const auto& [a, b, c] = triangles[t];
        const Vec3d ab = (positions[b].cast<double>() - positions[a].cast<double>());
        const Vec3d ac = (positions[c].cast<double>() - positions[a].cast<double>());
        if (!facing.isZero(0) && !(ab.cross(ac).dot(facing.cast<double>()) > 0)) continue;
        SurfacePoint point = closest_point_on_triangle(query, positions[a], positions[b], positions[c]);
        point.triangle = t;
        if (point.distance <= max_distance && point.distance < best.distance) best = point;
    }
    return best;
}

void expect_same(const SurfacePoint& a, const SurfacePoint& b) {
    EXPECT_EQ(a.triangle, b.triangle);
    EXPECT_EQ(a.distance, b.distance);
    EXPECT_EQ(a.position, b.position);
    EXPECT_EQ(a.barycentric, b.barycentric);
}

TEST(ClosestPointOnTriangle, KnowsItsRegions) {
    const Vec3f a(0, 0, 0), b(4, 0, 0), c(0, 4, 0);
    const auto closest = [&](const Vec3f& p) { return closest_point_on_triangle(p, a, b, c); };
    EXPECT_EQ(closest({1, 1, 5}).position, Vec3f(1, 1, 0));
    EXPECT_EQ(closest({1, 1, 5}).distance, 5);
    EXPECT_EQ(closest({1, 1, 5}).barycentric, Vec3f(0.5f, 0.25f, 0.25f));
    EXPECT_EQ(closest({-3, -4, 0}).position, a);
    EXPECT_EQ(closest({-3, -4, 0}).distance, 5);
    EXPECT_EQ(closest({9, -1, 0}).position, b);
    EXPECT_EQ(closest({-1, 9, 0}).position, c);
    EXPECT_EQ(closest({1, -2, 0}).position, Vec3f(1, 0, 0));
    EXPECT_EQ(closest({-2, 1, 0}).position, Vec3f(0, 1, 0));
    EXPECT_EQ(closest({4, 4, 0}).position, Vec3f(2, 2, 0));
    EXPECT_EQ(closest({4, 4, 0}).barycentric, Vec3f(0, 0.5f, 0.5f));
}

TEST(ClosestPointOnTriangle, TreatsDegenerateOnesAsTheirEdges) {
    const Vec3f p(1, 3, 0);
    EXPECT_EQ(closest_point_on_triangle(p, {0, 0, 0}, {2, 0, 0}, {4, 0, 0}).position, Vec3f(1, 0, 0));
    EXPECT_EQ(closest_point_on_triangle(p, {0, 0, 0}, {4, 0, 0}, {2, 0, 0}).distance, 3);
    EXPECT_EQ(closest_point_on_triangle(p, {1, 0, 0}, {1, 0, 0}, {1, 0, 0}).position, Vec3f(1, 0, 0));
    EXPECT_EQ(closest_point_on_triangle(p, {1, 0, 0}, {1, 0, 0}, {1, 0, 0}).barycentric.sum(), 1);
}

TEST(ClosestPointOnTriangle, IsTheLeastOfManyPointsOfIt) {
    std::mt19937 random(1);
    const auto point = [&] { return Vec3f(float(random() % 64), float(random() % 64), float(random() % 4)); };
    for (int round = 0; round < 500; ++round) {
        const Vec3f p = point(), a = point(), b = point(), c = point();
        const SurfacePoint closest = closest_point_on_triangle(p, a, b, c);
        const Vec3f& w = closest.barycentric;
        EXPECT_GE(w.minCoeff(), 0);
        EXPECT_NEAR(w.sum(), 1, 1e-6);
        EXPECT_NEAR((w[0] * a + w[1] * b + w[2] * c - closest.position).norm(), 0, 1e-4);
        for (int i = 0; i <= 10; ++i)
            for (int j = 0; i + j <= 10; ++j) {
                const Vec3d q = (i * a.cast<double>() + j * b.cast<double>() + (10 - i - j) * c.cast<double>()) / 10;
                EXPECT_LE(closest.distance, (p.cast<double>() - q).norm() + 1e-9);
            }
    }
}

TEST(ClosestPointTree, AgreesWithBruteForceToTheBit) {
    std::mt19937 random(2);
    for (const double scale : {1e-42, 1e-30, 1.0, 1e30})
        for (int round = 0; round < 20; ++round) {
            // few different coordinates: plenty of ties, duplicates, needles and points
            const unsigned range = 2 + unsigned(random() % 50);
            const auto coordinate = [&] { return float(scale * double(random() % range)); };
            const auto point = [&] { return Vec3f(coordinate(), coordinate(), coordinate()); };
            std::vector<Vec3f> positions(30);
            for (Vec3f& p : positions) p = point();
            std::vector<Triangle> triangles(1 + random() % 100);
            for (std::size_t t = 0; t < triangles.size(); ++t) { // some share an edge with the one before
                triangles[t] = {Index(random() % 30), Index(random() % 30), Index(random() % 30)};
                if (t % 3 == 1) triangles[t][0] = triangles[t - 1][2], triangles[t][1] = triangles[t - 1][1];
            }
            const ClosestPointTree tree(positions, triangles);
            for (int i = 0; i < 50; ++i) {
                const float times = i % 5 ? 1.0f : 100.0f;
                const Vec3f query = times * (point() - point() / 3);
                expect_same(tree.closest(query), brute_force(positions, triangles, query));
                const double reach = scale * range / 4;
                expect_same(tree.closest(query, reach), brute_force(positions, triangles, query, reach));
                const Vec3f facing = (point() - point()) / float(scale * 8);
                expect_same(tree.closest(query, kInfinity, facing),
                            brute_force(positions, triangles, query, kInfinity, facing));
            }
        }
}

TEST(ClosestPointTree, FindsNothingNearAPointThatIsNotFinite) {
    const Mesh mesh = make_wavy_sphere({.resolution = 12});
    const std::vector<Triangle> triangles = triangulate(mesh).triangles;
    const ClosestPointTree tree(mesh.positions, triangles);
    constexpr float kFar = std::numeric_limits<float>::infinity(), kNothing = std::numeric_limits<float>::quiet_NaN();
    for (const Vec3f& query : {Vec3f(kFar, 0, 0), Vec3f(0, -kFar, kFar), Vec3f(kNothing, 0, 0)}) {
        EXPECT_EQ(tree.closest(query).triangle, kNoIndex);
        tree.each_near(query, 1, [](Index) { ADD_FAILURE(); });
    }
    EXPECT_NE(tree.closest(Vec3f::Constant(std::numeric_limits<float>::max())).triangle, kNoIndex);
}

TEST(ClosestPointTree, AgreesWithBruteForceOnASmoothSurface) {
    const Mesh mesh = make_wavy_sphere({.resolution = 12});
    const std::vector<Triangle> triangles = triangulate(mesh).triangles;
    const ClosestPointTree tree(mesh.positions, triangles);
    std::mt19937 random(4);
    const auto coordinate = [&] { return float(random() % 100000) / 50000 - 1; };
    for (int i = 0; i < 300; ++i) {
        const Vec3f query(coordinate(), coordinate(), coordinate());
        expect_same(tree.closest(query), brute_force(mesh.positions, triangles, query));
    }
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) { // a vertex is on its own triangles, the lowest wins
        expect_same(tree.closest(mesh.positions[v]), brute_force(mesh.positions, triangles, mesh.positions[v]));
        EXPECT_EQ(tree.closest(mesh.positions[v]).distance, 0);
    }
}

TEST(ClosestPointTree, AgreesWithBruteForceOnNeedles) { // which have several boxes each
    std::vector<Vec3f> positions = {{0.1f, 0.2f, 0.3f}};
    std::vector<Triangle> triangles;
    std::mt19937 random(6);
    const auto coordinate = [&] { return float(random() % 100000) / 50000 - 1; };
    for (Index t = 0; t < 400; ++t) {
        const Vec3f end(coordinate(), coordinate(), coordinate());
        positions.push_back(end);
        positions.push_back(end + 1e-3f * Vec3f(coordinate(), coordinate(), coordinate()));
        triangles.push_back({0, 2 * t + 1, 2 * t + 2});
    }
    triangles.push_back({0, 1, 0}); // a line, and a point
    triangles.push_back({7, 7, 7});
    const ClosestPointTree tree(positions, triangles);
    for (int i = 0; i < 500; ++i) {
        const Vec3f query = Vec3f(coordinate(), coordinate(), coordinate()) * (i % 7 ? 1.0f : 30.0f);
        expect_same(tree.closest(query), brute_force(positions, triangles, query));
        const Vec3f facing(coordinate(), coordinate(), coordinate());
        expect_same(tree.closest(query, 0.1, facing), brute_force(positions, triangles, query, 0.1, facing));
    }
}

TEST(ClosestPointTree, FacingPicksTheRightSideOfAThinPart) {
    const std::vector<Vec3f> positions = {{0, 0, 0},      {1, 0, 0},      {0, 1, 0},
                                          {0, 0, -0.01f}, {1, 0, -0.01f}, {0, 1, -0.01f}};
    const std::vector<Triangle> triangles = {{0, 1, 2}, {3, 5, 4}};
    const ClosestPointTree tree(positions, triangles);
    const Vec3f query(0.2f, 0.2f, -0.001f);
    EXPECT_EQ(tree.closest(query).triangle, 0u);
    EXPECT_EQ(tree.closest(query, kInfinity, {0, 0, -1}).triangle, 1u);
    EXPECT_EQ(tree.closest(query, kInfinity, {0, 0, 1}).triangle, 0u);
    EXPECT_EQ(tree.closest(query, 0.005, {0, 0, -1}).triangle, kNoIndex);
}

TEST(ClosestPointTree, MaxDistanceIncludesItself) {
    const std::vector<Vec3f> positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    const std::vector<Triangle> triangles = {{0, 1, 2}};
    const ClosestPointTree tree(positions, triangles);
    for (const float height : {0.1f, 0.3f, 1.7f, 1e-20f, 0.0f}) {
        EXPECT_EQ(tree.closest({0.25f, 0.25f, height}, double(height)).triangle, 0u);
        EXPECT_EQ(tree.closest({0.25f, 0.25f, height}, double(height) * (1 - 1e-12) - 1e-300).triangle, kNoIndex);
    }
    EXPECT_EQ(tree.closest({0, 0, 0}, std::nan("")).triangle, kNoIndex);
}

TEST(ClosestPointTree, FarQueriesAreRightToTheirPrecision) {
    const Mesh mesh = make_wavy_sphere({.resolution = 8});
    const std::vector<Triangle> triangles = triangulate(mesh).triangles;
    const ClosestPointTree tree(mesh.positions, triangles);
    for (const float far : {2e4f, 1e10f, 1e38f}) {
        const Vec3f query = far * Vec3f(1, 0.3f, -0.2f);
        const double expected = brute_force(mesh.positions, triangles, query).distance;
        EXPECT_NEAR(tree.closest(query).distance / expected, 1, 1e-8);
    }
}

TEST(ClosestPointTree, OfNothingOrOnePoint) {
    const ClosestPointTree nothing({}, {});
    EXPECT_EQ(nothing.closest({1, 2, 3}).triangle, kNoIndex);
    EXPECT_EQ(nothing.closest({1, 2, 3}).distance, kInfinity);
    const std::vector<Vec3f> positions = {{5, 5, 5}};
    const std::vector<Triangle> triangles = {{0, 0, 0}, {0, 0, 0}};
    ClosestPointTree point(positions, triangles);
    ClosestPointTree moved = std::move(point);
    EXPECT_EQ(moved.closest({5, 5, 7}).distance, 2);
    EXPECT_EQ(moved.closest({5, 5, 7}).triangle, 0u);
}

#if defined(__GLIBC__) // whose malloc says what it maps
TEST(ClosestPointTree, KeepsNoCopyOfThePositions) {
    if (kSanitized) GTEST_SKIP() << "a sanitizer has its own memory";
    const std::vector<Vec3f> positions(2'000'000, Vec3f(1, 2, 3)); // 24 MB, which malloc maps by themselves
    const std::vector<Triangle> triangles = {{0, 1, 2}};
    const std::size_t before = mallinfo2().hblkhd;
    const ClosestPointTree tree(positions, triangles);
    EXPECT_LT(mallinfo2().hblkhd, before + sizeof(Vec3f) * positions.size() / 2);
}
#endif

} // namespace
} // namespace filigree
