// Reading glTF: nodes, primitives, attributes, materials, and our own files again.
#include "filigree/file.h"
#include "filigree/io/file.h"
#include "filigree/io/gltf.h"
#include "filigree/mesh.h"
#include "io/corpus.h"
#include "io/gltf_text.h"
#include "io/sample_meshes.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>

namespace gltf_test {

using namespace filigree;
using namespace filigree_test;

namespace {

const std::string kOneNode = R"("scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)";

Mesh read(const std::string& bytes) {
    const Result<MeshFile> file = read_mesh(bytes, "a.gltf", RunContext(1));
    EXPECT_TRUE(file.ok()) << (file.ok() ? "" : file.error().message);
    if (!file.ok()) return {};
    EXPECT_EQ(check_mesh(file->mesh), "");
    EXPECT_TRUE(file->warnings.empty()) << file->warnings.front();
    return file->mesh;
}

std::vector<std::string> warnings_of(const std::string& bytes) {
    const Result<MeshFile> file = read_mesh(bytes, "a.gltf", RunContext(1));
    EXPECT_TRUE(file.ok()) << (file.ok() ? "" : file.error().message);
    return file.ok() ? file->warnings : std::vector<std::string>();
}

std::vector<Index> faces(const Mesh& mesh) { return mesh.corners; }

/// The triangle, with whatever JSON its nodes are.
std::string triangle_with(const std::string& nodes) {
    GltfText file;
    file.add(kTriangle, "VEC3");
    return file.text(R"("meshes":[{"name":"tri","primitives":[{"attributes":{"POSITION":0}}]}],)" + nodes);
}

} // namespace

TEST(Gltf, PositionsAreThoseOfTheFileToTheBit) {
    GltfText file;
    const std::vector<float> positions = {-0.0f, 1e-42f, 3.4e38f, 0.1f, 1.0f / 3, -7, 5, 6, 7};
    file.add(positions, "VEC3");
    file.add_indices({2, 0, 1});
    const std::string rest = kOneNode + R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}])";
    for (const std::string& bytes : {file.text(rest), file.glb(rest), "\xef\xbb\xbf" + file.text(rest)}) {
        const Mesh mesh = read(bytes);
        ASSERT_EQ(mesh.vertex_count(), 3u);
        EXPECT_EQ(std::memcmp(mesh.positions.data(), positions.data(), 36), 0);
        EXPECT_EQ(faces(mesh), (std::vector<Index>{2, 0, 1}));
        EXPECT_TRUE(mesh.objects.empty());
        EXPECT_TRUE(mesh.materials.empty());
    }
}

TEST(Gltf, NodesCarryTheirMeshes) {
    // a child turned by 90 degrees about z, twice as large, in a parent whose matrix moves it by (0, 0, 5)
    const Mesh mesh = read(triangle_with(
        R"("nodes":[{"matrix":[1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,5,1],"children":[1]},
        {"mesh":0,"translation":[10,0,0],"rotation":[0,0,0.70710678118654752,0.70710678118654752],"scale":[2,2,2]}])"));
    ASSERT_EQ(mesh.vertex_count(), 3u);
    expect_near(mesh.world_position(0), {10, 0, 5});
    expect_near(mesh.world_position(1), {10, 2, 5});
    expect_near(mesh.world_position(2), {8, 0, 5});
}

