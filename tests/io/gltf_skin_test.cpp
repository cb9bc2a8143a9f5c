// Skins of glTF as one: the bind pose, the joints, and where clips have them.
#include "filigree/core/math.h"
#include "filigree/io/gltf/gltf.h"
#include "filigree/io/system/file.h"
#include "filigree/skin.h"

#include "flesh/skinned_gltf.h"

#include <Eigen/Geometry>
#include <filesystem>
#include <unistd.h>

namespace filigree {
namespace {

using namespace filigree_test;

class GltfSkin : public testing::Test {
protected:
    Result<SkinnedMesh> read(const std::string& text) const {
        EXPECT_TRUE(write_file(path_, text).ok());
        return read_skin(path_);
    }
    void TearDown() override { std::filesystem::remove(path_); }
    /// Largest distance of the skin from what a viewer shows half way through the clip.
    double beside_viewer(const SkinnedMesh& skin, const std::string& text) const {
        const GltfScene scene = GltfScene::read(text, "tube.gltf", RunContext()).value();
        std::vector<Vec3f> shown(scene.mesh().vertex_count()), ours(shown.size());
        EXPECT_TRUE(scene.positions(0, 0.5, shown, RunContext()).ok());
        std::vector<Eigen::Affine3d> transforms(skin.joints.size());
        skin.transforms(0, 0.5, transforms);
        skin_positions(skin, transforms, ours);
        double most = 0;
        for (std::size_t v = 0; v < ours.size(); ++v)
            most = std::max(
                most,
                (ours[v].cast<double>() + skin.mesh.origin - shown[v].cast<double>() - scene.mesh().origin).norm());
        return most;
    }

