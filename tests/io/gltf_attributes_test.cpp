// Attributes as careless exporters write them, UVs that a material moves, and extensions that a file requires.
#include "filigree/file.h"
#include "io/gltf_text.h"

#include <gtest/gtest.h>

#include <cmath>

using namespace filigree;
using namespace filigree_test;

namespace {

const std::string kOnlyNode = R"("nodes":[{"mesh":0}],)";

std::string triangle_mesh(const std::string& attributes, const std::string& more = "") {
    return R"("meshes":[{"primitives":[{"attributes":{"POSITION":0)" + attributes + "}" + more + "}]}]";
}

MeshFile read_gltf_text(const std::string& bytes) {
    Result<MeshFile> read = read_mesh(bytes, "a.gltf", RunContext(1));
    if (!read) throw std::runtime_error(read.error().message); // fails the test with the sentence
    return *std::move(read);
}

template <class T>
MeshFile with_attribute(const std::string& name, const std::vector<T>& numbers, int component, const std::string& type,
                        const std::string& more = "", const std::string& document = "") {
    GltfText file;
    file.add(kTriangle, "VEC3");
    file.add(numbers, component, type, more);
    return read_gltf_text(file.text(document + kOnlyNode + triangle_mesh(",\"" + name + "\":1")));
}

const std::string kAsNormalized =
    "Integers without \"normalized\" were taken as normalized (the largest of their type is 1): ";

/// One triangle with two sets of UVs (the second is the first, halved), and a material with a picture.
MeshFile textured(const std::string& texture, const std::string& document = "", bool second_set = true) {
    GltfText file;
    file.add(kTriangle, "VEC3");
    file.add({0, 0, 1, 0, 0, 1}, "VEC2");
    file.add({0, 0, 0.5f, 0, 0, 0.5f}, "VEC2");
    const std::string png = "data:image/png;base64," + base64("\x89PNG\r\n\x1a\n");
    return read_gltf_text(file.text(
        document + kOnlyNode + R"("images":[{"uri":")" + png +
        R"("}],"textures":[{"source":0}],"materials":[{"pbrMetallicRoughness":{"baseColorTexture":)" + texture +
        "}}]," +
        triangle_mesh(second_set ? R"(,"TEXCOORD_0":1,"TEXCOORD_1":2)" : R"(,"TEXCOORD_0":1)", R"(,"material":0)")));
}

void expect_uvs(const Mesh& mesh, const std::vector<Vec2f>& v_down) {
    ASSERT_EQ(mesh.uvs.values.size(), v_down.size());
    for (std::size_t i = 0; i < v_down.size(); ++i) {
        EXPECT_NEAR(mesh.uvs.values[i].x(), v_down[i].x(), 1e-6) << i;
        EXPECT_NEAR(1 - mesh.uvs.values[i].y(), v_down[i].y(), 1e-6) << i;
    }
}

} // namespace

TEST(GltfAttributes, UnflaggedIntegersAreTakenAsNormalizedWithOneSentence) {
    const MeshFile colors =
        with_attribute<std::uint16_t>("COLOR_0", {65535, 0, 0, 0, 65535, 0, 0, 0, 65535}, 5123, "VEC3");
    EXPECT_EQ(colors.warnings, std::vector<std::string>{kAsNormalized + "'COLOR_0'."});
    EXPECT_EQ(colors.mesh.colors[0], Vec4f(1, 0, 0, 1));
    const MeshFile bytes = with_attribute<std::uint8_t>("COLOR_0", std::vector<std::uint8_t>(12, 255), 5121, "VEC4");
    EXPECT_EQ(bytes.mesh.colors[2], Vec4f(1, 1, 1, 1));
    const MeshFile uvs = with_attribute<std::uint16_t>("TEXCOORD_0", {0, 0, 65535, 0, 0, 65535}, 5123, "VEC2");
    EXPECT_EQ(uvs.warnings, std::vector<std::string>{kAsNormalized + "'TEXCOORD_0'."});
    EXPECT_EQ(uvs.mesh.uvs.values[1], Vec2f(1, 1));
    const MeshFile normals = with_attribute<std::int8_t>("NORMAL", {0, 0, 127, 0, 0, 127, 0, 0, 127}, 5120, "VEC3");
    EXPECT_EQ(normals.mesh.normals.values[0], Vec3f(0, 0, 1));
    EXPECT_EQ(normals.warnings, std::vector<std::string>{kAsNormalized + "'NORMAL'."});
}

TEST(GltfAttributes, IntegersOfNoneAndOneAreTakenAsTheyAre) {
    const MeshFile uvs = with_attribute<std::uint16_t>("TEXCOORD_0", {0, 0, 1, 0, 0, 1}, 5123, "VEC2");
    EXPECT_EQ(uvs.mesh.uvs.values[1], Vec2f(1, 1));
    EXPECT_EQ(uvs.warnings, std::vector<std::string>{"Integers without \"normalized\" were taken as they are, as none "
                                                     "is beyond 1: 'TEXCOORD_0'."});
}