TEST(Gltf, AMirroringNodeTurnsItsTrianglesOver) {
    GltfText file;
    file.add(kTriangle, "VEC3");
    file.add({0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3");
    const Mesh mesh = read(file.text(R"("nodes":[{"mesh":0,"scale":[-1,1,1]}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0,"NORMAL":1}}]}])"));
    EXPECT_EQ(faces(mesh), (std::vector<Index>{0, 2, 1}));
    expect_near(mesh.positions[1].cast<double>(), {-1, 0, 0});
    expect_near(mesh.normals.values[0].cast<double>(), {0, 0, 1}); // as the face
}

TEST(Gltf, NormalsTurnByTheCofactor) {
    GltfText file;
    file.add(kTriangle, "VEC3");
    file.add({0.6f, 0.8f, 0, 0.6f, 0.8f, 0, 0, 0, 2}, "VEC3");
    const Mesh mesh = read(file.text(R"("nodes":[{"mesh":0,"scale":[2,1,1]}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0,"NORMAL":1}}]}])"));
    expect_near(mesh.normals.values[0].cast<double>(), Vec3d(0.3, 0.8, 0).normalized());
    expect_near(mesh.normals.values[2].cast<double>(), {0, 0, 1});
}

TEST(Gltf, DigitsAreKeptFarFromTheOrigin) {
    const Mesh mesh = read(triangle_with(R"("nodes":[{"mesh":0,"translation":[500000.125,0,-4000000]}])"));
    EXPECT_FALSE(mesh.origin.isZero(0));
    expect_near(mesh.world_position(1), {500001.125, 0, -4000000}, 1e-9);
    expect_near(mesh.world_position(2), {500000.125, 1, -4000000}, 1e-9);
}

TEST(Gltf, TheSceneDecidesWhatIsRead) {
    const std::string nodes = R"("nodes":[{"mesh":0},{"mesh":0,"translation":[0,0,7]}])";
    EXPECT_EQ(read(triangle_with(nodes)).vertex_count(), 6u); // no scenes: all roots
    const Mesh first = read(triangle_with(nodes + R"(,"scenes":[{"nodes":[1]},{"nodes":[0]}])"));
    EXPECT_EQ(first.world_position(0).z(), 7);
    const Mesh second = read(triangle_with(nodes + R"(,"scene":1,"scenes":[{"nodes":[1]},{"nodes":[0]}])"));
    EXPECT_EQ(second.world_position(0).z(), 0);
}

TEST(Gltf, CoarserLevelsOfMsftLodAreNotInTheScene) {
    const Mesh mesh = read(triangle_with(R"("extensionsUsed":["MSFT_lod"],"scenes":[{"nodes":[0]}],
        "nodes":[{"mesh":0,"extensions":{"MSFT_lod":{"ids":[1]}}},{"mesh":0}])"));
    EXPECT_EQ(mesh.vertex_count(), 3u);
}

TEST(Gltf, ObjectsAreNodesByName) {
    const Mesh mesh =
        read(triangle_with(R"("nodes":[{"name":"left","mesh":0},{"mesh":0,"children":[2]},{"name":"left","mesh":0}])"));
    EXPECT_EQ(mesh.objects.names, (std::vector<std::string>{"left", "tri"}));
    EXPECT_EQ(mesh.objects.of_face, (std::vector<Index>{0, 1, 0}));
}

TEST(Gltf, StripsAndFansKeepTheirSide) {
    GltfText file;
    file.add({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 2, 0, 0}, "VEC3");
    file.add_indices({0, 1, 2, 3});
    file.add_indices({0, 1, 2, 2, 3});
    file.add_indices({4, 3, 2, 0});
    const auto mesh_of = [&](const std::string& primitive) {
        return read(
            file.text(kOneNode + R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},)" + primitive + "}]}]"));
    };
    EXPECT_EQ(faces(mesh_of(R"("mode":5,"indices":1)")), (std::vector<Index>{0, 1, 2, 1, 3, 2}));
    EXPECT_EQ(faces(mesh_of(R"("mode":5,"indices":2)")), (std::vector<Index>{0, 1, 2})); // sewn triangles are none
    EXPECT_EQ(faces(mesh_of(R"("mode":6,"indices":3)")), (std::vector<Index>{3, 2, 4, 2, 0, 4}));
    EXPECT_EQ(faces(mesh_of(R"("mode":5)")), (std::vector<Index>{0, 1, 2, 1, 3, 2, 2, 3, 4}));
}

