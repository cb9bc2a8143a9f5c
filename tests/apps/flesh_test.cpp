// `filigree flesh`: from a skin to a skin, and what it refuses.
#include "apps/program.h"
#include "flesh/skinned_gltf.h"

#include "filigree/file.h"
#include "filigree/io/gltf/gltf.h"
#include "filigree/io/system/file.h"

using namespace filigree_test;
using namespace filigree;

namespace {

class FleshCommand : public Program {
protected:
    void SetUp() override { ASSERT_TRUE(write_file(path("tube.gltf"), skinned_tube()).ok()); }
    const std::vector<std::string> few_ = {"--particles", "300", "--no-check", "--frame-rate", "30"};
    std::vector<std::string> flesh(std::vector<std::string> more) const {
        more.insert(more.begin(), "flesh");
        more.insert(more.end(), few_.begin(), few_.end());
        return more;
    }
    /// The JSON of a GLB.
    Json document_of(const char* name) const {
        const std::string bytes = read_file(path(name)).value();
        const auto byte = [&](std::size_t at) { return std::size_t(std::uint8_t(bytes[at])); };
        return Json::parse(bytes.substr(20, byte(12) + 256 * byte(13) + 65536 * byte(14)));
    }
};

} // namespace

TEST_F(FleshCommand, ASkinBecomesASkinThatPlays) {
    const Json said = json(flesh({"tube.gltf", "-o", "soft.glb", "--joints", "40"}));
    ASSERT_EQ(said["clips"].size(), 2u); // a single pose is left out
    EXPECT_EQ(said["clips"][0]["name"], "Bend");
    EXPECT_EQ(said["clips"][0]["frames"], 31);
    EXPECT_EQ(said["clips"][0]["clamped_particles"], 0);
    EXPECT_GT(double(said["clips"][0]["volume"][0]), double(said["clips"][0]["skin_volume"][0]));
    EXPECT_EQ(said["scale"], 1);
    EXPECT_LT(double(said["fit_rms"]), 5e-3);
    EXPECT_NE(said["warnings"].dump().find("single pose were left out: 'Still'"), std::string::npos);
    const GltfScene scene = GltfScene::read(path("soft.glb"), RunContext()).value();
    ASSERT_EQ(scene.animations().size(), 2u);
    EXPECT_EQ(scene.animations()[0].name, "Bend");
    EXPECT_EQ(scene.animations()[1].name, "Wave");
    EXPECT_NEAR(scene.animations()[0].last_key, 1, 1e-6);
    // Its end is near the plain skin's.
    const GltfScene plain = GltfScene::read(path("tube.gltf"), RunContext()).value();
    std::vector<Vec3f> soft(scene.mesh().vertex_count()), skin(plain.mesh().vertex_count());
    ASSERT_EQ(soft.size(), skin.size());
    ASSERT_TRUE(scene.positions(0, 1, soft, RunContext()).ok());
    ASSERT_TRUE(plain.positions(0, 1, skin, RunContext()).ok());
    double sum = 0;
    for (std::size_t v = 0; v < soft.size(); ++v) sum += double((soft[v] - skin[v]).squaredNorm());
    EXPECT_LT(std::sqrt(sum / double(soft.size())), 0.05);
}

TEST_F(FleshCommand, OneClipBecomesAModel) {
    const Json said = json(flesh({"tube.gltf", "-o", "soft.fil", "--clip", "Wave", "--loop"}));
    EXPECT_EQ(said["clips"][0]["is_loop"], true);
    const PoseSequence poses = read_poses(path("soft.fil")).value();
    ASSERT_EQ(poses.frames.size(), 31u);
    EXPECT_EQ(poses.frames.front().positions, poses.frames.back().positions);
}

TEST_F(FleshCommand, TheSurfaceOfASkinOrOfACacheIsFollowed) {
    const Json by_surface =
        json(flesh({"tube.gltf", "-o", "soft.fil", "--clip", "Bend", "--by-surface", "--joints", "40"}));
    EXPECT_EQ(by_surface["clips"][0]["frames"], 31);
    EXPECT_GT(double(by_surface["clips"][0]["skin_volume"][0]), 0.8);
    EXPECT_LT(double(by_surface["clips"][0]["furthest"]), 0.1);
    // The same as a cache of its mesh, which knows no clip.
    const GltfScene scene = GltfScene::read(path("tube.gltf"), RunContext()).value();
    Mesh rest = scene.mesh();
    for (const Vec3f& p : rest.positions) rest.colors.push_back({p.x() > 0 ? 1.0f : 0.0f, 0, 0, 1});
    ASSERT_TRUE(write_mesh(rest, path("tube.ply")).ok());
    const MeshAnimation bend{&rest, 31, 30, [&](std::size_t frame, std::span<Vec3f> out) {
                                 return scene.positions(0, double(frame) / 30, out, RunContext());
                             }};
    ASSERT_TRUE(write_animation(bend, path("tube.pc2")).ok());
    const std::vector<std::string> cache = {"tube.pc2",  "--mesh",   "tube.ply", "--input-rate", "30", "-o",
                                            "soft2.fil", "--joints", "40"};
    const Json by_cache = json(flesh(cache));
    EXPECT_EQ(by_cache["clips"][0]["name"], "tube");
    EXPECT_NEAR(double(by_cache["clips"][0]["furthest"]), double(by_surface["clips"][0]["furthest"]), 2e-3);
    std::vector<std::string> painted = cache;
    painted.insert(painted.end(), {"--soft-from", "color.r"});
    EXPECT_GT(double(json(flesh(painted))["clips"][0]["furthest"]), double(by_cache["clips"][0]["furthest"]) + 0.01);
    const auto sentence = [&](std::vector<std::string> arguments) { return run(flesh(std::move(arguments))).err; };
    EXPECT_NE(sentence({"tube.pc2", "-o", "x.fil"}).find("--mesh"), std::string::npos);
    EXPECT_NE(sentence({"tube.gltf", "-o", "x.glb", "--soft-from", "color.r"}).find("no colours"), std::string::npos);
    EXPECT_NE(sentence({"tube.gltf", "-o", "x.glb", "--soft-values", "0", "2"}).find("--soft-from"), std::string::npos);
    EXPECT_NE(sentence({"tube.gltf", "-o", "x.glb", "--through", "upper"}).find("comma"), std::string::npos);
}

