// Surfaces whose faces with materials have vertices of their own.
#include "filigree/scene/body_look.h"

#include <gtest/gtest.h>

namespace filigree {
namespace {

/// Two triangles side by side; the first has the first material.
Mesh two_triangles() {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
    mesh.add_face(std::array<Index, 3>{0, 1, 2});
    mesh.add_face(std::array<Index, 3>{1, 3, 2});
    mesh.colors.assign(4, {0.1f, 0.2f, 0.3f, 1});
    mesh.scalars = {{"origin", {4, 5, 6, 7}}};
    mesh.uvs = {{{0, 0}, {1, 0}, {0, 1}}, {0, 1, 2, kNoIndex, kNoIndex, kNoIndex}};
    mesh.materials = {{"skin", "other"}, {0, kNoIndex}};
    return mesh;
}

TEST(BodyLook, FacesWithAMaterialHaveTheirOwnVertices) {
    const Mesh before = two_triangles();
    const Vec3f white = Vec3f::Ones(), red(1, 0, 0);
    const DrawnSurface drawn = with_materials_apart(before, std::array{white, red});
    const Mesh& after = drawn.mesh;
    EXPECT_EQ(drawn.copied, (std::vector<Index>{1, 2}));
    EXPECT_EQ(check_mesh(after), "");
    EXPECT_EQ(after.corners, (std::vector<Index>{0, 1, 2, 4, 3, 5}));
    EXPECT_EQ(after.positions[4], before.positions[1]);
    EXPECT_EQ(after.positions[5], before.positions[2]);
    EXPECT_EQ(after.scalars[0].values, (std::vector<float>{4, 5, 6, 7, 5, 6}));
    for (const Index v : {0, 1, 2}) EXPECT_EQ(after.colors[v], Vec4f::Ones());
    for (const Index v : {3, 4, 5}) EXPECT_EQ(after.colors[v], before.colors[0]);
    EXPECT_EQ(after.uvs.corners, before.uvs.corners);
}

TEST(BodyLook, MaterialsOfOneColourShareVertices) {
    Mesh mesh = two_triangles();
    mesh.materials.of_face = {0, 1};
    const Vec3f white = Vec3f::Ones(), red(1, 0, 0);
    EXPECT_EQ(with_materials_apart(mesh, std::array{white, white}).mesh.vertex_count(), 4u);
    const Mesh apart = with_materials_apart(mesh, std::array{white, red}).mesh;
    EXPECT_EQ(apart.vertex_count(), 6u);
    EXPECT_EQ(apart.colors[4], Vec4f(1, 0, 0, 1));
    mesh.materials = {};
    EXPECT_EQ(with_materials_apart(mesh, {}).mesh.vertex_count(), 4u);
    EXPECT_EQ(with_materials_apart(mesh, {}).mesh.colors, mesh.colors);
}

} // namespace
} // namespace filigree