TEST(Gltf, PointsAndLinesAreLeftOutBesideTrianglesAndPointsAreReadAlone) {
    GltfText file;
    file.add(kTriangle, "VEC3");
    const auto bytes = [&](const std::string& primitives) {
        return file.text(kOneNode + R"("meshes":[{"primitives":[)" + primitives + "]}]");
    };
    const std::string points = R"({"mode":0,"attributes":{"POSITION":0}})",
                      lines = R"({"mode":1,"attributes":{"POSITION":0}})",
                      triangles = R"({"attributes":{"POSITION":0}})";
    const std::vector<std::string> warnings = warnings_of(bytes(points + "," + triangles + "," + lines));
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_EQ(warnings[0], "2 primitives of points or lines were left out.");
    const Result<MeshFile> cloud = read_mesh(bytes(points), "a.gltf", RunContext(1));
    ASSERT_TRUE(cloud.ok());
    EXPECT_EQ(cloud->mesh.vertex_count(), 3u);
    EXPECT_EQ(cloud->mesh.face_count(), 0u);
    EXPECT_EQ(cloud->warnings, (std::vector<std::string>{"There are no faces: read as 3 points."}));
}

TEST(Gltf, PrimitivesOfOneNodeShareVerticesWhereAttributesAreTheSame) {
    GltfText file;
    file.add({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0}, "VEC3");
    file.add_indices({0, 1, 2});
    file.add_indices({1, 3, 2});
    file.add({5, 5, 5, 6, 5, 5, 5, 6, 5}, "VEC3");
    const Mesh mesh = read(file.text(kOneNode + R"("materials":[{"name":"red"},{}],"meshes":[{"primitives":[
        {"attributes":{"POSITION":0},"indices":1,"material":1},
        {"attributes":{"POSITION":3}},
        {"attributes":{"POSITION":0},"indices":2,"material":0}]}])"));
    EXPECT_EQ(mesh.vertex_count(), 7u);
    EXPECT_EQ(faces(mesh), (std::vector<Index>{0, 1, 2, 4, 5, 6, 1, 3, 2}));
    EXPECT_EQ(mesh.materials.names, (std::vector<std::string>{"red", "material_1"}));
    EXPECT_EQ(mesh.materials.of_face, (std::vector<Index>{1, kNoIndex, 0}));
}

TEST(Gltf, SparseAccessors) {
    GltfText file;
    const std::size_t base = file.add_view<float>(kTriangle), which = file.add_view<std::uint8_t>({1, 2}),
                      values = file.add_view<float>({9, 8, 7, 6, 5, 4});
    const std::string sparse = R"("sparse":{"count":2,"indices":{"bufferView":)" + std::to_string(which) +
                               R"(,"componentType":5121},"values":{"bufferView":)" + std::to_string(values) + "}}";
    file.add_accessor("\"bufferView\":" + std::to_string(base) + ",", 5126, 3, "VEC3", sparse);
    file.add_accessor("", 5126, 3, "VEC3", sparse);
    for (const std::string position : {"0", "1"}) {
        const Mesh mesh =
            read(file.text(kOneNode + R"("meshes":[{"primitives":[{"attributes":{"POSITION":)" + position + "}}]}]"));
        EXPECT_TRUE(mesh.positions[0] == Vec3f(0, 0, 0));
        EXPECT_TRUE(mesh.positions[1] == Vec3f(9, 8, 7));
        EXPECT_TRUE(mesh.positions[2] == Vec3f(6, 5, 4));
    }
}

TEST(Gltf, SmallIntegersAndStrides) {
    GltfText file;
    // int16 positions that are normalized, with a stride of 8: the fourth number is padding
    const std::size_t view =
        file.add_view<std::int16_t>({32767, 0, -32767, 99, -32768, 16384, 0, 99, 0, 0, 0, 99}, "\"byteStride\":8");
    file.add_accessor("\"bufferView\":" + std::to_string(view) + ",", 5122, 3, "VEC3", "\"normalized\":true");
    file.add<std::int8_t>({127, 0, 0, 0, -128, 0, 0, 0, 127}, 5120, "VEC3", "\"normalized\":true");
    file.add<std::uint16_t>({0, 65535, 65535, 0, 0, 0}, 5123, "VEC2", "\"normalized\":true");
    const Mesh mesh = read(
        file.text(R"("extensionsRequired":["KHR_mesh_quantization"],"extensionsUsed":["KHR_mesh_quantization"],)" +
                  kOneNode + R"("meshes":[{"primitives":[{"attributes":{"POSITION":0,"NORMAL":1,"TEXCOORD_0":2}}]}])"));
    EXPECT_TRUE(mesh.positions[0] == Vec3f(1, 0, -1));
    EXPECT_TRUE(mesh.positions[1] == Vec3f(-1, 16384.0f / 32767, 0));
    EXPECT_TRUE(mesh.normals.values[1] == Vec3f(0, -1, 0));
    EXPECT_TRUE(mesh.uvs.values[0] == Vec2f(0, 0)); // v is turned up
    EXPECT_TRUE(mesh.uvs.values[1] == Vec2f(1, 1));
}