/// On top of the flesh, with names, weights at rest, and what the clips do to them.
TEST_F(FleshCommand, MorphTargetsGoOnTopOfTheFlesh) {
    ASSERT_TRUE(write_file(path("morphs.gltf"), skinned_tube("", 1, false, true)).ok());
    for (const char* packed : {"", "--compress"}) {
        std::vector<std::string> arguments = {"morphs.gltf", "-o", "soft.glb", "--joints", "40"};
        if (*packed) arguments.push_back(packed);
        const Json said = json(flesh(arguments));
        EXPECT_LT(double(said["error_at_keys"]), 1e-4);
        if (*packed) continue; // which our own reader does not read
        const Json document = document_of("soft.glb");
        const Json& mesh = document["meshes"][0];
        EXPECT_EQ(mesh["weights"].dump(), "[0.25,0.0]");
        EXPECT_EQ(mesh["extras"]["targetNames"].dump(), R"(["bulge","narrow"])");
        EXPECT_EQ(mesh["primitives"][0]["targets"].size(), 2u);
        EXPECT_TRUE(mesh["primitives"][0]["targets"][0].contains("NORMAL"));
        const GltfScene soft = GltfScene::read(path("soft.glb"), RunContext()).value();
        const GltfScene plain = GltfScene::read(path("morphs.gltf"), RunContext()).value();
        const std::size_t count = plain.mesh().vertex_count();
        ASSERT_EQ(soft.mesh().vertex_count(), count);
        std::vector<Vec3f> ours(count), theirs(count);
        for (const double t : {-1.0, 0.0, 1.0}) { // before anything plays, without the bulge, and with all of it
            if (t < 0) {
                ours = soft.mesh().positions;
                theirs = plain.mesh().positions;
            } else {
                ASSERT_TRUE(soft.positions(0, t, ours, RunContext()).ok());
                ASSERT_TRUE(plain.positions(0, t, theirs, RunContext()).ok());
            }
            double sum = 0;
            for (std::size_t v = 0; v < count; ++v) sum += double((ours[v] - theirs[v]).squaredNorm());
            EXPECT_LT(std::sqrt(sum / double(count)), t == 1 ? 0.03 : 5e-3) << t; // the flesh is a little behind
        }
    }
    const auto said = run(flesh({"morphs.gltf", "-o", "soft.fil", "--clip", "Bend"})).err;
    EXPECT_NE(said.find("morph targets"), std::string::npos) << said;
}

TEST_F(FleshCommand, TheFilesOwnSkeletonIsKeptBeside) {
    json(flesh({"tube.gltf", "-o", "soft.glb", "--joints", "40", "--keep-skeleton", "--clip", "Bend"}));
    const Json document = document_of("soft.glb");
    std::size_t lower = 0, turns = 0;
    for (std::size_t n = 0; n < document["nodes"].size(); ++n)
        if (document["nodes"][n].value("name", "") == "lower") lower = n;
    ASSERT_GT(lower, 0u);
    ASSERT_EQ(document["animations"].size(), 1u);
    for (const Json& channel : document["animations"][0]["channels"])
        turns += channel["target"]["node"] == lower && channel["target"]["path"] == "rotation";
    EXPECT_EQ(turns, 1u);
    EXPECT_NE(run(flesh({"tube.gltf", "-o", "x.fil", "--clip", "Bend", "--keep-skeleton"})).err.find(".glb"),
              std::string::npos);
}

TEST_F(FleshCommand, SaysWhatIsWrong) {
    const auto sentence = [&](std::vector<std::string> arguments) { return run(flesh(std::move(arguments))).err; };
    EXPECT_NE(
        sentence({"tube.gltf", "-o", "x.glb", "--clip", "Run"}).find("no clip 'Run', but 'Bend', 'Still', 'Wave'"),
        std::string::npos);
    EXPECT_NE(sentence({"tube.gltf", "-o", "x.glb", "--clip", "Still"}).find("single pose"), std::string::npos);
    EXPECT_NE(sentence({"tube.gltf", "-o", "x.glb", "--soft", "Tail*"}).find("'upper', 'lower'"), std::string::npos);
    EXPECT_NE(sentence({"tube.gltf", "-o", "tube.gltf"}).find("tube.gltf"), std::string::npos);
    EXPECT_NE(sentence({"tube.gltf", "-o", "x.glb", "-o", "x.glb"}).find("one place"), std::string::npos);
    EXPECT_FALSE(std::filesystem::exists(path("x.glb")));
    ASSERT_TRUE(write_mesh(make_cylinder(), path("plain.glb")).ok());
    EXPECT_NE(sentence({"plain.glb", "-o", "x.glb"}).find("no skin"), std::string::npos);
}
