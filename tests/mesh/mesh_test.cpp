#include "filigree/mesh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

using namespace filigree;

namespace {

Mesh make_square() {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    mesh.add_face(std::array<Index, 4>{0, 1, 2, 3});
    return mesh;
}

} // namespace

TEST(CheckMesh, PassesWhatIsRight) {
    EXPECT_EQ(check_mesh(Mesh{}), "");
    Mesh mesh = make_square();
    mesh.uvs = {{{0, 0}}, {0, 0, kNoIndex, 0}}; // a corner may have none
    mesh.normals.values.assign(4, Vec3f::UnitZ());
    mesh.colors.assign(4, Vec4f::Ones());
    mesh.scalars = {{"quality", {1, 2, 3, 4}}};
    mesh.groups = {{"a"}, {kNoIndex}};
    mesh.smoothing = {7};
    EXPECT_EQ(check_mesh(mesh), "");
}

TEST(CheckMesh, FindsEachThingThatCanBeWrong) {
    const float nan = std::nanf("");
    const std::vector<void (*)(Mesh&)> damages = {
        [](Mesh& m) { m.face_offsets.clear(); },
        [](Mesh& m) { m.face_offsets[0] = 1; },
        [](Mesh& m) { m.face_offsets.push_back(5); },
        [](Mesh& m) {
            m.face_offsets = {0, 8, 4};
        },
        [](Mesh& m) {
            m.face_offsets = {0, 2, 4};
        },
        [](Mesh& m) { m.corners[2] = 4; },
        [](Mesh& m) { m.corners[2] = kNoIndex; },
        [](Mesh& m) { m.origin.y() = std::nan(""); },
        [](Mesh& m) { m.positions[3].z() = std::numeric_limits<float>::infinity(); },
        [](Mesh& m) {
            m.uvs.values = {{0, 0}};
        },
        [](Mesh& m) {
            m.uvs = {{{0, 0}}, {0, 0, 1, 0}};
        },
        [](Mesh& m) {
            m.normals = {{{0, 0, 1}}, {0, 0, 0}};
        },
        [](Mesh& m) { m.colors.assign(3, Vec4f::Ones()); },
        [](Mesh& m) {
            m.scalars = {{"q", {1, 2, 3}}};
        },
        [](Mesh& m) {
            m.objects = {{"a"}, {0, 0}};
        },
        [](Mesh& m) {
            m.groups = {{"a"}, {1}};
        },
        [](Mesh& m) {
            m.materials = {{}, {0}};
        },
        [](Mesh& m) {
            m.smoothing = {0, 0};
        },
    };
    for (std::size_t i = 0; i < damages.size(); ++i) {
        Mesh mesh = make_square();
        damages[i](mesh);
        EXPECT_NE(check_mesh(mesh), "") << "damage " << i;
    }
    Mesh mesh = make_square();
    mesh.normals.values.assign(4, Vec3f(0, 0, nan));
    EXPECT_NE(check_mesh(mesh), "");
    mesh = make_square();
    mesh.scalars = {{"q", {1, 2, nan, 4}}};
    EXPECT_NE(check_mesh(mesh), "");
}

Mesh split(std::span<const Vec3d> world, std::span<const Index> face = {}) {
    Mesh mesh;
    if (!face.empty()) mesh.add_face(face);
    split_origin(world, mesh);
    return mesh;
}

TEST(SplitOrigin, IsZeroUpToTwiceTheDiagonal) {
    const auto origin_at = [](double x) {
        const Vec3d points[] = {{x, 0, 0}, {x + 1, 0, 0}}; // diagonal 1
        return split(points).origin;
    };
    EXPECT_EQ(origin_at(0), Vec3d::Zero());
    EXPECT_EQ(origin_at(2), Vec3d::Zero());
    EXPECT_EQ(origin_at(-3), Vec3d::Zero());
    EXPECT_NE(origin_at(2.001), Vec3d::Zero());
    EXPECT_NE(origin_at(-3.001), Vec3d::Zero());
    EXPECT_EQ(split(std::span<const Vec3d>{}).origin, Vec3d::Zero());
}

TEST(SplitOrigin, KeepsMillimetresFarAway) {
    const Vec3d points[] = {{500000.001, 4500000.002, 10.003}, {500001.004, 4500003.005, 12.006}};
    const Mesh mesh = split(points);
    for (int i = 0; i < 2; ++i) EXPECT_LT((mesh.world_position(i) - points[i]).norm(), 1e-6);
    // the box's centre, to within half its diagonal
    EXPECT_LT((mesh.origin - 0.5 * (points[0] + points[1])).norm(), (points[1] - points[0]).norm());
}

TEST(SplitOrigin, AStrayVertexSaysNothing) {
    const Vec3d points[] = {{500000.001, 4e6, 0}, {500001, 4e6, 0}, {500000, 4000001.002, 0}, {0, 0, 0}};
    const Index triangle[] = {0, 1, 2};
    const Mesh precise = split(points, triangle);
    for (int i = 0; i < 3; ++i) EXPECT_LT((precise.world_position(i) - points[i]).norm(), 1e-6) << i;
    Mesh mesh;
    for (const Vec3d& p : points) mesh.positions.push_back(p.cast<float>());
    EXPECT_EQ(bounds(mesh).min.x(), 0) << "all vertices of a mesh without faces";
    mesh.add_face(triangle);
    EXPECT_EQ(bounds(mesh).min.x(), 500000);
    Mesh rounded = mesh;
    rounded.positions[3] = Vec3f(0.1f, 0, 0);
    split_origin(mesh);
    EXPECT_NEAR(mesh.origin.x(), 500000, 2);
    EXPECT_EQ(world_bounds(mesh).max.x(), 500001);
    split_origin(rounded);
    EXPECT_EQ(rounded.world_position(3), Vec3d(double(0.1f), 0, 0)) << "floats keep their digits, strays too";
}

TEST(SplitOrigin, OnePointKeepsItsPlace) {
    const Vec3d point[] = {{0.1, -1e9, 3}};
    EXPECT_EQ(split(point).world_position(0), point[0]);
}

TEST(SplitOrigin, IsExactForFloats) {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> unit(-1, 1);
    std::uniform_int_distribution<int> exponent(-30, 30), shift(-12, 6);
    for (int trial = 0; trial < 2000; ++trial) {
        const Vec3f centre(std::ldexp(unit(random), exponent(random)), std::ldexp(unit(random), exponent(random)), 0);
        const float size = std::ldexp(centre.norm(), shift(random));
        Mesh mesh;
        for (int v = 0; v < 20; ++v)
            mesh.positions.push_back(centre + size * Vec3f(unit(random), unit(random), unit(random)));
        const std::vector<Vec3f> before = mesh.positions;
        split_origin(mesh);
        for (std::size_t v = 0; v < before.size(); ++v)
            ASSERT_EQ(mesh.world_position(v), Vec3d(before[v].cast<double>())) << "trial " << trial;
    }
}
