#include "filigree/file.h"
#include "filigree/mesh.h"

#include <gtest/gtest.h>

namespace ply_test {

using namespace filigree;

namespace {

Result<MeshFile> read(const std::string& text) { return read_mesh(text, "cow.ply", RunContext(1)); }

const std::string kVertices = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
const std::string kFaces = "element face 1\nproperty list uchar int vertex_indices\n";

std::string ascii(const std::string& elements, const std::string& body) {
    return "ply\nformat ascii 1.0\n" + elements + "end_header\n" + body;
}

} // namespace

TEST(Ply, WhatFollowsTheLastElementIsToldOf) {
    const std::string body = "0 0 0 1 0 0 0 1 0\n3 0 1 2\n";
    EXPECT_TRUE(read(ascii(kVertices + kFaces, body + " \n"))->warnings.empty());
    const auto file = read(ascii(kVertices + kFaces, body + "3 0 2 1\n"));
    EXPECT_EQ(file->mesh.face_count(), 1u);
    ASSERT_EQ(file->warnings.size(), 1u);
    EXPECT_EQ(file->warnings[0], "8 bytes after the last element were left out.");
}

TEST(Ply, ElementsComeInAnyOrderAmongOthers) {
    const auto file = read(ascii("element edge 1\nproperty int a\nproperty list uchar int b\n" + kFaces + kVertices,
                                 "7 2 8 9\n3 0 1 2\n0 0 0 1 0 0 0 1 0"));
    EXPECT_EQ(file->mesh.corners, (std::vector<Index>{0, 1, 2}));
    EXPECT_EQ(file->mesh.positions[2], Vec3f(0, 1, 0));
    ASSERT_EQ(file->warnings.size(), 1u);
    EXPECT_NE(file->warnings[0].find("'edge'"), std::string::npos);
}

TEST(Ply, PropertiesComeInAnyOrder) {
    const auto file = read(ascii(
        "element vertex 3\nproperty uchar blue\nproperty double z\nproperty float quality\n"
        "property list uchar int near\nproperty float y\nproperty uchar red\nproperty uchar green\nproperty short x\n" +
            kFaces,
        "51 3 0.5 2 7 7 2 0 255 1\n0 0 1 0 0 0 0 9\n0 0 2 0 8 0 0 0\n3 0 1 2\n"));
    EXPECT_EQ(file->mesh.positions[0], Vec3f(1, 2, 3));
    EXPECT_EQ(file->mesh.colors[0], Vec4f(0, 1, 0.2f, 1));
    ASSERT_EQ(file->mesh.scalars.size(), 1u);
    EXPECT_EQ(file->mesh.scalars[0].values, (std::vector<float>{0.5f, 1, 2}));
    EXPECT_EQ(file->warnings.size(), 1u); // the list
}

TEST(Ply, DoublesFarAwayKeepTheirDigitsBesideAStrayVertex) {
    const auto file = read(ascii("element vertex 4\nproperty double x\nproperty double y\nproperty double z\n" + kFaces,
                                 "5e5 4e6 0.001 500000.002 4e6 0 5e5 4000001.003 0 0 0 0\n3 0 1 2\n"));
    const Mesh& mesh = file->mesh;
    EXPECT_LT((mesh.world_position(0) - Vec3d(5e5, 4e6, 0.001)).norm(), 1e-6);
    EXPECT_LT((mesh.world_position(1) - Vec3d(500000.002, 4e6, 0)).norm(), 1e-6);
    EXPECT_LT((mesh.world_position(2) - Vec3d(5e5, 4000001.003, 0)).norm(), 1e-6);
    EXPECT_LT(mesh.world_position(3).norm(), 1);
}

TEST(Ply, ABinaryBodyMayBeginWithALineFeed) {
    std::string body(36, '\0');
    body[0] = '\n'; // the lowest byte of x
    const std::string tail("\x03\0\0\0\0\x01\0\0\0\x02\0\0\0", 13);
    for (const std::string end : {"\n", "\r\n", "\r"}) {
        std::string text = "ply\nformat binary_little_endian 1.0\n" + kVertices + kFaces + "end_header\n";
        for (std::size_t i = 0; (i = text.find('\n', i)) != std::string::npos; i += end.size()) text.replace(i, 1, end);
        const auto file = read(text + body + tail);
        ASSERT_TRUE(file.ok()) << file.error().message;
        EXPECT_EQ(file->mesh.positions[0].x(), 1.4e-44f);
        EXPECT_TRUE(file->warnings.empty());
    }
}

TEST(Ply, LongFacesNeedLongLengths) {
    Mesh mesh;
    for (Index v = 0; v < 300; ++v)
        mesh.positions.emplace_back(std::cos(0.02f * static_cast<float>(v)), std::sin(0.02f * static_cast<float>(v)),
                                    0.0f);
    std::vector<Index> all(300);
    for (Index v = 0; v < 300; ++v) all[v] = v;
    mesh.add_face(all);
    std::string bytes;
    ASSERT_TRUE(write_mesh(mesh, MeshFormat::ply, bytes, {}, RunContext()).ok());
    EXPECT_EQ(read(bytes)->mesh.corners, all);
}

TEST(Ply, ErrorsNameThePlace) {
    const std::string binary = "ply\nformat binary_little_endian 1.0\n" + kVertices + kFaces + "end_header\n";
    std::string bad_index = binary + std::string(36, '\0') + std::string("\x03\0\0\0\0\x01\0\0\0\x03\0\0\0", 13);
    std::string not_finite = binary + std::string(36, '\0') + std::string(13, '\0');
    not_finite.replace(binary.size() + 12, 4, std::string("\0\0\xc0\x7f", 4));
    const std::vector<std::pair<std::string, std::string>> cases = {
        {"plyx\n", "cow.ply:1:"},
        {"ply\nformat ascii 1.0\nelement vertex 3\n", "end_header"},
        {"ply\nformat ebcdic 1.0\nend_header\n", "cow.ply:2:"},
        {ascii("element vertex -3\n", ""), "cow.ply:3:"},
        {ascii("element vertex 3\nproperty quaternion x\n", ""), "cow.ply:4:"},
        {ascii("element vertex 3\nproperty float x\nproperty float x\n", ""), "twice"},
        {ascii("element vertex 1\nproperty float x\nproperty float y\n", "0 0\n"), "x, y and z"},
        {ascii(kVertices + kFaces, "0 0 0 1 0 0 0 1\n"), "cut off"},
        {ascii(kVertices + kFaces, "0 0 0\n1 0 0\n0 1 q\n3 0 1 2"), "cow.ply:12: vertex 2"},
        {ascii(kVertices + kFaces, "0 0 0\n1 0 0\n0 1 0\n3 0 1 3"), "cow.ply:13: face 0"},
        {ascii(kVertices + kFaces, "0 0 0\n1 0 0\n0 1 0\n3 0 1 -1"), "vertex -1"},
        {ascii(kVertices + kFaces, "0 0 0\n1 0 0\n0 1 0\n3 0 1 0.5"), "whole"},
        {ascii(kVertices + kFaces, "0 0 0\n1 0 0\n0 1 inf\n3 0 1 2"), "finite"},
        {ascii("element vertex 9223372036854775807\nproperty float x\nproperty float y\nproperty float z\n", "0 0 0"),
         "vert"},
        {binary + std::string(30, '\0'), "vertex 2 at byte"},
        {binary + std::string(36, '\0') + "\x03\0", "face 0 at byte"},
        {bad_index, "face 0 at byte"},
        {not_finite, "vertex 1"},
    };
    for (const auto& [text, part] : cases) {
        const auto file = read(text);
        ASSERT_FALSE(file.ok()) << text;
        EXPECT_NE(file.error().message.find(part), std::string::npos) << file.error().message << " for " << part;
    }
}

TEST(Ply, AlphaWithoutAColourIsAScalar) {
    const auto file = read(ascii(kVertices + "property float alpha\n" + kFaces, "0 0 0 .5 1 0 0 1 0 1 0 2 3 0 1 2\n"));
    EXPECT_TRUE(file->mesh.colors.empty());
    ASSERT_EQ(file->mesh.scalars.size(), 1u);
    EXPECT_EQ(file->mesh.scalars[0].values, (std::vector<float>{0.5f, 1, 2}));
}

TEST(Ply, TexcoordBesideUvsOfVerticesIsLeftOutWithAWarning) {
    const auto file =
        read(ascii(kVertices + "property float s\nproperty float t\n" + kFaces + "property list uchar float texcoord\n",
                   "0 0 0 0 0 1 0 0 1 0 0 1 0 0 1 3 0 1 2 6 9 9 9 9 9 9\n"));
    EXPECT_TRUE(file->mesh.uvs.per_vertex());
    EXPECT_EQ(file->mesh.uvs.values[1], Vec2f(1, 0));
    ASSERT_EQ(file->warnings.size(), 1u);
    EXPECT_NE(file->warnings[0].find("texcoord"), std::string::npos);
}

TEST(Ply, ScalarsWhoseNamesAreTakenGetOthers) {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.add_face(Triangle{0, 1, 2});
    mesh.scalars = {{"x", {1, 2, 3}}, {"a b", {4, 5, 6}}, {"a_b", {7, 8, 9}}};
    std::string bytes;
    const auto warnings = write_mesh(mesh, MeshFormat::ply, bytes, {}, RunContext());
    ASSERT_EQ(warnings->size(), 1u);
    EXPECT_NE((*warnings)[0].find("'x' of a scalar (now 'x_2')"), std::string::npos) << (*warnings)[0];
    const auto back = read(bytes);
    ASSERT_TRUE(back.ok()) << back.error().message;
    EXPECT_EQ(back->mesh.positions, mesh.positions);
    std::vector<std::string> names;
    for (const VertexScalar& scalar : back->mesh.scalars) names.push_back(scalar.name);
    EXPECT_EQ(names, (std::vector<std::string>{"x_2", "a_b", "a_b_2"}));
}

TEST(Ply, TriangleStripsAreRead) {
    const std::string vertices = "element vertex 5\nproperty float x\nproperty float y\nproperty float z\n";
    const std::string body = "0 0 0 1 0 0 0 1 0 1 1 0 0 2 0\n";
    for (const char* type : {"int int", "uint uchar", "uchar short"}) {
        const std::string strips = "element tristrips 1\nproperty list " + std::string(type) + " vertex_indices\n";
        if (std::string(type) == "uint uchar") { // no -1 in it
            const auto file = read(ascii(vertices + strips, body + "4 0 1 2 3\n"));
            EXPECT_EQ(file->mesh.corners, (std::vector<Index>{0, 1, 2, 1, 3, 2}));
            continue;
        }
        const auto file = read(ascii(vertices + strips, body + "11 0 1 2 3 -1 2 3 4 4 -1 0\n"));
        ASSERT_TRUE(file.ok()) << file.error().message;
        // every second one is turned over; the one with a repeated vertex is none
        EXPECT_EQ(file->mesh.corners, (std::vector<Index>{0, 1, 2, 1, 3, 2, 2, 3, 4}));
        EXPECT_EQ(file->mesh.face_count(), 3u);
        EXPECT_TRUE(file->warnings.empty());
        EXPECT_EQ(check_mesh(file->mesh), "");
        const auto out = read(ascii(vertices + strips, body + "4 0 1 2 5\n"));
        ASSERT_FALSE(out.ok());
        EXPECT_NE(out.error().message.find("tristrips 0"), std::string::npos) << out.error().message;
        EXPECT_NE(out.error().message.find("vertex 5"), std::string::npos) << out.error().message;
    }
    // beside faces they are the same faces again
    const std::string both = vertices + kFaces + "element tristrips 1\nproperty list int int vertex_indices\n";
    const auto faces = read(ascii(both, body + "3 0 1 2\n4 0 1 2 3\n"));
    EXPECT_EQ(faces->mesh.face_count(), 1u);
    EXPECT_EQ(faces->warnings.size(), 1u);
}

TEST(Ply, BinaryTriangleStripsAreRead) {
    std::string text = "ply\nformat binary_big_endian 1.0\n" + kVertices +
                       "element tristrips 1\nproperty list int int vertex_indices\nend_header\n";
    text += std::string(36, '\0') + std::string("\0\0\0\x04\0\0\0\0\0\0\0\x01\0\0\0\x02\xff\xff\xff\xff", 20);
    const auto file = read(text);
    ASSERT_TRUE(file.ok()) << file.error().message;
    EXPECT_EQ(file->mesh.corners, (std::vector<Index>{0, 1, 2}));
}

TEST(Ply, AZeroByteInANameDoesNotReachOtherFiles) {
    std::string vertices = kVertices + "property float a_b\n";
    vertices.replace(vertices.size() - 3, 1, 1, '\0');
    const auto file = read(ascii(vertices + kFaces, "0 0 0 1 1 0 0 2 0 1 0 3 3 0 1 2\n"));
    ASSERT_TRUE(file.ok()) << file.error().message;
    ASSERT_EQ(file->mesh.scalars.size(), 1u);
    EXPECT_EQ(file->mesh.scalars[0].name, "a_b");
    ASSERT_EQ(file->warnings.size(), 1u);
    EXPECT_NE(file->warnings[0].find("zero byte"), std::string::npos);
}

TEST(Ply, ColoursHaveManyNames) {
    const auto colored = [](const std::vector<std::string>& names, const std::string& type,
                            const std::string& numbers) {
        std::string properties = kVertices;
        for (const std::string& name : names) properties += "property " + type + " " + name + "\n";
        return read(ascii(properties + kFaces,
                          "0 0 0 " + numbers + "\n1 0 0 " + numbers + "\n0 1 0 " + numbers + "\n3 0 1 2\n"));
    };
    const std::vector<std::vector<std::string>> names = {{"r", "g", "b"},
                                                         {"R", "G", "B"},
                                                         {"Red", "Green", "Blue"},
                                                         {"diffuse_red", "diffuse_green", "diffuse_blue"},
                                                         {"diffuse_r", "diffuse_g", "diffuse_b"},
                                                         {"DIFFUSE_RED", "DIFFUSE_GREEN", "DIFFUSE_BLUE"}};
    for (const auto& name : names) {
        SCOPED_TRACE(name[0]);
        for (const std::string type : {"uchar", "short", "ushort", "int", "uint", "float", "double"}) {
            const auto file = colored(name, type, "255 0 51");
            ASSERT_TRUE(file.ok()) << file.error().message;
            ASSERT_EQ(file->mesh.colors.size(), 3u) << type;
            EXPECT_EQ(file->mesh.colors[1], Vec4f(1, 0, 0.2f, 1)) << type;
            EXPECT_TRUE(file->mesh.scalars.empty()) << type;
        }
        EXPECT_EQ(colored(name, "double", "1 0 0.5")->mesh.colors[0], Vec4f(1, 0, 0.5f, 1));
        EXPECT_EQ(colored(name, "ushort", "65535 0 13107")->mesh.colors[0], Vec4f(1, 0, 0.2f, 1));
    }
    const auto four = colored({"diffuse_red", "diffuse_green", "diffuse_blue", "Alpha"}, "uchar", "255 0 51 102");
    EXPECT_TRUE(four->mesh.colors_have_alpha);
    EXPECT_EQ(four->mesh.colors[0], Vec4f(1, 0, 0.2f, 0.4f));
    EXPECT_TRUE(colored({"r", "g", "b", "a"}, "float", "1 0 1 0.5")->mesh.colors_have_alpha);
}

TEST(Ply, OpacityFromNoughtToOneBesideColoursTo255) {
    const auto file = read(ascii(kVertices +
                                     "property float red\nproperty float green\nproperty float blue\n"
                                     "property float alpha\n" +
                                     kFaces,
                                 "0 0 0 255 0 51 1\n1 0 0 255 0 51 0.5\n0 1 0 0 0 0 1\n3 0 1 2\n"));
    EXPECT_EQ(file->mesh.colors[1], Vec4f(1, 0, 0.2f, 0.5f));
}

TEST(Ply, NumbersThatAreNoColourStayScalars) {
    const auto scalars = [](const std::string& properties, const std::string& numbers) {
        const auto file = read(ascii(kVertices + properties + kFaces,
                                     "0 0 0 " + numbers + "\n1 0 0 " + numbers + "\n0 1 0 " + numbers + "\n3 0 1 2\n"));
        EXPECT_TRUE(file->mesh.colors.empty());
        return file->mesh.scalars.size();
    };
    EXPECT_EQ(scalars("property float r\nproperty float g\n", "1 1"), 2u);
    EXPECT_EQ(scalars("property float r\nproperty float g\nproperty float b\n", "1 -1 0"), 3u);
    EXPECT_EQ(scalars("property float r\nproperty float g\nproperty float b\n", "1 2 1000"), 3u);
    EXPECT_EQ(scalars("property float r\nproperty uchar g\nproperty float b\n", "1 1 1"), 3u);
    EXPECT_EQ(scalars("property uchar alpha\n", "1"), 1u);
}

TEST(Ply, ScalarsWithNamesOfColoursComeBackAsScalars) {
    for (const bool has_colors : {false, true}) {
        Mesh mesh = make_box(Vec3d::Zero(), Vec3d::Ones());
        const std::size_t count = mesh.vertex_count();
        for (const char* name : {"Red", "green", "BLUE", "r", "g", "b", "a", "alpha"})
            mesh.scalars.push_back({name, std::vector<float>(count, 0.25f)});
        if (has_colors) mesh.colors.assign(count, Vec4f(1, 0, 0, 1));
        std::string bytes;
        const auto lost = write_mesh(mesh, MeshFormat::ply, bytes, {}, RunContext());
        ASSERT_TRUE(lost.ok());
        EXPECT_FALSE(lost->empty());
        const auto file = read(bytes);
        ASSERT_TRUE(file.ok()) << file.error().message;
        EXPECT_EQ(file->mesh.scalars.size(), 8u);
        EXPECT_EQ(file->mesh.colors.empty(), !has_colors);
        EXPECT_FALSE(file->mesh.colors_have_alpha);
    }
}

} // namespace ply_test