    const std::string path_ =
        (std::filesystem::temp_directory_path() / ("filigree_skin_" + std::to_string(getpid()) + ".gltf")).string();
};

TEST_F(GltfSkin, HasTheBindPoseTheJointsAndTheClips) {
    const std::string text = skinned_tube();
    const SkinnedMesh skin = read(text).value();
    EXPECT_EQ(check_skin(skin), "");
    ASSERT_EQ(skin.joints.size(), 2u);
    EXPECT_EQ(skin.joints[0].name, "upper");
    EXPECT_EQ(skin.joints[1].parent, 0u);
    expect_near(skin.joints[0].place, {-0.5, 0, 0});
    ASSERT_EQ(skin.clips.size(), 3u);
    EXPECT_EQ(skin.clips[0].name, "Bend");
    EXPECT_EQ(skin.clips[0].seconds, 1);
    EXPECT_EQ(skin.clips[1].seconds, 0);
    EXPECT_NEAR(bounds(skin.mesh).size().x(), 1, 1e-6);
    std::vector<Eigen::Affine3d> transforms(2);
    skin.transforms(0, 5, transforms); // held at its end
    expect_near(Vec3d(transforms[1] * Vec3d(0.5, 0, 0)), {0, 0.5, 0});
    EXPECT_LT(beside_viewer(skin, text), 1e-6);
}

/// Armatures in other units, lying, mirrored, far away: the bind pose is as large and as upright as the viewer's.
TEST_F(GltfSkin, TakesTheArmaturesSizeAndTurn) {
    for (const char* armature :
         {R"("scale":[0.01,0.01,0.01])", R"("rotation":[-0.70710678,0,0,0.70710678],"scale":[100,100,100])",
          R"("scale":[-1,1,1])", R"("translation":[10000,0,-20000])"}) {
        const std::string text = skinned_tube(armature);
        const SkinnedMesh skin = read(text).value();
        const double size = bounds(skin.mesh).size().maxCoeff();
        EXPECT_LT(beside_viewer(skin, text), 2e-6 * size + 5e-9 * skin.mesh.origin.norm()) << armature;
        std::vector<Eigen::Affine3d> transforms(2);
        skin.transforms(0, 0, transforms);
        for (const Eigen::Affine3d& joint : transforms) // in the bind pose nothing is turned, scaled or mirrored
            EXPECT_LT((joint.linear() - Mat3d::Identity()).norm(), 1e-5) << armature;
        const GltfScene scene = GltfScene::read(text, "tube.gltf", RunContext()).value();
        EXPECT_NEAR(size, bounds(scene.mesh()).size().maxCoeff(), 1e-5 * size) << armature;
        EXPECT_GT(analyse_topology(skin.mesh).volume, 0) << armature; // also where it is mirrored
    }
}

TEST_F(GltfSkin, SkinsThatShareJointsBecomeOne) {
    const std::string text = skinned_tube(R"("scale":[2,2,2])", 2);
    const SkinnedMesh skin = read(text).value();
    EXPECT_EQ(check_skin(skin), "");
    EXPECT_EQ(skin.joints.size(), 2u);
    EXPECT_LT(beside_viewer(skin, text), 1e-5);
}

TEST_F(GltfSkin, MeshesWithoutASkinHangOnTheirNode) {
    const std::string text = skinned_tube("", 1, true);
    const SkinnedMesh skin = read(text).value();
    EXPECT_EQ(check_skin(skin), "");
    ASSERT_EQ(skin.joints.size(), 3u);
    EXPECT_EQ(skin.joints[2].name, "rod");
    EXPECT_TRUE(skin.joints[2].is_node_of_mesh);
    EXPECT_EQ(skin.joints[2].parent, 1u);
    EXPECT_LT(beside_viewer(skin, text), 1e-6);
    std::vector<Eigen::Affine3d> transforms(3);
    skin.transforms(0, 0.5, transforms);
    EXPECT_LT((transforms[2].matrix() - transforms[1].matrix()).norm(), 1e-6);
}

/// Morph targets as the bind pose has them: with the joints they are where a viewer shows them.
TEST_F(GltfSkin, MorphTargetsLieBesideTheMesh) {
    for (const char* armature : {"", R"("scale":[0.01,0.01,0.01])", R"("scale":[-1,1,1])",
                                 R"("rotation":[-0.70710678,0,0,0.70710678],"scale":[100,100,100])"}) {
        const std::string text = skinned_tube(armature, 1, true, true);
        const SkinnedMesh skin = read(text).value();
        EXPECT_EQ(check_skin(skin), "");
        ASSERT_EQ(skin.morphs.size(), 2u);
        EXPECT_EQ(skin.morphs[0].name, "bulge");
        EXPECT_EQ(skin.morphs[1].name, "narrow");
        EXPECT_EQ(skin.morphs[0].weight, 0.25);
        EXPECT_EQ(skin.morphs[0].normals.size(), skin.morphs[0].vertices.size());
        ASSERT_EQ(skin.morph_weights.size(), 3u);
        std::vector<double> weights(2);
        skin.morph_weights[0](0.5, weights);
        EXPECT_NEAR(weights[0], 0.5, 1e-6);
        skin.morph_weights[2](0.5, weights);
        EXPECT_EQ(weights[0], 0.25);
        const GltfScene scene = GltfScene::read(text, "tube.gltf", RunContext()).value();
        std::vector<Vec3f> shown(scene.mesh().vertex_count()), ours(shown.size());
        ASSERT_TRUE(scene.positions(0, 0.8, shown, RunContext()).ok());
        std::vector<Eigen::Affine3d> transforms(skin.joints.size());
        skin.transforms(0, 0.8, transforms);
        SkinnedMesh moved = skin;
        skin.morph_weights[0](0.8, weights);
        for (std::size_t m = 0; m < 2; ++m)
            for (std::size_t i = 0; i < skin.morphs[m].vertices.size(); ++i)
                moved.mesh.positions[skin.morphs[m].vertices[i]] +=
                    float(weights[m] - skin.morphs[m].weight) * skin.morphs[m].positions[i];
        skin_positions(moved, transforms, ours);
        const double size = bounds(skin.mesh).size().maxCoeff();
        for (std::size_t v = 0; v < ours.size(); ++v)
            ASSERT_LT(
                (ours[v].cast<double>() + skin.mesh.origin - shown[v].cast<double>() - scene.mesh().origin).norm(),
                2e-6 * size)
                << armature;
    }
}

TEST_F(GltfSkin, RefusesWhatHasNoJointsOrNoMotion) {
    const auto refused = [&](const std::string& text) {
        const Result<SkinnedMesh> skin = read(text);
        return skin.ok() ? std::string() : skin.error().message;
    };
    GltfText plain;
    const std::string places = std::to_string(plain.add(kTriangle, "VEC3"));
    EXPECT_NE(refused(plain.text(R"("scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"meshes":[{"primitives":)"
                                 R"([{"attributes":{"POSITION":)" +
                                 places + "}}]}]"))
                  .find("no skin"),
              std::string::npos);
    std::string still = skinned_tube();
    still.erase(still.find(R"(,"animations")"));
    EXPECT_NE(refused(still + "}").find("no animation"), std::string::npos);
    EXPECT_NE(refused(skinned_tube(R"("scale":[0,0,0])")).find("scale zero"), std::string::npos);
    EXPECT_NE(refused("OFF\n").find("no glTF"), std::string::npos);
}

} // namespace
} // namespace filigree
