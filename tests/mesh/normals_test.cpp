#include "filigree/mesh/normals.h"

#include "filigree/mesh.h"
#include "threads.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

TEST(VertexNormals, OfAUnitSquareInAnyScale) {
    for (const float scale : {1e-42f, 1.0f, 1e30f}) {
        Mesh mesh;
        mesh.positions = {{0, 0, 0}, {scale, 0, 0}, {scale, scale, 0}, {0, scale, 0}};
        mesh.add_face(std::array<Index, 4>{0, 1, 2, 3});
        for (const Vec3f& n : vertex_normals(mesh, mesh.positions, RunContext(1))) EXPECT_EQ(n, Vec3f(0, 0, 1));
    }
}

TEST(DoubledAreaVector, IsRightForFacesFarOutAndNotConvex) {
    const float far = 1 << 20; // a float's step is 1/8 there
    const std::vector<Vec3f> arrow = {{far, far, 0}, {far + 4, far + 4, 0}, {far, far + 8, 0}, {far + 1, far + 4, 0}};
    EXPECT_EQ(doubled_area_vector(arrow, std::vector<Index>{0, 1, 2, 3}), Vec3d(0, 0, 2 * (16 - 4)));
    EXPECT_EQ(doubled_area_vector(arrow, std::vector<Index>{3, 2, 1, 0}), Vec3d(0, 0, -2 * (16 - 4)));
}

TEST(VertexNormals, AreWeightedByArea) {
    Mesh mesh; // around vertex 0: area 3/2 facing z and 4/2 facing x
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 3, 0}, {0, 0, -4}, {0, 1, 0}};
    mesh.add_face(std::array<Index, 3>{0, 1, 2});
    mesh.add_face(std::array<Index, 3>{0, 3, 4});
    EXPECT_TRUE(vertex_normals(mesh, mesh.positions, RunContext(1))[0].isApprox(Vec3f(0.8f, 0, 0.6f)));
}

TEST(VertexNormals, AreZeroWithoutAFaceOfPositiveArea) {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {5, 5, 5}};
    mesh.add_face(std::array<Index, 3>{0, 1, 2});
    for (const Vec3f& n : vertex_normals(mesh, mesh.positions, RunContext(1))) EXPECT_EQ(n, Vec3f(0, 0, 0));
    EXPECT_TRUE(vertex_normals(Mesh{}, {}, RunContext(1)).empty());
}

TEST(VertexNormals, OfASpherePointOutwards) {
    const Mesh mesh = make_wavy_sphere({.resolution = 64, .amplitude = 0});
    const std::vector<Vec3f> normals = vertex_normals(mesh, mesh.positions, RunContext(1));
    for (std::size_t v = 0; v < normals.size(); ++v)
        EXPECT_GT(normals[v].dot(mesh.positions[v].normalized()), 0.9995f); // 1.8 degrees, at the cube's corners
}

TEST(VertexNormals, PolygonsAgreeWithTheirTrianglesWhereFlat) {
    const Mesh mesh =
        make_bar({.resolution = 4, .length = 2}); // inside a side; at its rim quads and halves weigh otherwise
    const std::vector<Vec3f> quads = vertex_normals(mesh, mesh.positions, RunContext(1));
    const std::vector<Vec3f> halves =
        vertex_normals(std::span<const Triangle>(triangulate(mesh).triangles), mesh.positions, RunContext(1));
    int inside_a_side = 0;
    for (std::size_t v = 0; v < quads.size(); ++v) {
        if (quads[v].cwiseAbs().maxCoeff() != 1) continue;
        ++inside_a_side;
        EXPECT_EQ(quads[v], halves[v]);
    }
    EXPECT_EQ(inside_a_side, 2 * 9 + 4 * 7 * 3);
}

TEST(VertexNormals, DoNotDependOnThreads) {
    FILIGREE_NEEDS_TWO_THREADS();
    const Mesh mesh = make_wavy_cube({.resolution = 96});
    EXPECT_EQ(vertex_normals(mesh, mesh.positions, RunContext(1)), vertex_normals(mesh, mesh.positions, RunContext(3)));
}

} // namespace
} // namespace filigree
