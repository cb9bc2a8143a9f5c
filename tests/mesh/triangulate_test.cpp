#include "filigree/mesh.h"

#include <Eigen/Geometry>
#include <cmath>
#include <gtest/gtest.h>
#include <map>
#include <numbers>
#include <numeric>
#include <random>

namespace filigree {
namespace {

Mesh one_face(std::vector<Vec3f> positions) {
    Mesh mesh;
    mesh.positions = std::move(positions);
    std::vector<Index> face(mesh.positions.size());
    std::iota(face.begin(), face.end(), Index{0});
    mesh.add_face(face);
    return mesh;
}

Vec3d area_vector(const Mesh& mesh, const Triangle& t) {
    const Vec3d a = mesh.positions[t[0]].cast<double>();
    return 0.5 * (mesh.positions[t[1]].cast<double>() - a).cross(mesh.positions[t[2]].cast<double>() - a);
}

Vec3d face_area_vector(const Mesh& mesh, std::size_t f) {
    Vec3d sum = Vec3d::Zero();
    for (std::size_t i = 2; i < mesh.face(f).size(); ++i)
        sum += area_vector(mesh, {mesh.face(f)[0], mesh.face(f)[i - 1], mesh.face(f)[i]});
    return sum;
}

/// Triangles cover a planar face exactly once: none is turned over, and the areas add up.
void expect_exact_cover(const Mesh& mesh) {
    const Triangulation result = triangulate(mesh);
    const Vec3d normal = face_area_vector(mesh, 0).normalized();
    double area = 0;
    for (const Triangle& t : result.triangles) {
        const double a = area_vector(mesh, t).dot(normal);
        EXPECT_GE(a, 0);
        area += a;
    }
    EXPECT_EQ(result.triangles.size(), mesh.face(0).size() - 2);
    EXPECT_NEAR(area / face_area_vector(mesh, 0).norm(), 1, 1e-9);
}

/// The border of the triangles is the face's outline: the edges inside cancel.
void expect_same_border(const Mesh& mesh, const Triangulation& result) {
    std::map<std::pair<Index, Index>, int> edges;
    const auto add = [&](Index a, Index b, int sign) { edges[std::minmax(a, b)] += a < b ? sign : -sign; };
    for (std::size_t f = 0; f < mesh.face_count(); ++f)
        for (std::size_t i = 0; i < mesh.face(f).size(); ++i)
            add(mesh.face(f)[i], mesh.face(f)[(i + 1) % mesh.face(f).size()], 1);
    for (const Triangle& t : result.triangles)
        for (std::size_t i = 0; i < 3; ++i) add(t[i], t[(i + 1) % 3], -1);
    for (const auto& [edge, count] : edges) EXPECT_EQ(count, 0) << edge.first << " " << edge.second;
}

TEST(Triangulate, NothingGivesNothing) {
    const Triangulation result = triangulate(Mesh{});
    EXPECT_TRUE(result.triangles.empty());
    EXPECT_TRUE(result.source_face.empty());
}

TEST(Triangulate, TrianglesStayAndFacesAreNamed) {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {-1, 0.5f, 0}};
    mesh.add_face(std::array<Index, 3>{0, 1, 2});
    mesh.add_face(std::array<Index, 5>{0, 1, 2, 3, 4});
    mesh.add_face(std::array<Index, 4>{0, 1, 2, 3});
    const Triangulation result = triangulate(mesh);
    EXPECT_EQ(result.triangles.front(), (Triangle{0, 1, 2}));
    EXPECT_EQ(result.source_face, (std::vector<Index>{0, 1, 1, 1, 2, 2}));
    expect_same_border(mesh, result);
}

TEST(Triangulate, QuadIsCutAlongItsShorterDiagonal) {
    const Mesh mesh = one_face({{0, 0, 0}, {2, 0, 0}, {3, 1, 0}, {1, 1, 0}});
    EXPECT_EQ(triangulate(mesh).triangles, (std::vector<Triangle>{{0, 1, 3}, {1, 2, 3}}));
}

TEST(Triangulate, ArrowheadQuadIsCutAtItsReflexCorner) {
    for (std::size_t turn = 0; turn < 4; ++turn) { // the longer diagonal is the only one inside
        std::vector<Vec3f> outline = {{0, 0, 0}, {9, -5, 0}, {1, 0, 0}, {9, 5, 0}};
        std::rotate(outline.begin(), outline.begin() + static_cast<long>(turn), outline.end());
        expect_exact_cover(one_face(outline));
    }
}

TEST(Triangulate, StarsAtEveryScaleAndTilt) {
    std::mt19937 random(7);
    for (const double scale : {1e-42, 1e-20, 1.0, 1e30}) {
        for (int round = 0; round < 40; ++round) {
            const std::size_t n = 5 + random() % 40;
            const Vec3d axis = Vec3d(double(random() % 100) - 50, double(random() % 100) - 50, 1).normalized();
            const Vec3d u = axis.unitOrthogonal(), v = axis.cross(u);
            std::vector<Vec3f> outline;
            for (std::size_t i = 0; i < n; ++i) {
                const double angle = 2 * std::numbers::pi * double(i) / double(n);
                const double radius = scale * (1 + double(random() % 1000) / 100);
                outline.push_back((radius * (std::cos(angle) * u + std::sin(angle) * v)).cast<float>());
            }
            const Mesh mesh = one_face(outline);
            const Triangulation result = triangulate(mesh);
            EXPECT_EQ(result.triangles.size(), n - 2);
            expect_same_border(mesh, result);
            if (scale >= 1e-20) expect_exact_cover(mesh); // below, the rounding of denormals bends the outline
        }
    }
}

TEST(Triangulate, StraightCornersGiveNoEmptyTriangle) {
    // a square with three extra corners on each side
    std::vector<Vec3f> outline;
    for (int side = 0; side < 4; ++side)
        for (int i = 0; i < 4; ++i) {
            const float t = float(i);
            const std::array<Vec3f, 4> p = {Vec3f(t, 0, 0), Vec3f(4, t, 0), Vec3f(4 - t, 4, 0), Vec3f(0, 4 - t, 0)};
            outline.push_back(p[std::size_t(side)]);
        }
    const Mesh mesh = one_face(outline);
    expect_exact_cover(mesh);
    for (const Triangle& t : triangulate(mesh).triangles) EXPECT_GT(area_vector(mesh, t).z(), 0);
}

TEST(Triangulate, BridgedHoleStaysAHole) {
    // a square with a square hole, cut open from corner 0 to the hole's corner 4; the bridge is walked both ways
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {9, 0, 0}, {9, 9, 0}, {0, 9, 0}, {3, 3, 0}, {3, 6, 0}, {6, 6, 0}, {6, 3, 0}};
    mesh.add_face(std::array<Index, 10>{0, 1, 2, 3, 0, 4, 5, 6, 7, 4});
    expect_exact_cover(mesh);
    EXPECT_NEAR(face_area_vector(mesh, 0).z(), 81 - 9, 1e-12);
    const Vec3d hole(4.5, 4.6, 0);
    for (const Triangle& t : triangulate(mesh).triangles) {
        int left = 0;
        for (std::size_t i = 0; i < 3; ++i) {
            const Vec3d a = mesh.positions[t[i]].cast<double>(), b = mesh.positions[t[(i + 1) % 3]].cast<double>();
            left += (b - a).cross(hole - a).z() > 0;
        }
        EXPECT_LT(left, 3) << "a triangle covers the hole";
    }
}

