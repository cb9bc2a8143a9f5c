// Animated USD text as other programs write it, and what is refused.
#include "filigree/io/animation/point_cache.h"
#include "filigree/io/animation/usd_scene.h"
#include "filigree/io/system/file.h"
#include "filigree/mesh.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <numbers>
#include <random>

namespace filigree {
namespace {

namespace fs = std::filesystem;

/// Two meshes as Blender lays them out: Z up, transforms above the mesh, a remark, a material, a path and a file name.
const std::string kScene = R"usda(#usda 1.0
(
    defaultPrim = "root"
    doc = """Made "elsewhere" (}
"""
    endTimeCode = 4
    framesPerSecond = 12
    metersPerUnit = 0.01
    startTimeCode = 1
    timeCodesPerSecond = 24
    upAxis = "Z"
)

def Xform "root" (
    customData = {
        dictionary a = { string b = "}" }
    }
)
{
    double3 xformOp:translate = (10, 0, 0)
    double3 xformOp:rotateXYZ.timeSamples = {
        1: (0, 0, 0),
        3: (0, 0, 180),
    }
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ"]

    def Mesh "sheet" ( # two quads
        prepend apiSchemas = ["MaterialBindingAPI"]
    )
    {
        float3[] extent = [(0, 0, 0), (2, 1, 0)]
        int[] faceVertexCounts = [4, 4]
        int[] faceVertexIndices = [0, 1, 4, 3, 1, 2, 5, 4]
        rel material:binding = </root/mat>
        point3f[] points = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0), (1, 1, 0), (2, 1, 0)] (
            interpolation = "vertex"
        )
        point3f[] points.timeSamples = {
            1: [(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0), (1, 1, 0), (2, 1, 0)],
            2: None,
            3: [(0, 0, 1), (1, 0, 1), (2, 0, 1), (0, 1, 1), (1, 1, 1), (2, 1, 1)],
        }
        uniform token subdivisionScheme = "none"
    }

    def Mesh "hidden"
    {
        token visibility = "invisible"
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [0, 1, 2]
        point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    }

    def Material "mat"
    {
        token outputs:surface.connect = </root/mat/s.outputs:surface>
        def Shader "s" { uniform token info:id = "UsdPreviewSurface"; asset inputs:file = @./a.png@ }
    }
}

def Mesh "triangle"
{
    uniform token orientation = "leftHanded"
    int[] faceVertexCounts = [3]
    int[] faceVertexIndices = [0, 1, 2]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    matrix4d xformOp:transform = ( (2, 0, 0, 0), (0, 2, 0, 0), (0, 0, 2, 0), (0, 0, 5, 1) )
    uniform token[] xformOpOrder = ["xformOp:transform"]
}
)usda";

class UsdRead : public testing::Test {
protected:
    fs::path path_ = fs::path(testing::TempDir()) / "filigree_usd_read.usda";
    void TearDown() override { fs::remove(path_); }

    Result<UsdScene> open(const std::string& text) {
        EXPECT_TRUE(write_file(path_, std::array<std::string_view, 1>{text}).ok());
        return UsdScene::open(path_, false);
    }
    std::string refusal(const std::string& text) {
        const Result<UsdScene> scene = open(text);
        return scene.ok() ? "" : scene.error().message;
    }
};

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
}

TEST_F(UsdRead, MeshesAreJoinedTurnedAndPlaced) {
    const Result<UsdScene> scene = open(kScene);
    ASSERT_TRUE(scene.ok()) << scene.error().message;
    const Mesh& mesh = scene->mesh();
    EXPECT_EQ(check_mesh(mesh), "");
    ASSERT_EQ(mesh.vertex_count(), 9u);
    EXPECT_EQ(mesh.face_count(), 3u);
    EXPECT_EQ(mesh.objects.names, (std::vector<std::string>{"sheet", "triangle"}));
    EXPECT_EQ(mesh.objects.of_face, (std::vector<Index>{0, 0, 1}));
    EXPECT_EQ(mesh.face(2)[0], 8u) << "left-handed faces are turned round";
    EXPECT_EQ(scene->metres_per_unit(), 0.01);
    EXPECT_EQ(scene->frames_per_second(), 12);
    EXPECT_LT((mesh.world_position(4) - Vec3d(11, 0, -1)).norm(), 1e-6) << "Z up becomes Y up";
    EXPECT_LT((mesh.world_position(7) - Vec3d(2, 5, 0)).norm(), 1e-6);

    EXPECT_EQ(scene->frames(12).value(), 2u); // time codes 1 and 3 of 1 to 4
    EXPECT_EQ(scene->frames(24).value(), 4u);
    std::vector<Vec3d> at(9);
    ASSERT_TRUE(scene->positions(1, 24, at).ok()); // half way between the samples: a quarter turn, half a unit up
    EXPECT_LT((at[2] - Vec3d(10, 0.5, -2)).norm(), 1e-6);
    ASSERT_TRUE(scene->positions(1, 12, at).ok());
    EXPECT_LT((at[2] - Vec3d(8, 1, 0)).norm(), 1e-6);
    ASSERT_TRUE(scene->positions(3, 24, at).ok()) << "held after the last sample";
    EXPECT_LT((at[2] - Vec3d(8, 1, 0)).norm(), 1e-6);
}

