#include "filigree/mesh/surfels.h"

#include "filigree/mesh.h"
#include "filigree/mesh/normals.h"
#include "threads.h"

#include <gtest/gtest.h>
#include <random>

namespace filigree {
namespace {

Mesh scaled(Mesh mesh, const Mat3f& by) {
    for (Vec3f& p : mesh.positions) p = by * p;
    return mesh;
}

/// Whether a line through a point along a direction meets a surfel.
bool meets(const Surfels& surfels, std::size_t i, const Vec3f& point, const Vec3f& way) {
    const Vec3f &u = surfels.u[i], &v = surfels.v[i], to = point - surfels.positions[i];
    if (to.norm() > 3 * std::max(u.norm(), v.norm())) return false;
    Mat3f matrix;
    matrix << u, v, -way;
    const Vec3f at = matrix.inverse() * to; // not finite where the line lies in the disc
    return at[0] * at[0] + at[1] * at[1] <= 1 + 1e-3f && (matrix * at - to).norm() < 1e-3f * to.norm() + 1e-6f;
}

/// The share of points, at random on the surface, that no surfel covers as seen along the normal.
double uncovered(const Mesh& mesh, const Surfels& surfels, int count = 2000) {
    const std::vector<Triangle> triangles = triangulate(mesh).triangles;
    std::mt19937 random(1);
    std::uniform_real_distribution<float> any(0, 1);
    int missed = 0;
    for (int k = 0; k < count; ++k) {
        const Triangle& t = triangles[random() % triangles.size()];
        float a = any(random), b = any(random);
        if (a + b > 1) a = 1 - a, b = 1 - b;
        const Vec3f &p = mesh.positions[t[0]], &q = mesh.positions[t[1]], &r = mesh.positions[t[2]];
        const Vec3f point = p + a * (q - p) + b * (r - p), normal = (q - p).cross(r - p).normalized();
        bool is_covered = false;
        for (std::size_t i = 0; i < surfels.size() && !is_covered; ++i) is_covered = meets(surfels, i, point, normal);
        missed += !is_covered;
    }
    return double(missed) / count;
}

Mesh box() {
    Mesh mesh;
    for (int k = 0; k < 8; ++k)
        mesh.positions.emplace_back(k & 1 ? 3.0f : 0.0f, k & 2 ? 1.0f : 0.0f, k & 4 ? 1.0f : 0.0f);
    for (const auto& f :
         {std::array<Index, 4>{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}})
        mesh.add_face(f);
    return mesh;
}

TEST(Surfels, CoverTheSurface) {
    for (const Mesh& mesh : {make_wavy_sphere({.resolution = 12}), make_wavy_plane({.resolution = 12}),
                             scaled(make_wavy_cube({.resolution = 10}), Vec3f(1, 9, 1).asDiagonal()), box()})
        EXPECT_EQ(uncovered(mesh, make_surfels(mesh, kOneThread).value()), 0);
}

TEST(Surfels, LargeTrianglesGetMoreDiscsAndNoLargeOnes) {
    Mesh mesh = make_wavy_sphere({.resolution = 16});
    const float usual = make_surfels(mesh, kOneThread)->rest_radius[0];
    const Index first = Index(mesh.vertex_count());
    for (const Vec3f& p : {Vec3f(-2, -2, -1), Vec3f(2, -2, -1), Vec3f(2, 2, -1), Vec3f(-2, 2, -1)})
        mesh.positions.push_back(p);
    mesh.add_face(std::array<Index, 4>{first, first + 1, first + 2, first + 3});
    const Surfels surfels = make_surfels(mesh, kOneThread).value();
    EXPECT_LT(*std::max_element(surfels.rest_radius.begin(), surfels.rest_radius.end()), 6 * usual);
    EXPECT_EQ(uncovered(mesh, surfels, 4000), 0);
}

TEST(Surfels, AffineMapsCarryThemExactly) {
    const Mesh mesh = make_wavy_sphere({.resolution = 12});
    Mat3f a;
    a << 3, 0.4f, 0, 0, 1, 0.2f, 0.1f, 0, 0.8f;
    const Mesh moved = scaled(mesh, a);
    const Surfels rest = make_surfels(mesh, kOneThread).value();
    const Surfels carried = carried_surfels(rest, moved.positions, std::vector<Mat3f>(mesh.vertex_count(), a));
    for (std::size_t i = 0; i < rest.size(); ++i) {
        EXPECT_LT((carried.positions[i] - a * rest.positions[i]).norm(), 1e-6f);
        EXPECT_LT((carried.u[i] - a * rest.u[i]).norm(), 1e-7f);
    }
    EXPECT_EQ(uncovered(moved, carried), 0); // an affine map keeps what covers what
    const Surfels split = split_surfels(carried).value();
    EXPECT_GT(split.size(), carried.size());
    EXPECT_LT(uncovered(moved, split), 1e-3);
}

TEST(Surfels, NoneStaysLong) {
    Surfels one;
    one.positions = {Vec3f(1, 2, 3)};
    one.u = {Vec3f(100, 50, 0)};
    one.v = {Vec3f(0, 0, 1)};
    one.rest_radius = {1};
    one.corners = {{7, 7, 7}};
    one.weights = {Vec3f(1, 0, 0)};
    const Surfels split = split_surfels(one).value();
    EXPECT_GT(split.size(), 100u);
    for (std::size_t i = 0; i < split.size(); ++i) {
        EXPECT_LE(split.u[i].norm(), kMostStretch);
        EXPECT_LE(split.v[i].norm(), kMostStretch);
        EXPECT_LT((split.positions[i] - one.positions[0]).norm(), 1.01f * one.u[0].norm());
        EXPECT_EQ(split.corners[i][0], 7u);
    }
    one.u = {Vec3f(1e30f, 0, 0)};
    EXPECT_LE(split_surfels(one)->size(), 1'000'000u);
    one.u = {Vec3f(std::numeric_limits<float>::infinity(), 0, 0)};
    EXPECT_EQ(split_surfels(one)->size(), 1u);
}

TEST(Surfels, AreNotSplitWithoutEnd) {
    Surfels many;
    for (int i = 0; i < 20; ++i) {
        many.positions.emplace_back(0, 0, float(i));
        many.u.emplace_back(1e12f, 0, 0);
        many.v.emplace_back(0, 0, 1);
        many.rest_radius.push_back(1);
        many.corners.push_back({0, 0, 0});
        many.weights.emplace_back(1, 0, 0);
    }
    const auto refused = split_surfels(many, 5000);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::unsuitable);
    EXPECT_NE(refused.error().message.find("5,000"), std::string::npos) << refused.error().message;
}

TEST(Surfels, PointSetsHoldThem) {
    Mesh mesh = make_wavy_sphere({.resolution = 8});
    mesh.colors.assign(mesh.vertex_count(), Vec4f(0.1f, 0.2f, 0.3f, 1));
    const Surfels surfels = make_surfels(mesh, kOneThread).value();
    const Mesh points = surfel_points(surfels);
    EXPECT_EQ(check_mesh(points), "");
    const Surfels back = surfels_of_points(points).value();
    EXPECT_EQ(back.positions, surfels.positions);
    EXPECT_EQ(back.u, surfels.u);
    EXPECT_EQ(back.v, surfels.v);
    EXPECT_EQ(back.colors, surfels.colors);
    EXPECT_FALSE(surfels_of_points(mesh).has_value());
    const std::vector<Vec3f> normals = vertex_normals(triangulate(mesh).triangles, mesh.positions, kOneThread);
    for (std::size_t i = 0; i < normals.size(); ++i) EXPECT_GT(points.normals.values[i].dot(normals[i]), 0.999f);
    const Mesh polygons = surfel_polygons(surfels);
    EXPECT_EQ(check_mesh(polygons), "");
    EXPECT_EQ(polygons.face_count(), surfels.size());
}

TEST(Surfels, WhatHasNoSurfaceHasNone) {
    Mesh points;
    points.positions = {{0, 0, 0}, {1, 1, 1}};
    EXPECT_EQ(make_surfels(points, kOneThread)->size(), 0u);
    points.add_face(std::array<Index, 3>{0, 1, 0});
    EXPECT_EQ(make_surfels(points, kOneThread)->size(), 0u);
    EXPECT_EQ(surfel_polygons(make_surfels(points, kOneThread).value()).face_count(), 0u);
}

} // namespace
} // namespace filigree
