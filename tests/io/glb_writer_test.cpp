// What a GLB of a mesh that stands still holds, looked at with nothing of ours but the JSON parser.
#include "filigree/file.h"
#include "new_folder.h"
#include "sample_meshes.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <cstring>
#include <ctime>
#include <fstream>
#include <numbers>

using namespace filigree;
using filigree_test::make_corner_attribute_mesh;
using filigree_test::make_far_mesh;
using filigree_test::make_plain_mesh;
using filigree_test::make_vertex_attribute_mesh;
using Json = nlohmann::json;
namespace fs = std::filesystem;

namespace {

/// Enough of a PNG to be told by its start.
const std::string kPicture = "\x89PNG\r\n\x1a\n and so on";

/// The two chunks of a GLB.
struct Glb {
    Json json;
    std::string data;

    explicit Glb(const std::string& bytes) {
        const auto word = [&](std::size_t at) {
            std::uint32_t value = 0;
            std::memcpy(&value, bytes.data() + at, 4);
            return value;
        };
        EXPECT_EQ(word(0), 0x46546c67u);
        EXPECT_EQ(word(4), 2u);
        EXPECT_EQ(word(8), bytes.size());
        const std::size_t json_bytes = word(12);
        json = Json::parse(bytes.substr(20, json_bytes));
        EXPECT_EQ(json_bytes % 4, 0u);
        data = bytes.substr(20 + json_bytes + 8);
        EXPECT_EQ(word(20 + json_bytes), data.size());
    }

    template <class T>
    std::vector<T> accessor(std::size_t number) const {
        const Json& accessor = json.at("accessors").at(number);
        const Json& view = json.at("bufferViews").at(accessor.at("bufferView").get<std::size_t>());
        std::vector<T> items(accessor.at("count").get<std::size_t>());
        EXPECT_EQ(view.at("byteLength"), items.size() * sizeof(T));
        std::memcpy(static_cast<void*>(items.data()), data.data() + view.at("byteOffset").get<std::size_t>(),
                    items.size() * sizeof(T));
        return items;
    }
    const Json& primitive(std::size_t mesh = 0, std::size_t number = 0) const {
        return json.at("meshes").at(mesh).at("primitives").at(number);
    }
    template <class T>
    std::vector<T> attribute(const std::string& name, std::size_t mesh = 0) const {
        return accessor<T>(primitive(mesh).at("attributes").at(name).get<std::size_t>());
    }
    std::vector<std::uint16_t> indices(std::size_t mesh = 0, std::size_t number = 0) const {
        return accessor<std::uint16_t>(primitive(mesh, number).at("indices").get<std::size_t>());
    }
};

struct Written {
    Glb glb;
    std::vector<std::string> warnings;
};

Written write(const Mesh& mesh, const WriteMeshOptions& options = {}) {
    std::string bytes;
    const Result<std::vector<std::string>> warnings = write_mesh(mesh, MeshFormat::gltf, bytes, options, RunContext());
    EXPECT_TRUE(warnings.ok());
    return {Glb(bytes), warnings.ok() ? *warnings : std::vector<std::string>()};
}

/// A square of two triangles with a UV a vertex.
Mesh square() {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    mesh.add_face(Triangle{0, 1, 2});
    mesh.add_face(Triangle{0, 2, 3});
    mesh.uvs.values = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    return mesh;
}

MeshMaterial material(const std::string& name, const std::string& picture = "") {
    MeshMaterial result;
    result.name = name;
    if (!picture.empty()) result.picture_bytes = std::make_shared<const std::string>(picture);
    return result;
}

} // namespace