TEST_F(UsdRead, TransformsAreThoseOfTheFormat) {
    const auto last = [&](const std::string& ops) {
        const Result<UsdScene> scene =
            open("#usda 1.0\ndef Mesh \"m\"\n{\n int[] faceVertexCounts = [3]\n int[] "
                 "faceVertexIndices = [0, 1, 2]\n point3f[] points = [(0, 0, 0), (0, 1, 0), (1, 2, 3)]\n" +
                 ops + "}\n");
        EXPECT_TRUE(scene.ok()) << (scene.ok() ? "" : scene.error().message);
        return scene.ok() ? scene->mesh().world_position(2) : Vec3d(0, 0, 0);
    };
    const auto near = [](const Vec3d& a, const Vec3d& b) { return (a - b).norm() < 1e-5; };
    EXPECT_TRUE(near(last("float3 xformOp:rotateXYZ = (90, 90, 0)\nuniform token[] xformOpOrder = "
                          "[\"xformOp:rotateXYZ\"]\n"),
                     Vec3d(2, -3, -1))); // about X first
    EXPECT_TRUE(near(last("float3 xformOp:rotateYXZ = (90, 90, 0)\nuniform token[] xformOpOrder = "
                          "[\"xformOp:rotateYXZ\"]\n"),
                     Vec3d(3, 1, 2)));
    const double half = std::numbers::sqrt2 / 2;
    EXPECT_TRUE(near(last("quatf xformOp:orient = (" + std::to_string(half) + ", 0, 0, " + std::to_string(half) +
                          ")\nuniform token[] xformOpOrder = [\"xformOp:orient\"]\n"),
                     Vec3d(-2, 1, 3)));
    EXPECT_TRUE(near(last("float3 xformOp:translate:pivot = (1, 0, 0)\nfloat xformOp:rotateZ = 90\nuniform token[] "
                          "xformOpOrder = [\"xformOp:translate:pivot\", \"xformOp:rotateZ\", "
                          "\"!invert!xformOp:translate:pivot\"]\n"),
                     Vec3d(-1, 0, 3)));
    EXPECT_TRUE(near(last("float3 xformOp:scale = (2, 3, 4)\nfloat3 xformOp:translate = (1, 1, 1)\nuniform token[] "
                          "xformOpOrder = [\"xformOp:translate\", \"!resetXformStack!\", \"xformOp:scale\"]\n"),
                     Vec3d(2, 6, 12)));
}

TEST_F(UsdRead, OurOwnComesBackToTheBit) {
    Mesh mesh = make_wavy_sphere({.resolution = 4});
    mesh.origin = {4e6, -0.1, 5e5};
    const auto moved = [&](std::size_t frame) {
        std::vector<Vec3f> positions = mesh.positions;
        for (Vec3f& p : positions) p = 1.1f * p + Vec3f(0.1f, -0.2f, 0.3f) * float(frame);
        return positions;
    };
    const MeshAnimation animation{&mesh, 3, 24,
                                  [&](std::size_t frame, std::span<Vec3f> out) -> Status {
                                      std::ranges::copy(moved(frame), out.begin());
                                      return Success{};
                                  },
                                  0.5};
    ASSERT_TRUE(write_animation(animation, path_, kAllThreads).ok());
    const Result<MeshAnimation> read = open_animation(path_, mesh);
    ASSERT_TRUE(read.ok()) << read.error().message;
    EXPECT_EQ(read->frames, 3u);
    EXPECT_EQ(read->frames_per_second, 24);
    EXPECT_EQ(read->metres_per_unit, 0.5);
    std::vector<Vec3f> positions(mesh.vertex_count());
    for (std::size_t frame = 0; frame < 3; ++frame) {
        ASSERT_TRUE(read->positions(frame, positions).ok());
        const std::vector<Vec3f> truth = moved(frame);
        for (std::size_t v = 0; v < truth.size(); ++v)
            ASSERT_LT((positions[v] - truth[v]).norm(), 1e-6) << frame << ' ' << v;
    }
    const Mesh rest = read_usd_mesh(path_).value();
    EXPECT_EQ(rest.corners, mesh.corners);
    EXPECT_LT((rest.world_position(5) - mesh.origin - moved(0)[5].cast<double>()).norm(), 1e-6);

    const Mesh other = make_wavy_sphere({.resolution = 3});
    EXPECT_EQ(open_animation(path_, other).error().code, ErrorCode::mismatch);
}