TEST(Triangulate, ImpossibleOutlinesKeepCountAndBorder) {
    const std::vector<std::vector<Vec3f>> outlines = {
        {{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}},                                     // bow tie
        {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}},                          // one point
        {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}},                          // a line
        {{0, 0, 0}, {2, 2, 0}, {-1, 1, 0}, {2, 0, 0}, {0, 2, 0}, {1, -1, 0}, {1, 3, 0}}}; // a tangle
    for (const auto& outline : outlines) {
        const Mesh mesh = one_face(outline);
        const Triangulation result = triangulate(mesh);
        EXPECT_EQ(result.triangles.size(), outline.size() - 2);
        expect_same_border(mesh, result);
    }
}

TEST(Triangulate, HugeFacesAreQuick) {
    const auto star = [](int corners, double inner) {
        std::vector<Vec3f> outline;
        for (int i = 0; i < corners; ++i) {
            const double angle = 2 * std::numbers::pi * i / corners, r = i % 2 ? inner : 1;
            outline.emplace_back(float(r * std::cos(angle)), float(r * std::sin(angle)), 0.0f);
        }
        return one_face(outline);
    };
    expect_exact_cover(star(2000, 1));
    expect_exact_cover(star(2000, 0.5));
    EXPECT_EQ(triangulate(star(50000, 1)).triangles.size(), 49998u);
    EXPECT_EQ(triangulate(star(50000, 0.5)).triangles.size(), 49998u);
}

TEST(Triangulate, CanBeCancelled) {
    const RunContext context(1);
    const Mesh pentagon = one_face({{0, 0, 0}, {2, 0, 0}, {3, 1, 0}, {2, 2, 0}, {0, 2, 0}});
    EXPECT_EQ(triangulate(pentagon, context)->triangles, triangulate(pentagon).triangles);
    context.cancel();
    EXPECT_EQ(triangulate(pentagon, context).error().code, ErrorCode::cancelled);
}

} // namespace
} // namespace filigree
