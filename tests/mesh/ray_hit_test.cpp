#include "filigree/mesh/ray_hit.h"

#include "filigree/mesh.h"
#include "filigree/mesh/vertex_cache.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

using namespace filigree;

namespace {

std::optional<RayHit> hit(const std::vector<Vec3f>& positions, const std::vector<Triangle>& triangles,
                          const Vec3d& origin, const Vec3d& direction) {
    return first_hit(positions, triangles, origin, direction, kOneThread);
}

Vec3d random_direction(std::mt19937& random) {
    std::normal_distribution<double> normal;
    return Vec3d(normal(random), normal(random), normal(random)).normalized();
}

/// Distance along the ray by the triangle's plane and three areas: another way than the one tested.
std::optional<double> plainly(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& o, const Vec3d& d) {
    const Vec3d n = (b - a).cross(c - a);
    if (n.dot(d) == 0) return std::nullopt;
    const double t = n.dot(a - o) / n.dot(d);
    const Vec3d p = o + t * d;
    for (const auto& [from, to] : {std::pair(a, b), {b, c}, {c, a}})
        if (n.dot((to - from).cross(p - from)) < 0) return std::nullopt;
    return t < 0 ? std::nullopt : std::optional(t);
}

const std::vector<Vec3f> kCorners = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
const std::vector<Triangle> kOne = {{0, 1, 2}};

} // namespace

TEST(RayHit, FindsWhatTryingAllFinds) {
    const Mesh mesh = make_wavy_cube({.resolution = 30, .frequency = 3});
    const std::vector<Triangle> triangles = triangulate(mesh).triangles;
    const auto corner = [&](std::size_t t, int k) { return mesh.positions[triangles[t][k]].cast<double>().eval(); };
    std::mt19937 random(1);
    std::size_t met = 0;
    const RunContext many(8);
    for (int i = 0; i < 200; ++i) {
        const Vec3d origin = 1.5 * random_direction(random);
        const Vec3d direction = 3 * (0.8 * random_direction(random) - origin);
        double nearest = std::numeric_limits<double>::infinity();
        for (std::size_t t = 0; t < triangles.size(); ++t)
            nearest =
                std::min(nearest, plainly(corner(t, 0), corner(t, 1), corner(t, 2), origin, direction).value_or(1e300));
        const std::optional<RayHit> found = hit(mesh.positions, triangles, origin, direction);
        ASSERT_EQ(found.has_value(), nearest < 1e300) << i;
        if (!found) continue;
        ++met;
        EXPECT_NEAR(found->distance, nearest, 1e-12);
        Vec3d at = Vec3d::Zero();
        for (int k = 0; k < 3; ++k) at += double(found->barycentric[k]) * corner(found->triangle, k);
        EXPECT_LT((at - origin - found->distance * direction).norm(), 1e-6);
        EXPECT_NEAR(found->barycentric.sum(), 1, 1e-6);
        EXPECT_GE(found->barycentric.minCoeff(), 0);
        const std::optional<RayHit> again = first_hit(mesh.positions, triangles, origin, direction, many);
        EXPECT_EQ(again->triangle, found->triangle);
        EXPECT_EQ(again->distance, found->distance);
    }
    EXPECT_GT(met, 100u);
}

TEST(RayHit, MeetsEitherSideAndOnlyWhatIsInFront) {
    for (const double side : {1.0, -1.0}) {
        const std::optional<RayHit> found = hit(kCorners, kOne, {0.25, 0.25, 2 * side}, {0, 0, -4 * side});
        ASSERT_TRUE(found);
        EXPECT_EQ(found->distance, 0.5); // in lengths of the direction
        EXPECT_LT((found->barycentric - Vec3f(0.5f, 0.25f, 0.25f)).norm(), 1e-7f);
        EXPECT_FALSE(hit(kCorners, kOne, {0.25, 0.25, 2 * side}, {0, 0, 4 * side}));
        EXPECT_FALSE(hit(kCorners, kOne, {0.75, 0.75, 2 * side}, {0, 0, -side}));
    }
    EXPECT_EQ(hit(kCorners, kOne, {0.25, 0.25, 0}, {0, 0, 1})->distance, 0); // on it
}