TEST_F(UsdRead, WhatIsWrongIsSaidWithItsLine) {
    const auto says = [&](const std::string& text, const std::string& line, const std::string& cause) {
        const std::string said = refusal(text);
        EXPECT_NE(said.find(line), std::string::npos) << said;
        EXPECT_NE(said.find(cause), std::string::npos) << said;
        EXPECT_TRUE(said.ends_with(".")) << said;
    };
    says("solid cube\n", "", "does not begin with #usda");
    says("PXR-USDC\x01", "", "usdcat");
    says(kScene.substr(0, kScene.size() / 2), "line 39: ", "the end of the file");
    says(replaced(kScene, "[4, 4]", "[4, 5]"), "line 27", "counts sum to another number");
    says(replaced(kScene, "5, 4]", "6, 4]"), "line 33", "faceVertexIndices");
    says(replaced(kScene, "(0, 1, 0), (1, 1, 0)", "(0, x, 0), (1, 1, 0)"), "line 35", "is no number");
    says(replaced(kScene, "(0, 1, 0), (1, 1, 0)", "(0, nan, 0), (1, 1, 0)"), "line 35", "not finite");
    says(replaced(kScene, "\"xformOp:rotateXYZ\"]", "\"xformOp:rotateZ\"]"), "line 25", "which is not there");
    says(replaced(kScene, "def Xform \"root\" (", "def Xform \"root\" (\n  prepend references = @other.usda@</a>"),
         "line 15", "usdcat");
    says(replaced(kScene, "timeCodesPerSecond = 24", "timeCodesPerSecond = 0"), "line 10", "makes no sense");
    says(replaced(replaced(kScene, "def Mesh \"sheet\"", "over Mesh \"sheet\""), "def Mesh \"triangle\"",
                  "class Mesh \"triangle\""),
         "", "no mesh that is shown");
    EXPECT_EQ(open(replaced(kScene, "int[] faceVertexCounts = [4, 4]",
                            "int[] faceVertexCounts.timeSamples = { 1: [4, 4], 2: [4, 3] }"))
                  .error()
                  .code,
              ErrorCode::unsuitable);

    // What is wrong in a frame alone is said when it is fetched.
    {
        const Result<UsdScene> scene = open(replaced(kScene, "3: [(0, 0, 1), ", "3: ["));
        ASSERT_TRUE(scene.ok());
        std::vector<Vec3d> at(9);
        const Status read = scene->positions(1, 12, at);
        ASSERT_FALSE(read.ok());
        EXPECT_NE(read.error().message.find("line 41: there are 5 points, and the mesh has 6"), std::string::npos)
            << read.error().message;
    } // closed: Windows replaces no open file

    const std::size_t meshes = kScene.find("def Mesh \"triangle\"");
    const Result<UsdScene> still = open("#usda 1.0\n" + kScene.substr(meshes));
    ASSERT_TRUE(still.ok()) << still.error().message;
    EXPECT_EQ(still->frames(24).error().code, ErrorCode::unsuitable) << "nothing moves";
}

TEST_F(UsdRead, DamagedTextEndsWithAMeshOrASentence) {
    std::mt19937 random(1);
    std::size_t sound = 0;
    for (int k = 0; k < 1500; ++k) {
        std::string text = kScene;
        for (std::size_t damages = 1 + random() % 3; damages > 0; --damages) {
            const std::size_t at = 10 + random() % (text.size() - 10);
            const std::size_t length = random() % std::min<std::size_t>(text.size() - at, 30);
            switch (random() % 4) {
            case 0:
                text[at] = "{}[]()\"',:;@<>#\n0-e\\"[random() % 20];
                break;
            case 1:
                text.erase(at, length);
                break;
            case 2:
                text.insert(at, text.substr(random() % text.size(), length));
                break;
            default:
                text[at] = static_cast<char>(random());
                break;
            }
        }
        const Result<UsdLayer> layer = read_usd_layer(text, "it");
        if (!layer) {
            EXPECT_TRUE(layer.error().message.ends_with(".")) << layer.error().message;
            continue;
        }
        const Result<UsdScene> scene = open(text);
        if (!scene) {
            EXPECT_TRUE(scene.error().message.ends_with(".")) << scene.error().message;
            EXPECT_LT(scene.error().message.size(), 400u);
            continue;
        }
        ++sound;
        EXPECT_EQ(check_mesh(scene->mesh()), "");
        std::vector<Vec3d> at(scene->mesh().vertex_count());
        (void)scene->positions(1, 24, at);
    }
    EXPECT_GT(sound, 100u);
    EXPECT_LT(sound, 1400u);
}

} // namespace
} // namespace filigree
