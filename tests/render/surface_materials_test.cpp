#include "filigree/render/surface_materials.h"

#include <gtest/gtest.h>

using namespace filigree;

namespace {

std::shared_ptr<const std::string> red_png() {
    Picture picture(2, 2);
    for (std::size_t i = 0; i < picture.rgba.size(); ++i) picture.rgba[i] = i % 4 == 0 || i % 4 == 3 ? 255 : 0;
    return std::make_shared<const std::string>(encode_png(picture));
}

Mesh mesh_with(std::vector<MeshMaterial> materials) {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.uvs.values.assign(3, Vec2f::Zero());
    for (const MeshMaterial& material : materials) {
        mesh.add_face(Triangle{0, 1, 2});
        mesh.materials.of_face.push_back(static_cast<Index>(mesh.materials.names.size()));
        mesh.materials.names.push_back(material.name);
    }
    mesh.embedded_materials = std::move(materials);
    return mesh;
}

} // namespace

TEST(SurfaceMaterials, EmbeddedPicturesAreDecodedOnce) {
    MeshMaterial red, plain;
    red.picture_bytes = red_png();
    plain.color = {0, 1, 0};
    const SurfaceMaterials loaded = load_surface_materials(mesh_with({red, plain, red}), "fox.glb");
    EXPECT_TRUE(loaded.warnings.empty());
    ASSERT_EQ(loaded.materials.size(), 3u);
    ASSERT_EQ(loaded.pictures.size(), 1u);
    ASSERT_TRUE(loaded.materials[0].picture);
    EXPECT_EQ(loaded.materials[0].picture->pixel(1, 1)[0], 255);
    EXPECT_EQ(loaded.materials[0].picture->pixel(1, 1)[1], 0);
    EXPECT_EQ(loaded.materials[2].picture, loaded.materials[0].picture);
    EXPECT_FALSE(loaded.materials[1].picture);
    EXPECT_EQ(loaded.materials[1].color, plain.color);
}

TEST(SurfaceMaterials, DamagedEmbeddedPicturesAreSaid) {
    MeshMaterial bad;
    bad.name = "fur";
    bad.picture_bytes = std::make_shared<const std::string>(red_png()->substr(0, 40));
    const SurfaceMaterials loaded = load_surface_materials(mesh_with({bad}), "fox.glb");
    ASSERT_EQ(loaded.warnings.size(), 1u);
    EXPECT_NE(loaded.warnings[0].find("fox.glb, the texture of the material 'fur'"), std::string::npos);
    EXPECT_FALSE(loaded.materials[0].picture);
}