TEST(RayHit, NothingComesThroughBetweenNeighbours) {
    const Mesh mesh = make_wavy_sphere({.resolution = 10});
    const std::vector<Triangle> triangles = triangulate(mesh).triangles;
    for (const Triangle& t : triangles)
        for (int k = 0; k < 3; ++k) { // at corners and along sides, from inside
            const Vec3d a = mesh.positions[t[k]].cast<double>(), b = mesh.positions[t[(k + 1) % 3]].cast<double>();
            for (const double part : {0.0, 0.5, 1.0 / 3}) {
                const Vec3d direction = (1 - part) * a + part * b;
                const std::optional<RayHit> found = hit(mesh.positions, triangles, Vec3d::Zero(), direction);
                ASSERT_TRUE(found);
                EXPECT_NEAR(found->distance, 1, 1e-9);
            }
        }
}

TEST(RayHit, TheLowestOfEquallyNear) {
    std::vector<Triangle> same(50000, kOne[0]); // more than one thread's share
    EXPECT_EQ(hit(kCorners, same, {0.2, 0.2, 1}, {0, 0, -1})->triangle, 0u);
    same[0] = {0, 0, 0};
    EXPECT_EQ(hit(kCorners, same, {0.2, 0.2, 1}, {0, 0, -1})->triangle, 1u);
}

TEST(RayHit, NeverWithoutAreaOrDirection) {
    const std::vector<Vec3f> line = {{0, 0, 0}, {0.1f, 0.2f, 0}, {0.7f, 1.4f, 0}, {0.3f, 0.6f, 0}};
    for (const Triangle& flat : {Triangle{0, 1, 2}, Triangle{0, 3, 2}, Triangle{1, 1, 2}, Triangle{2, 2, 2}})
        for (const double part : {0.0, 0.3, 1.0}) {
            const Vec3d at = (1 - part) * line[flat[0]].cast<double>() + part * line[flat[2]].cast<double>();
            EXPECT_FALSE(hit(line, {flat}, at + Vec3d(0, 0, 1), {0, 0, -1}));
        }
    EXPECT_FALSE(hit(kCorners, kOne, {-1, 0.25, 0}, {1, 0, 0})); // edge-on
    EXPECT_FALSE(hit(kCorners, kOne, {0.2, 0.2, 1}, {0, 0, 0}));
    EXPECT_FALSE(hit(kCorners, kOne, {0.2, 0.2, 1}, {0, 0, std::nan("")}));
    EXPECT_FALSE(hit(kCorners, kOne, {std::nan(""), 0.2, 1}, {0, 0, -1}));
    EXPECT_FALSE(hit(kCorners, {}, {0.2, 0.2, 1}, {0, 0, -1}));
    const std::vector<Vec3f> broken = {{0, 0, 0}, {std::nanf(""), 0, 0}, {0, 1, 0}};
    EXPECT_FALSE(hit(broken, kOne, {0.2, 0.2, 1}, {0, 0, -1}));
}

TEST(RayHit, AnyScale) {
    for (const double scale : {1e-30, 1e-6, 1e6, 1e30}) {
        std::vector<Vec3f> corners;
        for (const Vec3f& p : kCorners) corners.push_back((scale * p.cast<double>()).cast<float>());
        const std::optional<RayHit> found = hit(corners, kOne, scale * Vec3d(0.25, 0.25, 2), Vec3d(0, 0, -1));
        ASSERT_TRUE(found) << scale;
        EXPECT_NEAR(found->distance / scale, 2, 1e-9);
    }
}

TEST(VertexCache, TheSameTrianglesInAnotherOrder) {
    const Mesh mesh = make_wavy_cube({.resolution = 40});
    std::vector<Triangle> triangles = triangulate(mesh).triangles;
    std::shuffle(triangles.begin(), triangles.end(), std::mt19937(1));
    /// Vertices that a cache of 32, first in first out, has to fetch.
    const auto misses = [](const std::vector<Triangle>& order) {
        std::vector<Index> cache;
        std::size_t count = 0;
        for (const Triangle& t : order)
            for (Index v : t) {
                if (std::find(cache.begin(), cache.end(), v) != cache.end()) continue;
                ++count;
                cache.push_back(v);
                if (cache.size() > 32) cache.erase(cache.begin());
            }
        return count;
    };
    std::vector<Triangle> ordered = triangles, again = triangles;
    order_for_vertex_cache(ordered, mesh.vertex_count());
    order_for_vertex_cache(again, mesh.vertex_count());
    EXPECT_TRUE(ordered == again);
    EXPECT_LT(2 * misses(ordered), misses(triangles));
    std::sort(ordered.begin(), ordered.end());
    std::sort(triangles.begin(), triangles.end());
    EXPECT_TRUE(ordered == triangles);
    std::vector<Triangle> none;
    order_for_vertex_cache(none, 0);
}