TEST(Gltf, ColorsBecomeSrgbAndNumbersScalars) {
    GltfText file;
    file.add(kTriangle, "VEC3");
    file.add<std::uint8_t>({255, 0, 0, 51, 0, 255, 0, 102, 55, 55, 55, 255}, 5121, "VEC4", "\"normalized\":true");
    file.add({0.5f, 1, 2}, "SCALAR");
    file.add({0, 0, 1, 1, 0, 0}, "VEC2");
    const std::string bytes = file.text(
        kOneNode +
        R"("meshes":[{"primitives":[{"attributes":{"POSITION":0,"COLOR_0":1,"_confidence":2,"TEXCOORD_1":3}}]}])");
    const Result<MeshFile> read = read_mesh(bytes, "a.gltf", RunContext(1));
    ASSERT_TRUE(read.ok());
    EXPECT_EQ(read->warnings, (std::vector<std::string>{"Attributes that are not read were left out: 'TEXCOORD_1'."}));
    EXPECT_TRUE(read->mesh.colors_have_alpha);
    EXPECT_NEAR(read->mesh.colors[0].w(), 0.2, 1e-6);
    EXPECT_EQ(read->mesh.colors[1].y(), 1);
    EXPECT_NEAR(read->mesh.colors[2].x(), 1.055 * std::pow(55.0 / 255, 1 / 2.4) - 0.055, 1e-6);
    ASSERT_EQ(read->mesh.scalars.size(), 1u);
    EXPECT_EQ(read->mesh.scalars[0].name, "confidence");
    EXPECT_EQ(read->mesh.scalars[0].values, (std::vector<float>{0.5f, 1, 2}));
}