TEST(GlbWriter, OneValueAVertexLeavesVerticesAsTheyAre) {
    const Mesh mesh = make_vertex_attribute_mesh();
    const auto [glb, warnings] = write(mesh);
    EXPECT_EQ(glb.attribute<Vec3f>("POSITION"), mesh.positions);
    EXPECT_EQ(glb.attribute<float>("_quality"), mesh.scalars[0].values);
    EXPECT_EQ(glb.attribute<float>("_f00"), mesh.scalars[1].values);
    const std::vector<Vec2f> uvs = glb.attribute<Vec2f>("TEXCOORD_0");
    const std::vector<Vec3f> normals = glb.attribute<Vec3f>("NORMAL");
    const std::vector<Vec4f> colors = glb.attribute<Vec4f>("COLOR_0");
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
        EXPECT_EQ(uvs[v], Vec2f(mesh.uvs.values[v].x(), 1 - mesh.uvs.values[v].y()));
        EXPECT_LT((normals[v] - mesh.normals.values[v].normalized()).norm(), 1e-6f);
        EXPECT_EQ(colors[v][3], mesh.colors[v][3]);
        EXPECT_NEAR(colors[v][0], mesh.colors[v][0] / 12.92f, 1e-7f); // all below 8/255
        EXPECT_EQ(colors[v][1], 1.0f);
    }
    EXPECT_FALSE(glb.json["meshes"][0].contains("extras")); // nothing to be undone
    EXPECT_EQ(glb.indices().size(), 3 * (1 + 2 + 3 + 1));
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_EQ(warnings[0],
              "GLB cannot hold faces of more than three corners; cut into triangles. PLY and OBJ keep them.");
}

TEST(GlbWriter, CornersThatDifferGetCopiesBehindTheMeshsVertices) {
    const Mesh mesh = make_corner_attribute_mesh();
    const auto [glb, warnings] = write(mesh);
    const Json& extras = glb.json["meshes"][0]["extras"]["filigree"];
    EXPECT_EQ(extras["vertices"], mesh.vertex_count());
    const std::vector<Index> repeats = glb.accessor<Index>(extras["repeats"]);
    const std::vector<Vec3f> positions = glb.attribute<Vec3f>("POSITION");
    ASSERT_EQ(positions.size(), mesh.vertex_count() + repeats.size());
    EXPECT_TRUE(std::equal(mesh.positions.begin(), mesh.positions.end(), positions.begin()));
    const std::vector<Vec2f> uvs = glb.attribute<Vec2f>("TEXCOORD_0");
    const std::vector<Vec3f> normals = glb.attribute<Vec3f>("NORMAL");
    for (const Vec3f& normal : normals) EXPECT_NEAR(normal.norm(), 1, 1e-6);
    for (std::size_t i = 0; i < repeats.size(); ++i) {
        ASSERT_LT(repeats[i], mesh.vertex_count());
        const std::size_t v = mesh.vertex_count() + i;
        EXPECT_EQ(positions[v], mesh.positions[repeats[i]]);
        for (std::size_t other = 0; other < v; ++other) // no copy without need
            EXPECT_FALSE(positions[other] == positions[v] && uvs[other] == uvs[v] && normals[other] == normals[v]);
    }
    // Face 0 is a triangle of wood, with face 1: corners 0, 1 and 2.
    ASSERT_EQ(glb.json["meshes"][0]["primitives"].size(), 3u); // stone, wood, none
    const std::vector<std::uint16_t> wood = glb.indices(0, 1);
    for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_EQ(positions[wood[c]], mesh.positions[mesh.corners[c]]);
        EXPECT_EQ(uvs[wood[c]].y(), 1 - mesh.uvs.values[mesh.uvs.corners[c]].y());
        EXPECT_EQ(normals[wood[c]], mesh.normals.values[mesh.normals.corners[c]]);
    }
    const Json& none = glb.json["materials"][glb.primitive(0, 2)["material"].get<std::size_t>()];
    EXPECT_EQ(none["extras"]["filigree"], "none");
    EXPECT_EQ(none["pbrMetallicRoughness"]["metallicFactor"], 0.0);
    ASSERT_EQ(warnings.size(), 2u);
    EXPECT_NE(warnings[0].find("hold groups; left out."), std::string::npos) << warnings[0]; // smoothing is in normals
    EXPECT_NE(warnings[1].find("materials became grey"), std::string::npos);
}

TEST(GlbWriter, PlacesFarFromZeroAreANodesTranslation) {
    const Mesh mesh = make_far_mesh();
    const Glb glb = write(mesh).glb;
    EXPECT_EQ(glb.attribute<Vec3f>("POSITION"), mesh.positions);
    const Json& node = glb.json["nodes"][0];
    EXPECT_EQ(node["translation"], Json({500000.0, -4500000.0, 0.0}));
    EXPECT_EQ(glb.json["scenes"][0]["nodes"], Json::array({0}));
    EXPECT_FALSE(write(square()).glb.json["nodes"][0].contains("translation"));
}