TEST(GltfAttributes, QuantizedUvsMayBeWholeNumbers) {
    const MeshFile uvs = with_attribute<std::uint16_t>("TEXCOORD_0", {0, 0, 3, 0, 0, 2}, 5123, "VEC2", "",
                                                       R"("extensionsUsed":["KHR_mesh_quantization"],)");
    EXPECT_TRUE(uvs.warnings.empty());
    EXPECT_EQ(uvs.mesh.uvs.values[1], Vec2f(3, 1));
}

TEST(GltfAttributes, NumbersOfAKindThatDoesNotServeAreLeftOut) {
    for (const std::string name : {"COLOR_0", "TEXCOORD_0", "NORMAL"}) {
        const MeshFile odd = with_attribute<std::uint32_t>(name, std::vector<std::uint32_t>(12, 7), 5125, "VEC4");
        EXPECT_EQ(odd.mesh.vertex_count(), 3u);
        EXPECT_EQ(odd.warnings, std::vector<std::string>{"Attributes whose numbers are of a kind that glTF does not "
                                                         "have for them were left out: '" +
                                                         name + "'."});
    }
}

TEST(GltfAttributes, ColoursBeyondOneAreToldOf) {
    const MeshFile bytes = with_attribute<float>("COLOR_0", {255, 0, 0, 0, 255, 0, 0, 0, 51}, 5126, "VEC3");
    EXPECT_EQ(bytes.mesh.colors[0], Vec4f(1, 0, 0, 1));
    EXPECT_NEAR(bytes.mesh.colors[2].z(), 1.055 * std::pow(0.2, 1 / 2.4) - 0.055, 1e-6);
    ASSERT_EQ(bytes.warnings.size(), 1u);
    EXPECT_NE(bytes.warnings[0].find("taken as 0 to 255"), std::string::npos);
    const MeshFile bright = with_attribute<float>("COLOR_0", {2.5f, 0, 0, 0, 0.5f, 0, 0, 0, 1}, 5126, "VEC3");
    EXPECT_EQ(bright.mesh.colors[0], Vec4f(1, 0, 0, 1));
    ASSERT_EQ(bright.warnings.size(), 1u);
    EXPECT_NE(bright.warnings[0].find("became 1"), std::string::npos);
}