TEST(Gltf, BlocksWithoutAnAttributeGetNone) {
    GltfText file;
    file.add(kTriangle, "VEC3");
    file.add({0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3");
    const Mesh mesh = read(file.text(R"("nodes":[{"mesh":0},{"mesh":1}],"meshes":[
        {"name":"a","primitives":[{"attributes":{"POSITION":0}}]},{"name":"b","primitives":[{"attributes":{"POSITION":0,"NORMAL":1}}]}])"));
    EXPECT_EQ(mesh.normals.corners, (std::vector<Index>{kNoIndex, kNoIndex, kNoIndex, 0, 1, 2}));
}

TEST(Gltf, Materials) {
    GltfText file;
    file.add(kTriangle, "VEC3");
    file.add({0, 0, 1, 0, 0, 1}, "VEC2");
    const std::string png = "\x89PNG\r\n\x1a\nwhatever";
    const std::size_t view = file.add_view(std::vector<char>(png.begin(), png.end()));
    const Mesh mesh =
        read(file.text(kOneNode + R"("images":[{"mimeType":"image/png","bufferView":)" + std::to_string(view) + R"(}],
        "textures":[{"source":0}],"materials":[{"name":"glass","alphaMode":"BLEND","doubleSided":true,"pbrMetallicRoughness":
        {"baseColorFactor":[0.21404114,1,0,0.25],"metallicFactor":0.5,"roughnessFactor":0.125,"baseColorTexture":{"index":0}}},{"name":"plain"}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":1},"material":0}]}])"));
    ASSERT_EQ(mesh.embedded_materials.size(), 2u);
    const MeshMaterial& glass = mesh.embedded_materials[0];
    EXPECT_EQ(glass.name, "glass");
    EXPECT_NEAR(glass.color.x(), 0.5, 1e-6);
    EXPECT_EQ(glass.color.y(), 1);
    EXPECT_EQ(glass.opacity, 0.25f);
    EXPECT_EQ(glass.metallic, 0.5f);
    EXPECT_EQ(glass.roughness, 0.125f);
    EXPECT_TRUE(glass.double_sided);
    ASSERT_TRUE(glass.picture_bytes);
    EXPECT_TRUE(*glass.picture_bytes == png);
    EXPECT_FALSE(mesh.embedded_materials[1].double_sided);
    EXPECT_EQ(mesh.embedded_materials[1].metallic, 1); // glTF's default
}

TEST(Gltf, APictureThatCannotBeHadIsAWarning) {
    GltfText file;
    file.add(kTriangle, "VEC3");
    for (const std::string uri : {"missing.png", "/etc/hostname", "../a.png", "data:image/png;base64,AAAA"}) {
        const std::vector<std::string> warnings =
            warnings_of(file.text(kOneNode + R"("images":[{"uri":")" + uri + R"("}],"textures":[{"source":0}],
            "materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}])"));
        ASSERT_EQ(warnings.size(), 1u) << uri;
        EXPECT_TRUE(warnings[0].starts_with("images[0]")) << warnings[0];
        EXPECT_TRUE(warnings[0].ends_with("The picture was left out.")) << warnings[0];
    }
}

TEST(Gltf, OurOwnFilesGiveTheMeshBack) {
    const Mesh mesh = make_corner_attribute_mesh();
    std::string bytes;
    ASSERT_TRUE(write_mesh(mesh, MeshFormat::gltf, bytes, {}, RunContext()).ok());
    const Mesh back = read(bytes);
    ASSERT_EQ(back.vertex_count(), mesh.vertex_count());
    EXPECT_EQ(std::memcmp(back.positions.data(), mesh.positions.data(), 12 * mesh.vertex_count()), 0);
    EXPECT_EQ(back.face_count(), 7u); // polygons were cut
    EXPECT_FALSE(back.uvs.per_vertex());
    EXPECT_EQ(back.materials.names, mesh.materials.names);
    EXPECT_EQ(std::count(back.materials.of_face.begin(), back.materials.of_face.end(), kNoIndex), 3); // the pentagon
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
        EXPECT_TRUE(back.colors[v].isApprox(mesh.colors[v], 1e-5f)) << v;
}

TEST(Gltf, WhatAFileSaysOfRepeatedVerticesIsChecked) {
    GltfText file;
    file.add({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 0, 0}, "VEC3");
    file.add_indices({0, 3, 2});
    const std::string mesh =
        R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}],"extras":{"filigree":{"vertices":3,"repeats":2}}}])";
    const auto bytes = [&](std::uint32_t repeats) {
        GltfText copy = file;
        copy.add<std::uint32_t>({repeats}, 5125, "SCALAR");
        return copy.text(kOneNode + mesh);
    };
    const Mesh right = read(bytes(1));
    EXPECT_EQ(right.vertex_count(), 3u);
    EXPECT_EQ(faces(right), (std::vector<Index>{0, 1, 2}));
    for (const std::uint32_t wrong : {0u, 2u, 3u, 4000000000u}) {
        const std::vector<std::string> warnings = warnings_of(bytes(wrong));
        ASSERT_EQ(warnings.size(), 1u) << wrong;
        EXPECT_TRUE(warnings[0].ends_with("Vertices at seams stay apart.")) << warnings[0];
    }
}

TEST(Gltf, TheExportReportIsHandedOut) {
    GltfText file;
    file.add(kTriangle, "VEC3");
    std::string bytes = file.text(kOneNode + R"("meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}])");
    const std::string version = R"("version":"2.0")";
    bytes.insert(bytes.find(version), R"("extras":{"filigree":{"error":0.5}},)");
    const Result<GltfScene> scene = GltfScene::read(bytes, "a.gltf", RunContext(1));
    ASSERT_TRUE(scene.ok());
    EXPECT_EQ(scene->export_report(), R"({"error":0.5})");
}

} // namespace gltf_test