TEST(GlbWriter, ObjectsAreNodesOverTheSameVertices) {
    Mesh mesh = square();
    mesh.objects = {{"a", "unused", "b"}, {2, 0}};
    const Glb glb = write(mesh).glb;
    ASSERT_EQ(glb.json["nodes"].size(), 2u);
    EXPECT_EQ(glb.json["nodes"][0]["name"], "a");
    EXPECT_EQ(glb.json["nodes"][1]["name"], "b");
    EXPECT_EQ(glb.primitive(0)["attributes"], glb.primitive(1)["attributes"]);
    EXPECT_EQ(glb.indices(0), (std::vector<std::uint16_t>{0, 2, 3}));
    EXPECT_EQ(glb.indices(1), (std::vector<std::uint16_t>{0, 1, 2}));
    for (const Json& part : glb.json["meshes"]) EXPECT_EQ(part["extras"]["filigree"]["vertices"], 4);
}

TEST(GlbWriter, EmbeddedMaterialsKeepTheirNumbersAndPictures) {
    Mesh mesh = square();
    mesh.materials = {{"paint", "wood", "oak"}, {1, 0}};
    mesh.embedded_materials = {material("paint"), material("wood", kPicture), material("oak")};
    mesh.embedded_materials[2].picture_bytes = mesh.embedded_materials[1].picture_bytes;
    mesh.embedded_materials[0].color = {1, 0.5f, 0};
    mesh.embedded_materials[0].opacity = 0.25f;
    mesh.embedded_materials[0].metallic = 0.5f;
    mesh.embedded_materials[0].double_sided = false;
    const auto [glb, warnings] = write(mesh);
    EXPECT_TRUE(warnings.empty()) << testing::PrintToString(warnings);
    ASSERT_EQ(glb.json["materials"].size(), 3u);
    const Json& paint = glb.json["materials"][0];
    EXPECT_EQ(paint["name"], "paint");
    EXPECT_EQ(paint["alphaMode"], "BLEND");
    EXPECT_FALSE(paint.contains("doubleSided"));
    const Json& surface = paint["pbrMetallicRoughness"];
    EXPECT_EQ(surface["metallicFactor"], 0.5);
    EXPECT_EQ(surface["roughnessFactor"], 1.0);
    EXPECT_NEAR(surface["baseColorFactor"][1].get<double>(), 0.2140411, 1e-7); // IEC 61966-2-1 of 0.5
    EXPECT_EQ(surface["baseColorFactor"][3], 0.25);
    ASSERT_EQ(glb.json["images"].size(), 1u); // shared
    EXPECT_EQ(glb.json["images"][0]["mimeType"], "image/png");
    const Json& view = glb.json["bufferViews"][glb.json["images"][0]["bufferView"].get<std::size_t>()];
    EXPECT_TRUE(glb.data.substr(view["byteOffset"], view["byteLength"]) == kPicture);
    EXPECT_EQ(glb.json["materials"][1]["pbrMetallicRoughness"]["baseColorTexture"]["index"], 0);
    EXPECT_EQ(glb.json["materials"][2]["pbrMetallicRoughness"]["baseColorTexture"]["index"], 0);
    EXPECT_EQ(glb.primitive(0, 0)["material"], 0);
    EXPECT_EQ(glb.primitive(0, 1)["material"], 1);
}

TEST(GlbWriter, TexturesThatCannotBeKeptAreSaid) {
    Mesh mesh = square();
    mesh.materials = {{"a"}, {0, 0}};
    mesh.embedded_materials = {material("a", "neither PNG nor JPEG")};
    Written written = write(mesh);
    ASSERT_EQ(written.warnings.size(), 1u);
    EXPECT_NE(written.warnings[0].find("neither PNG nor JPEG"), std::string::npos);
    EXPECT_FALSE(written.glb.json.contains("images"));
    mesh.embedded_materials = {material("a", kPicture)};
    mesh.uvs = {};
    written = write(mesh);
    ASSERT_EQ(written.warnings.size(), 1u);
    EXPECT_NE(written.warnings[0].find("no UVs"), std::string::npos);
    EXPECT_FALSE(written.glb.json.contains("textures"));
}

