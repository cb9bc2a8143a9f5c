#include "filigree/file.h"

#include <gtest/gtest.h>

namespace obj_test {

using namespace filigree;

namespace {

Result<MeshFile> read(const std::string& text) { return read_mesh(text, "cow.obj", RunContext(1)); }

const std::string kTriangleText = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

} // namespace

TEST(Obj, IndicesCountFromOneOrBackwards) {
    const auto file = read(kTriangleText + "f -3 -2 -1\nv 5 5 5\nf 1 2 -1\n");
    EXPECT_EQ(file->mesh.corners, (std::vector<Index>{0, 1, 2, 0, 1, 3}));
}

TEST(Obj, VerticesMayComeAfterTheFaces) {
    EXPECT_EQ(read("f 1 2 3\n" + kTriangleText)->mesh.corners, (std::vector<Index>{0, 1, 2}));
}

TEST(Obj, ValuesInVertexOrderAreOneAVertex) {
    const auto file = read(kTriangleText + "vn 0 0 1\nvn 0 1 0\nvn 1 0 0\nf 1//1 2//2 3//3\n");
    EXPECT_TRUE(file->mesh.normals.per_vertex());
    EXPECT_EQ(file->mesh.normals.values.size(), 3u);
}

TEST(Obj, LabelsLastUntilTheNext) {
    const auto file =
        read(kTriangleText +
             "f 1 2 3\ng a b\nusemtl x\nf 1 2 3\ns 2\nf 1 2 3\ng\nusemtl y\ns off\nf 1 2 3\nusemtl x\nf 1 2 3\n");
    const Mesh& mesh = file->mesh;
    EXPECT_EQ(mesh.groups.names, (std::vector<std::string>{"a b"}));
    EXPECT_EQ(mesh.groups.of_face, (std::vector<Index>{kNoIndex, 0, 0, kNoIndex, kNoIndex}));
    EXPECT_EQ(mesh.materials.of_face, (std::vector<Index>{kNoIndex, 0, 0, 1, 0}));
    EXPECT_EQ(mesh.smoothing, (std::vector<Index>{0, 0, 2, 0, 0}));
    EXPECT_TRUE(mesh.objects.empty());
}

TEST(Obj, ColorsMayBePartialOrBytes) {
    const auto partial = read("v 0 0 0\nv 1 0 0 0.5 0 1\nv 0 1 0\nf 1 2 3\n");
    EXPECT_EQ(partial->mesh.colors[1], Vec4f(0.5f, 0, 1, 1));
    EXPECT_EQ(partial->mesh.colors[2], Vec4f::Ones());
    EXPECT_EQ(partial->warnings.size(), 1u);
    const auto bytes = read("v 0 0 0 255 0 51\nv 1 0 0 0 0 0\nv 0 1 0 1 2 3\nf 1 2 3\n");
    EXPECT_EQ(bytes->mesh.colors[0], Vec4f(1, 0, 0.2f, 1));
}

TEST(Obj, ShortFacesLinesAndPointsAreCounted) {
    const auto file = read(kTriangleText + "f 1 2\nf 1\nf\nl 1 2 3\np 1\nf 1 2 3\ncurv 1 2\n");
    EXPECT_EQ(file->mesh.face_count(), 1u);
    ASSERT_EQ(file->warnings.size(), 3u);
    EXPECT_EQ(file->warnings[0].substr(0, 1), "3");
    EXPECT_EQ(file->warnings[1].substr(0, 1), "2");
}

TEST(Obj, RepeatedCornersStay) { EXPECT_EQ(read(kTriangleText + "f 1 1 1\n")->mesh.face_count(), 1u); }

TEST(Obj, ErrorsNameTheLine) {
    const std::vector<std::pair<std::string, std::string>> cases = {
        {"v 0 0\n", ":1:"},
        {"v 0 0 0 1 1\n", ":1:"},
        {"# c\r\nv 0 0 x\r\n", ":2:"},
        {"v 0,5 0 0\n", "point"},
        {"v nan 0 0\n", "finite"},
        {"v 1e400 0 0\n", "finite"},
        {"v 1e39 0 0\n", "finite"},
        {kTriangleText + "f 1 2 4\nf 1 2 3\n", ":4:"},
        {kTriangleText + "f 1 2 0\n", ":4:"},
        {kTriangleText + "f 1 2 -4\n", ":4:"},
        {kTriangleText + "\n\nf 1 2 18446744073709551617\n", ":6:"},
        {kTriangleText + "f 1 2 3.5\n", ":4:"},
        {kTriangleText + "vt 0 0\nf 1/1 2/1 3/2\n", "UV 2"},
        {kTriangleText + "f 1 \\\n2 \\\n9\n", ":6:"},
        {kTriangleText + "\x01\x02 3\n", ":4:"},
    };
    for (const auto& [text, part] : cases) {
        const auto file = read(text);
        ASSERT_FALSE(file.ok()) << text;
        EXPECT_EQ(file.error().code, ErrorCode::bad_file);
        EXPECT_TRUE(file.error().message.starts_with("cow.obj:")) << file.error().message;
        EXPECT_NE(file.error().message.find(part), std::string::npos) << file.error().message;
    }
}

/// x y z r g b a and x y z w r g b look alike; a weight is 1 in practice, and so are alphas.
TEST(Obj, SevenNumbersAreAColourWithAlphaOrAWeightAndAColour) {
    const auto read = [](const std::string& text) { return read_mesh(text, "a.obj", kOneThread).value(); };
    const MeshFile weights = read("v 0 0 0 1 .1 .2 .3\nv 1 0 0 1 .4 .5 .6\nv 0 1 0 1 1 0 1\nf 1 2 3\n");
    EXPECT_EQ(weights.mesh.colors[1], Vec4f(0.4f, 0.5f, 0.6f, 1));
    EXPECT_FALSE(weights.mesh.colors_have_alpha);
    ASSERT_EQ(weights.warnings.size(), 1u);
    const MeshFile alphas = read("v 0 0 0 1 .1 .2 .3\nv 1 0 0 .5 .4 .5 .6\nv 0 1 0 1 1 0 1\nf 1 2 3\n");
    EXPECT_EQ(alphas.mesh.colors[1], Vec4f(0.5f, 0.4f, 0.5f, 0.6f));
    EXPECT_TRUE(alphas.mesh.colors_have_alpha && alphas.warnings.empty());
    const MeshFile red = read("v 0 0 0 1 0 0 1\nv 1 0 0 1 0 0 1\nv 0 1 0 1 1 0 1\nf 1 2 3\n");
    EXPECT_EQ(red.mesh.colors[2], Vec4f(1, 1, 0, 1));
}

TEST(Obj, WeightsOfVerticesAreLeftOutWithAWarning) {
    const auto file = read("v 0 0 0 1\nv 1 0 0 2\nv 0 1 0 .5\nf 1 2 3\n");
    EXPECT_EQ(file->mesh.positions[1], Vec3f(1, 0, 0));
    ASSERT_EQ(file->warnings.size(), 1u);
    EXPECT_EQ(file->warnings[0].substr(0, 2), "2 ");
}

TEST(Obj, NormalsAndUvsThatTheFileLacksAreLeftOut) {
    for (const std::string face : {"f 1//1 2//2 3//3\n", "f 1//7 2//7 3//7\n", "f -3//-3 -2//-2 -1//-1\n"}) {
        const auto file = read(kTriangleText + face);
        ASSERT_TRUE(file.ok()) << file.error().message;
        EXPECT_TRUE(file->mesh.normals.empty());
        EXPECT_EQ(file->mesh.corners, (std::vector<Index>{0, 1, 2}));
        ASSERT_EQ(file->warnings.size(), 1u);
        EXPECT_EQ(file->warnings[0], "The faces refer to normals, but the file has none; left out.");
    }
    const auto uvs = read(kTriangleText + "vn 0 0 1\nf 1/1/1 2/2/1 3/3/1\n");
    ASSERT_TRUE(uvs.ok());
    EXPECT_TRUE(uvs->mesh.uvs.empty());
    EXPECT_EQ(uvs->mesh.normals.values.size(), 1u);
    ASSERT_EQ(uvs->warnings.size(), 1u);
    EXPECT_EQ(uvs->warnings[0], "The faces refer to UVs, but the file has none; left out.");
    // where it has some, one that is not there is damage
    EXPECT_NE(read(kTriangleText + "vn 0 0 1\nf 1//1 2//2 3//1\n").error().message.find("normal 2"), std::string::npos);
    const auto early = read(kTriangleText + "f 1//-1 2//-1 3//-1\nvn 0 0 1\n");
    ASSERT_FALSE(early.ok());
    EXPECT_NE(early.error().message.find("cow.obj:4: a corner refers to an element before the first"),
              std::string::npos)
        << early.error().message;
}

TEST(Obj, ACtrlZAtTheEndIsLeftOut) {
    for (const std::string end : {"\x1a", "\n\x1a", "\r\n\x1a\r\n", "\n\x1a\x1a\n"}) {
        const auto file = read(kTriangleText + "f 1 2 3" + end);
        ASSERT_TRUE(file.ok()) << file.error().message;
        EXPECT_EQ(file->mesh.face_count(), 1u);
        ASSERT_EQ(file->warnings.size(), 1u);
        EXPECT_NE(file->warnings[0].find("Ctrl-Z"), std::string::npos);
    }
    EXPECT_FALSE(read(kTriangleText + "\x1a\nf 1 2 3\n").ok()); // in the middle it is damage
    EXPECT_TRUE(read(kTriangleText + "f 1 2 3\n\n \n")->warnings.empty());
}

} // namespace obj_test