TEST(GltfAttributes, SkinsWithUnflaggedWeightsAndOddJoints) {
    const std::string skinned =
        R"("nodes":[{"mesh":0,"skin":0},{},{"translation":[0,0,5]}],"skins":[{"joints":[1,2]}],)";
    for (const bool normalized_joints : {false, true}) {
        GltfText file;
        file.add(kTriangle, "VEC3");
        file.add<std::uint8_t>({1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, 5121, "VEC4",
                               normalized_joints ? "\"normalized\":true" : "");
        file.add<std::uint8_t>({254, 0, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0}, 5121, "VEC4");
        file.add<float>({0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}, 5126, "VEC4");
        file.add<std::uint8_t>({1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}, 5121, "VEC4"); // 1 of 255, not all of it
        const MeshFile read = read_gltf_text(
            file.text(skinned + triangle_mesh(R"(,"JOINTS_0":1,"WEIGHTS_0":2,"JOINTS_1":3,"WEIGHTS_1":4)")));
        const Vec3f origin = read.mesh.origin.cast<float>();
        expect_near(Vec3f(origin + read.mesh.positions[0]), {0, 0, 5 * 254.0 / 255}, 1e-5);
        expect_near(Vec3f(origin + read.mesh.positions[1]), {1, 0, 5}, 1e-5);
        EXPECT_EQ(read.warnings[0], kAsNormalized + "'WEIGHTS_0'.");
        ASSERT_EQ(read.warnings.size(), 2u);
        EXPECT_NE(read.warnings[1].find(normalized_joints ? "'JOINTS_0', 'JOINTS_1'" : "'JOINTS_1'"),
                  std::string::npos);
    }
}

TEST(GltfAttributes, TextureTransformMovesTheUvs) {
    const std::string required = R"("extensionsRequired":["KHR_texture_transform"],)";
    const auto transform = [](const std::string& what) {
        return R"({"index":0,"extensions":{"KHR_texture_transform":{)" + what + "}}}";
    };
    const MeshFile moved = textured(transform(R"("offset":[0.5,0.25],"scale":[2,4])"), required, false);
    expect_uvs(moved.mesh, {{0.5f, 0.25f}, {2.5f, 0.25f}, {0.5f, 4.25f}});
    EXPECT_TRUE(moved.warnings.empty());
    // a quarter turn: u' = v, v' = -u, counter-clockwise where v goes down
    const MeshFile turned = textured(transform(R"("rotation":1.5707963267948966)"), required, false);
    expect_uvs(turned.mesh, {{0, 0}, {0, -1}, {1, 0}});
    // first the scale, then the turn, then the offset
    const MeshFile all =
        textured(transform(R"("offset":[1,0],"scale":[2,3],"rotation":1.5707963267948966)"), required, false);
    expect_uvs(all.mesh, {{1, 0}, {1, -2}, {4, 0}});
}

TEST(GltfAttributes, TheSetOfUvsThatAMaterialNamesIsRead) {
    const MeshFile second = textured(R"({"index":0,"texCoord":1})");
    expect_uvs(second.mesh, {{0, 0}, {0.5f, 0}, {0, 0.5f}});
    EXPECT_EQ(second.warnings, std::vector<std::string>{"Attributes that are not read were left out: 'TEXCOORD_0'."});
    ASSERT_EQ(second.mesh.embedded_materials.size(), 1u);
    EXPECT_TRUE(second.mesh.embedded_materials[0].picture_bytes);
    // the transform's own set goes before the texture's
    const MeshFile other =
        textured(R"({"index":0,"texCoord":0,"extensions":{"KHR_texture_transform":{"texCoord":1,"scale":[2,2]}}})");
    expect_uvs(other.mesh, {{0, 0}, {1, 0}, {0, 1}});
    const MeshFile missing = textured(R"({"index":0,"texCoord":1})", "", false);
    EXPECT_TRUE(missing.mesh.uvs.values.empty());
    EXPECT_NE(missing.warnings[0].find("lack the set of UVs"), std::string::npos);
}

TEST(GltfAttributes, MaterialsOfOneGeometryMoveItsUvsEachInItsWay) {
    GltfText file;
    file.add(kTriangle, "VEC3");
    file.add({0, 0, 1, 0, 0, 1}, "VEC2");
    const std::string png = "data:image/png;base64," + base64("\x89PNG\r\n\x1a\n");
    const std::string attributes = R"({"attributes":{"POSITION":0,"TEXCOORD_0":1},"material":)";
    const MeshFile read = read_gltf_text(file.text(kOnlyNode + R"("images":[{"uri":")" + png +
                                                   R"("}],"textures":[{"source":0}],"materials":[
        {"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}},
        {"pbrMetallicRoughness":{"baseColorTexture":{"index":0,"extensions":{"KHR_texture_transform":{"offset":[3,0]}}}}}],
        "meshes":[{"primitives":[)" + attributes + "0}," +
                                                   attributes + "1}]}]"));
    EXPECT_EQ(read.mesh.vertex_count(), 3u); // which they share
    ASSERT_EQ(read.mesh.uvs.corners.size(), 6u);
    for (std::size_t c = 0; c < 3; ++c) {
        const Vec2f first = read.mesh.uvs.values[read.mesh.uvs.corners[c]];
        EXPECT_EQ(read.mesh.uvs.values[read.mesh.uvs.corners[c + 3]], Vec2f(first.x() + 3, first.y()));
    }
}

TEST(GltfAttributes, RequiredExtensionsThatAreNotReadAreRefusedByName) {
    GltfText file;
    file.add(kTriangle, "VEC3");
    for (const std::string name : {"KHR_texture_basisu", "EXT_texture_webp", "KHR_materials_transmission",
                                   "KHR_animation_pointer", "EXT_mesh_gpu_instancing", "ACME_magic"}) {
        const Result<MeshFile> read =
            read_mesh(file.text("\"extensionsRequired\":[\"" + name + "\"]," + kOnlyNode + triangle_mesh("")), "a.gltf",
                      RunContext(1));
        ASSERT_FALSE(read.ok()) << name;
        EXPECT_EQ(read.error().code, ErrorCode::unsupported);
        EXPECT_NE(read.error().message.find(name), std::string::npos) << read.error().message;
    }
    for (const std::string name : {"KHR_mesh_quantization", "KHR_lights_punctual", "KHR_materials_unlit"})
        EXPECT_TRUE(read_mesh(file.text("\"extensionsRequired\":[\"" + name + "\"]," + kOnlyNode + triangle_mesh("")),
                              "a.gltf", RunContext(1))
                        .ok())
            << name;
}

TEST(GltfAttributes, SpecularGlossinessGivesItsDiffuseColour) {
    GltfText file;
    file.add(kTriangle, "VEC3");
    const MeshFile read = read_gltf_text(file.text(
        R"("extensionsRequired":["KHR_materials_pbrSpecularGlossiness"],"materials":[{"extensions":
        {"KHR_materials_pbrSpecularGlossiness":{"diffuseFactor":[1,0,0,1],"glossinessFactor":0.25}}}],)" +
        kOnlyNode + triangle_mesh("", R"(,"material":0)")));
    ASSERT_EQ(read.mesh.embedded_materials.size(), 1u);
    EXPECT_EQ(read.mesh.embedded_materials[0].color, Vec3f(1, 0, 0));
    EXPECT_EQ(read.mesh.embedded_materials[0].roughness, 0.75f);
    EXPECT_EQ(read.mesh.embedded_materials[0].metallic, 0.0f);
}