TEST(GlbWriter, PicturesLoseWhatGltfIgnores) {
    const auto chunk = [](const std::string& name, const std::string& content) {
        return std::string(3, '\0') + static_cast<char>(content.size()) + name + content + "sum!";
    };
    const std::string start = "\x89PNG\r\n\x1a\n" + chunk("IHDR", "as it was"), end = chunk("IEND", "");
    const std::string profile = chunk("iCCP", "a profile") + chunk("pHYs", "not square");
    for (const std::string& cut : {std::string(), end}) { // a damaged file stays as it is
        Mesh mesh = square();
        mesh.materials = {{"a"}, {0, 0}};
        mesh.embedded_materials = {material("a", start + profile + cut)};
        const Glb glb = write(mesh).glb;
        const Json& view = glb.json["bufferViews"][glb.json["images"][0]["bufferView"].get<std::size_t>()];
        const std::string kept = glb.data.substr(view["byteOffset"], view["byteLength"]);
        EXPECT_TRUE(kept == (cut.empty() ? start + profile : start + end));
    }
}

TEST(GlbWriter, LibrariesBesideTheMeshAreEmbedded) {
    const fs::path folder = new_folder();
    std::ofstream(folder / "m.mtl") << "newmtl wood\nKd 1 0 0\nd 0.5\nPr 0.25\nPm 1\nmap_Kd wood.png\n";
    std::ofstream(folder / "wood.png", std::ios::binary) << kPicture;
    Mesh mesh = square();
    mesh.materials = {{"wood"}, {0, 0}};
    mesh.material_files = {"m.mtl"};
    const auto [glb, warnings] = write(mesh, {.materials_beside = folder / "mesh.obj"});
    EXPECT_TRUE(warnings.empty()) << testing::PrintToString(warnings);
    const Json& surface = glb.json["materials"][0]["pbrMetallicRoughness"];
    EXPECT_EQ(surface["baseColorFactor"], Json({1.0, 0.0, 0.0, 0.5}));
    EXPECT_EQ(surface["roughnessFactor"], 0.25);
    EXPECT_EQ(surface["metallicFactor"], 1.0);
    EXPECT_EQ(glb.json["images"][0]["name"], "wood.png");
    fs::remove_all(folder);
}

TEST(GlbWriter, NormalsAreMendedAndKeptToTheBitWhereTheyAreUnit) {
    Mesh mesh = square();
    mesh.normals.values = {{0, 0, 0}, {0.577f, 0.577f, 0.577f}, {0, 3e-30f, 0}, {1e30f, 0, 0}};
    const std::vector<Vec3f> normals = write(mesh).glb.attribute<Vec3f>("NORMAL");
    EXPECT_EQ(normals[0], Vec3f(0, 0, 1)); // of the faces
    EXPECT_EQ(normals[1], mesh.normals.values[1]);
    EXPECT_EQ(normals[2], Vec3f(0, 1, 0));
    EXPECT_EQ(normals[3], Vec3f(1, 0, 0));
}

TEST(GlbWriter, OddMeshesAreWritten) {
    Mesh points;
    points.positions = {{1, 2, 3}, {4, 5, 6}};
    points.uvs.values = {{0, 0}, {1, 1}};
    const Glb glb = write(points).glb;
    EXPECT_EQ(glb.primitive()["mode"], 0);
    EXPECT_FALSE(glb.primitive().contains("indices"));
    EXPECT_EQ(glb.attribute<Vec3f>("POSITION"), points.positions);

    Mesh flat = square(); // a face without area stays
    flat.add_face(Triangle{0, 0, 1});
    EXPECT_EQ(write(flat).glb.indices().size(), 9u);

    Mesh names = square();
    names.scalars = {{"", {1, 2, 3, 4}}, {"a", {1, 2, 3, 4}}, {"a", {5, 6, 7, 8}}, {"\xff", {}}, {"\xfe", {}}};
    for (std::size_t i = 3; i < 5; ++i) names.scalars[i].values = {1, 2, 3, 4};
    const Json attributes = write(names).glb.primitive()["attributes"];
    EXPECT_EQ(attributes.size(), 2u + 5u);
    EXPECT_TRUE(attributes.contains("_a") && attributes.contains("_a_2"));
}

