#include "filigree/mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <map>
#include <numbers>
#include <set>

namespace filigree {
namespace {

std::map<std::pair<Index, Index>, int> directed_edges(const Mesh& mesh) {
    std::map<std::pair<Index, Index>, int> edges;
    for (std::size_t f = 0; f < mesh.face_count(); ++f)
        for (std::size_t i = 0; i < mesh.face(f).size(); ++i)
            ++edges[{mesh.face(f)[i], mesh.face(f)[(i + 1) % mesh.face(f).size()]}];
    return edges;
}

/// Every edge is walked once each way: closed, manifold and oriented.
void expect_watertight(const Mesh& mesh) {
    const auto edges = directed_edges(mesh);
    for (const auto& [edge, count] : edges) {
        ASSERT_EQ(count, 1);
        ASSERT_TRUE(edges.contains({edge.second, edge.first}));
    }
}

std::int64_t euler(const Mesh& mesh) {
    return std::int64_t(mesh.vertex_count()) - std::int64_t(directed_edges(mesh).size() / 2) +
           std::int64_t(mesh.face_count());
}

double volume(const Mesh& mesh) {
    double sum = 0;
    for (const Triangle& t : triangulate(mesh).triangles) {
        const auto p = [&](std::size_t i) { return Vec3d(mesh.positions[t[i]].cast<double>()); };
        sum += p(0).dot(p(1).cross(p(2))) / 6;
    }
    return sum;
}

std::set<std::array<float, 3>> point_set(const Mesh& mesh, const Mat3f& transform = Mat3f::Identity()) {
    std::set<std::array<float, 3>> points;
    for (const Vec3f& position : mesh.positions) {
        const Vec3f p = transform * position + Vec3f::Zero(); // -0 becomes 0
        points.insert({p.x(), p.y(), p.z()});
    }
    return points;
}

TEST(Shapes, AreWatertightAtEveryResolution) {
    for (const unsigned n : {1u, 2u, 3u, 4u, 7u, 16u})
        for (const std::string_view name : shape_names()) {
            if (name == "wavy-plane" || (name == "torus" && n < 3)) continue;
            SCOPED_TRACE(std::string(name) + " " + std::to_string(n));
            const Result<Mesh> mesh = make_shape(name, {.resolution = n});
            ASSERT_TRUE(mesh.ok());
            EXPECT_EQ(check_mesh(*mesh), "");
            expect_watertight(*mesh);
            EXPECT_EQ(euler(*mesh), name == "torus" ? 0 : 2);
            EXPECT_GT(volume(*mesh), 0);
            EXPECT_EQ(point_set(*mesh).size(), mesh->vertex_count()); // no two vertices at one spot
            EXPECT_TRUE(mesh->normals.empty());
        }
}

TEST(WavyCube, HasTheReportsCounts) {
    const Mesh mesh = make_wavy_cube({.resolution = 128});
    EXPECT_EQ(mesh.vertex_count(), 98306u);
    EXPECT_EQ(mesh.face_count(), 98304u);
}

TEST(WavyCube, CarriesEquation21OnEverySide) {
    const unsigned n = 32;
    const ShapeOptions options{.resolution = n, .frequency = 5, .amplitude = 0.04, .size = 2};
    const Mesh mesh = make_wavy_cube(options);
    std::size_t raised = 0;
    for (const Vec3f& position : mesh.positions) {
        const Vec3d p = position.cast<double>();
        Eigen::Index axis;
        const double side = p.cwiseAbs().maxCoeff(&axis);
        const double u = 0.5 + p[(axis + 1) % 3] / 2, v = 0.5 + p[(axis + 2) % 3] / 2; // waves move along the axis only
        const double rim = std::min({u, v, 1 - u, 1 - v}) * n;
        const double height = 2 * 0.04 * std::sin(10 * std::numbers::pi * u) * std::sin(10 * std::numbers::pi * v);
        EXPECT_NEAR(side, rim < 1.5 ? 1 : 1 + height, 1e-6);
        raised += std::abs(side - 1) > 1e-6;
    }
    EXPECT_GT(raised, 4000u);
}

TEST(WavyCube, IsSymmetricToTheBit) {
    const Mesh mesh = make_wavy_cube({.resolution = 20});
    const Mat3f cyclic = (Mat3f() << 0, 1, 0, 0, 0, 1, 1, 0, 0).finished();
    EXPECT_EQ(point_set(mesh), point_set(mesh, cyclic));
    const Mat3f swap = (Mat3f() << 0, 1, 0, 1, 0, 0, 0, 0, 1).finished();
    EXPECT_EQ(point_set(mesh), point_set(mesh, swap));
    EXPECT_EQ(point_set(mesh), point_set(mesh, -Mat3f::Identity())); // both waves of a side change sign
}

TEST(WavyCube, ResolutionsNest) {
    const auto fine = point_set(make_wavy_cube({.resolution = 16, .amplitude = 0}));
    for (const auto& p : point_set(make_wavy_cube({.resolution = 4, .amplitude = 0}))) EXPECT_TRUE(fine.contains(p));
}

TEST(WavySphere, StaysWithinItsWaves) {
    float low = 2, high = 0;
    for (const Vec3f& p : make_wavy_sphere({.resolution = 40, .amplitude = 0.1, .size = 2}).positions) {
        low = std::min(low, p.norm());
        high = std::max(high, p.norm());
    }
    EXPECT_NEAR(low, 0.9, 0.01);
    EXPECT_NEAR(high, 1.1, 0.01);
    EXPECT_NEAR(volume(make_wavy_sphere({.resolution = 64, .amplitude = 0})), std::numbers::pi / 6, 1e-3);
}

TEST(WavyPlane, IsOpenAndHasUvs) {
    const Mesh mesh = make_wavy_plane({.resolution = 8, .frequency = 1, .amplitude = 0.25});
    EXPECT_EQ(mesh.vertex_count(), 81u);
    EXPECT_EQ(mesh.face_count(), 64u);
    ASSERT_TRUE(mesh.uvs.per_vertex());
    ASSERT_EQ(mesh.uvs.values.size(), 81u);
    EXPECT_EQ(mesh.uvs.values[80], Vec2f(1, 1));
    EXPECT_EQ(mesh.positions[2 * 9 + 2], Vec3f(-0.25f, -0.25f, 0.25f)); // the first quarter wave's crest
    EXPECT_EQ(mesh.positions[80], Vec3f(0.5f, 0.5f, 0));
    const auto edges = directed_edges(mesh);
    EXPECT_EQ(std::ranges::count_if(edges,
                                    [&](const auto& e) {
                                        return !edges.contains({e.first.second, e.first.first});
                                    }),
              32);
}

TEST(WavyPlate, IsClosedAndEvenlyThick) {
    const Mesh mesh =
        make_wavy_plate({.resolution = 16, .frequency = 2, .amplitude = 0.05, .size = 2, .thickness = 0.125});
    EXPECT_EQ(mesh.face_count(), 2u * 16 * 16 + 4 * 16 * 2);
    const auto edges = directed_edges(mesh);
    for (const auto& [edge, count] : edges) EXPECT_TRUE(edges.contains({edge.second, edge.first}));
    EXPECT_NEAR(volume(mesh), 2 * 2 * 0.25, 1e-6); // waves of both sides are alike
    EXPECT_EQ(bounds(mesh.positions).max, Vec3d(1, 1, double(0.125f + 0.1f)));
}

TEST(Bar, HasItsSize) {
    const Mesh mesh = make_bar({.resolution = 4, .size = 2, .length = 3});
    EXPECT_EQ(bounds(mesh.positions).max, Vec3d(3, 1, 1));
    EXPECT_EQ(bounds(mesh.positions).min, Vec3d(-3, -1, -1));
    EXPECT_EQ(mesh.face_count(), 12u * 16 + 2 * 16);
    EXPECT_NEAR(volume(mesh), 24, 1e-12);
}

TEST(Cylinder, IsRoundAndEven) {
    const Mesh mesh = make_cylinder({.resolution = 16, .length = 2});
    EXPECT_EQ(mesh.face_count(), 32u * 64 + 2 * 256);
    const double polygon =
        32 * std::sin(2 * std::numbers::pi / 64) / 4; // area of a regular 64-gon in the unit circle, over 4
    EXPECT_NEAR(volume(mesh), 2 * polygon, 1e-6);
    for (const Vec3f& p : mesh.positions) {
        if (std::abs(p.x()) == 1) continue;
        EXPECT_NEAR(std::hypot(p.y(), p.z()), 0.5, 1e-7);
    }
    const Mat3f quarter_turn = (Mat3f() << 1, 0, 0, 0, 0, -1, 0, 1, 0).finished();
    EXPECT_EQ(point_set(mesh), point_set(mesh, quarter_turn));
}

TEST(Torus, HasPappusVolume) {
    const Mesh mesh = make_torus({.resolution = 128, .amplitude = 0, .size = 2, .thickness = 0.25});
    EXPECT_EQ(mesh.face_count(), 2u * 128 * 128);
    EXPECT_NEAR(volume(mesh), 2 * std::numbers::pi * std::numbers::pi / 16, 2e-3);
}

TEST(MakeShape, RefusesWhatMakesNoSense) {
    EXPECT_EQ(make_shape("teapot", {}).error().code, ErrorCode::usage);
    EXPECT_NE(make_shape("teapot", {}).error().message.find("cylinder"), std::string::npos);
    const double nan = std::nan("");
    for (const ShapeOptions& options :
         {ShapeOptions{.resolution = 0}, ShapeOptions{.resolution = 8193}, ShapeOptions{.frequency = -1},
          ShapeOptions{.frequency = nan}, ShapeOptions{.amplitude = nan}, ShapeOptions{.size = 0},
          ShapeOptions{.length = -4}, ShapeOptions{.resolution = 8192, .length = 100}, ShapeOptions{.thickness = 2}})
        EXPECT_EQ(make_shape("bar", options).error().code, ErrorCode::usage);
    EXPECT_EQ(make_shape("torus", {.resolution = 2}).error().code, ErrorCode::usage);
    EXPECT_TRUE(make_shape("torus", {.resolution = 3}).ok());
}

} // namespace
} // namespace filigree