TEST(GlbWriter, ManyVerticesHaveWideIndices) {
    Mesh mesh;
    for (int v = 0; v < 65536; ++v) mesh.positions.emplace_back(static_cast<float>(v), 0, 0);
    mesh.add_face(Triangle{0, 1, 65534});
    EXPECT_EQ(write(mesh).glb.indices(), (std::vector<std::uint16_t>{0, 1, 65534}));
    mesh.add_face(Triangle{0, 1, 65535}); // what 16 bits have for "start anew"
    const Glb glb = write(mesh).glb;
    EXPECT_EQ(glb.accessor<Index>(glb.primitive()["indices"].get<std::size_t>()),
              (std::vector<Index>{0, 1, 65534, 0, 1, 65535}));
}

TEST(GlbWriter, TheSameMeshGivesTheSameBytes) {
    std::string first, second;
    ASSERT_TRUE(write_mesh(make_corner_attribute_mesh(), MeshFormat::gltf, first, {}, RunContext()).ok());
    ASSERT_TRUE(write_mesh(make_corner_attribute_mesh(), MeshFormat::gltf, second, {}, RunContext()).ok());
    EXPECT_TRUE(first == second);
}

TEST(GlbWriter, GltfWithFilesBesideItIsNotWritten) {
    const Result<std::vector<std::string>> result = write_mesh(square(), "x.gltf", {}, RunContext(1));
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().code, ErrorCode::unsupported);
    EXPECT_NE(result.error().message.find("write .glb"), std::string::npos);
}

TEST(GlbWriter, LargeFacesAndHubsWithSeamsTakeLinearTime) {
    constexpr Index kCorners = 50'000; // squared, these would take half a minute
    const auto circle = [](Index v) {
        const double angle = 2 * std::numbers::pi * double(v) / kCorners;
        return Vec3f(float(std::cos(angle)), float(std::sin(angle)), 0);
    };
    Mesh polygon, fan;
    std::vector<Index> corners;
    for (Index v = 0; v < kCorners; ++v) {
        polygon.positions.push_back(circle(v)), fan.positions.push_back(circle(v));
        corners.push_back(v);
    }
    polygon.add_face(corners);
    polygon.add_face(Triangle{0, 2, 1}); // other UVs at these: a seam
    fan.positions.emplace_back(0.0f, 0.0f, 1.0f);
    for (Index v = 0; v < kCorners; ++v) fan.add_face(Triangle{v, (v + 1) % kCorners, kCorners});
    for (Mesh* mesh : {&polygon, &fan})
        for (Index c = 0; c < mesh->corner_count(); ++c) { // a UV each
            mesh->uvs.values.emplace_back(float(c) / float(mesh->corner_count()), 0.5f);
            mesh->uvs.corners.push_back(c);
        }
    for (const Mesh* mesh : {&polygon, &fan}) {
        const std::clock_t start = std::clock(); // of the processor, which others may use as well
        std::string bytes;
        ASSERT_TRUE(write_mesh(*mesh, MeshFormat::gltf, bytes, {}, RunContext(1)).ok());
        EXPECT_LT(double(std::clock() - start) / CLOCKS_PER_SEC, 5);
        const Result<MeshFile> back = read_mesh(bytes, "x.glb", RunContext(1));
        ASSERT_TRUE(back.ok());
        EXPECT_EQ(back->mesh.positions, mesh->positions);
        for (std::size_t c = 0; mesh == &fan && c < mesh->corner_count(); ++c)
            ASSERT_NEAR(back->mesh.uvs.values[back->mesh.uvs.corners[c]].x(), mesh->uvs.values[c].x(), 1e-6f);
    }
}

TEST(GlbWriter, ACancelledContextStopsIt) {
    const RunContext context(1);
    context.cancel();
    std::string bytes;
    EXPECT_EQ(write_mesh(square(), MeshFormat::gltf, bytes, {}, context).error().code, ErrorCode::cancelled);
}

TEST(GlbWriter, NamesWithAZeroByteAreReadByEverybody) {
    Mesh mesh = square();
    mesh.scalars = {{std::string("a\0b", 3), {1, 2, 3, 4}}};
    std::string bytes;
    ASSERT_TRUE(write_mesh(mesh, MeshFormat::gltf, bytes, {}, RunContext(1)).ok());
    const Result<MeshFile> back = read_mesh(bytes, "x.glb", RunContext(1));
    ASSERT_TRUE(back.ok()) << back.error().message;
    ASSERT_EQ(back->mesh.scalars.size(), 1u);
    EXPECT_EQ(back->mesh.scalars[0].name, "a_b");
    EXPECT_EQ(back->mesh.scalars[0].values, mesh.scalars[0].values);
}
