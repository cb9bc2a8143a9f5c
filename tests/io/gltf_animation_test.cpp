// glTF skins, morph targets and animations, evaluated; numbers by hand, or from a script that shares no code with us.
#include "filigree/io/gltf/gltf.h"
#include "io/corpus.h"
#include "io/gltf_text.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

using namespace filigree;
using namespace filigree_test;

namespace {

GltfScene scene_of(const std::string& bytes) {
    Result<GltfScene> scene = GltfScene::read(bytes, "a.gltf", RunContext(1));
    if (!scene) throw std::runtime_error(scene.error().message); // fails the test with the sentence
    return *std::move(scene);
}

std::vector<Vec3f> positions_at(const GltfScene& scene, double seconds, std::size_t animation = 0) {
    std::vector<Vec3f> positions(scene.mesh().vertex_count());
    const Status placed = scene.positions(animation, seconds, positions, RunContext(2));
    EXPECT_TRUE(placed.ok());
    return positions;
}

/// A triangle in node 0 that one channel moves, and its mesh.
GltfScene moved(GltfText file, const std::string& path, const std::string& sampler, const std::string& node = "",
                const std::string& mesh = R"({"primitives":[{"attributes":{"POSITION":0}}]})") {
    return scene_of(file.text(R"("nodes":[{"mesh":0)" + node + R"(}],"meshes":[)" + mesh +
                              R"(],"animations":[{"name":"move","channels":[{"sampler":0,"target":{"node":0,"path":")" +
                              path + R"("}}],"samplers":[{"input":1,"output":2,)" + sampler + "}]}]"));
}

GltfText keys(const std::vector<float>& times, const std::vector<float>& values, const std::string& type) {
    GltfText file;
    file.add(kTriangle, "VEC3");
    file.add(times, "SCALAR");
    file.add(values, type);
    return file;
}

std::filesystem::path good(const std::string& file) { return corpus_folder() / "good/gltf" / file; }

} // namespace

TEST(GltfAnimation, LinearTranslationIsHeldOutsideItsKeys) {
    const GltfScene scene =
        moved(keys({1, 2, 4}, {0, 0, 0, 1, 0, 0, 1, 4, 0}, "VEC3"), "translation", R"("interpolation":"LINEAR")");
    ASSERT_EQ(scene.animations().size(), 1u);
    EXPECT_EQ(scene.animations()[0].name, "move");
    EXPECT_EQ(scene.animations()[0].first_key, 1);
    EXPECT_EQ(scene.animations()[0].last_key, 4);
    expect_near(positions_at(scene, 0)[0], {0, 0, 0});
    expect_near(positions_at(scene, 1.25)[0], {0.25, 0, 0});
    expect_near(positions_at(scene, 2)[0], {1, 0, 0});
    expect_near(positions_at(scene, 3)[0], {1, 2, 0});
    expect_near(positions_at(scene, 9)[0], {1, 4, 0});
}

TEST(GltfAnimation, StepKeepsTheLastKey) {
    const GltfScene scene = moved(keys({0, 1}, {1, 1, 1, 3, 3, 3}, "VEC3"), "scale", R"("interpolation":"STEP")");
    expect_near(positions_at(scene, 0.99)[1], {1, 0, 0});
    expect_near(positions_at(scene, 1)[1], {3, 0, 0});
}

TEST(GltfAnimation, CubicSplineUsesTangentsTimesTheSpan) {
    // over two seconds from 0 with slope 3 to 1 with slope -1: at a quarter 0.84375 * 0 + 2 * 0.140625 * 3 + 0.15625 *
    // 1
    // + 2 * -0.046875 * -1
    const GltfScene scene = moved(keys({0, 2}, {9, 9, 9, 0, 0, 0, 3, 0, 0, -1, 0, 0, 1, 0, 0, 9, 9, 9}, "VEC3"),
                                  "translation", R"("interpolation":"CUBICSPLINE")");
    expect_near(positions_at(scene, 0.5)[0], {0.84375 + 0.15625 + 0.09375, 0, 0});
    expect_near(positions_at(scene, 2)[0], {1, 0, 0});
}

TEST(GltfAnimation, RotationsTurnTheShortWay) {
    const float half = std::sqrt(0.5f);
    // 90 degrees about z; the second key is the negative of the same rotation's quaternion
    const GltfScene scene =
        moved(keys({0, 1}, {0, 0, 0, 1, 0, 0, -half, -half}, "VEC4"), "rotation", R"("interpolation":"LINEAR")");
    const double third = std::numbers::pi / 6;
    expect_near(positions_at(scene, 1.0 / 3)[1], {std::cos(third), std::sin(third), 0});
}

TEST(GltfAnimation, RotationsAsSmallIntegers) {
    GltfText file;
    file.add(kTriangle, "VEC3");
    file.add({0, 1}, "SCALAR");
    file.add<std::int16_t>({0, 0, 0, 32767, 0, 0, 32767, 0}, 5122, "VEC4", "\"normalized\":true");
    const GltfScene scene = moved(file, "rotation", R"("interpolation":"LINEAR")");
    expect_near(positions_at(scene, 1)[1], {-1, 0, 0});
    expect_near(positions_at(scene, 0.5)[1], {0, 1, 0});
}

TEST(GltfAnimation, MorphTargetsWithWeightsOfMeshNodeAndAnimation) {
    GltfText file = keys({0, 1}, {0, 0, 1, 0.5f}, "SCALAR");
    file.add({0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3");
    const std::size_t which = file.add_view<std::uint16_t>({2}), values = file.add_view<float>({0, 0, 10});
    file.add_accessor("", 5126, 3, "VEC3",
                      R"("sparse":{"count":1,"indices":{"bufferView":)" + std::to_string(which) +
                          R"(,"componentType":5123},"values":{"bufferView":)" + std::to_string(values) + "}}");
    const std::string mesh =
        R"({"weights":[0.5,0],"primitives":[{"attributes":{"POSITION":0},"targets":[{"POSITION":3},{"POSITION":4}]}]})";
    const GltfScene scene = moved(file, "weights", R"("interpolation":"LINEAR")", "", mesh);
    expect_near(scene.mesh().positions[1], {1, 0, 0.5});
    expect_near(positions_at(scene, 0.5)[1], {1, 0, 0.5});
    expect_near(positions_at(scene, 0.5)[2], {0, 1, 0.5 + 0.25 * 10});
    expect_near(positions_at(scene, 1)[2], {0, 1, 1 + 0.5 * 10});
    const GltfScene own = moved(file, "weights", R"("interpolation":"STEP")", R"(,"weights":[0,1])", mesh);
    expect_near(own.mesh().positions[2], {0, 1, 10});
}

TEST(GltfAnimation, SkinsLeaveTheirNodesTransformOutAndMayHaveEightInfluences) {
    GltfText file;
    file.add(kTriangle, "VEC3");
    file.add<std::uint8_t>({0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}, 5121, "VEC4");
    file.add<std::uint8_t>({255, 0, 0, 0, 51, 0, 0, 0, 0, 0, 0, 0}, 5121, "VEC4", "\"normalized\":true");
    file.add<std::uint16_t>({7, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, 5123, "VEC4"); // of weight 0: joint 7 is not there
    file.add({0, 0, 0, 0, 0.8f, 0, 0, 0, 1, 0, 0, 0}, "VEC4");
    file.add({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -1, 0, 0, 1}, "MAT4");
    const GltfScene scene = scene_of(file.text(
        R"("nodes":[{"mesh":0,"skin":0,"translation":[99,0,0]},{"translation":[0,0,10]},{"scale":[2,2,2],"children":[1]}],
        "skins":[{"joints":[1,2],"inverseBindMatrices":5}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0,"JOINTS_0":1,"WEIGHTS_0":2,"JOINTS_1":3,"WEIGHTS_1":4}}]}])"));
    EXPECT_TRUE(scene.warnings().empty());
    expect_near(scene.mesh().positions[0], {0, 0, 20});
    expect_near(scene.mesh().positions[1], {0.2 * 2, 0, 0.2 * 20}); // 0.2 of (2, 0, 20), 0.8 of (0, 0, 0)
    expect_near(scene.mesh().positions[2], {-2, 2, 0});
}

TEST(GltfAnimation, WeightsAreTakenAsTheyAreWithAWarning) {
    GltfText file;
    file.add(kTriangle, "VEC3");
    file.add<std::uint8_t>({0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}, 5121, "VEC4");
    file.add({0.5f, 0, 0, 0, 0.5f, 0, 0, 0, 1, 0, 0, 0}, "VEC4");
    const GltfScene scene = scene_of(file.text(R"("nodes":[{"mesh":0,"skin":0},{}],"skins":[{"joints":[1]}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0,"JOINTS_0":1,"WEIGHTS_0":2}}]}])"));
    expect_near(scene.mesh().positions[1], {0.5, 0, 0});
    ASSERT_EQ(scene.warnings().size(), 1u);
    EXPECT_EQ(scene.warnings()[0],
              "meshes[0].primitives[0]: the weights of 2 vertices do not add up to 1; they were taken as they are.");
}

TEST(GltfAnimation, NormalsFollow) {
    GltfText file = keys({0, 1}, {0, 0, 0, 1, 0, 1, 0, 0}, "VEC4"); // half a turn about y
    file.add({0, 0, 1, 0, 0, 1, 0.6f, 0, 0.8f}, "VEC3");
    const GltfScene scene = moved(file, "rotation", R"("interpolation":"LINEAR")", "",
                                  R"({"primitives":[{"attributes":{"POSITION":0,"NORMAL":3}}]})");
    const Result<Mesh> mesh = scene.mesh_at(0, 1, RunContext(1));
    ASSERT_TRUE(mesh.ok());
    EXPECT_EQ(check_mesh(*mesh), "");
    expect_near(mesh->positions[1], {-1, 0, 0});
    expect_near(mesh->normals.values[2], {-0.6, 0, -0.8});
}

TEST(GltfAnimation, OtherThingsThanNodesAreLeftOut) {
    GltfText file = keys({0, 1}, {0, 1}, "SCALAR");
    const GltfScene scene = scene_of(file.text(R"("extensionsUsed":["KHR_animation_pointer"],"nodes":[{"mesh":0}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"animations":[{"samplers":[{"input":1,"output":2}],
        "channels":[{"sampler":0,"target":{"path":"pointer"}}]}])"));
    ASSERT_EQ(scene.warnings().size(), 1u);
    EXPECT_TRUE(positions_at(scene, 1)[1] == Vec3f(1, 0, 0));
}

TEST(GltfAnimation, PlacesBeyondFloatAreAnError) {
    GltfText file = keys({0, 1}, {1, 1, 1, 3e38f, 3e38f, 3e38f}, "VEC3");
    const GltfScene scene = scene_of(file.text(R"("nodes":[{"children":[1]},{"mesh":0,"scale":[10,10,10]}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"animations":[{"samplers":[{"input":1,"output":2}],
        "channels":[{"sampler":0,"target":{"node":0,"path":"scale"}}]}])"));
    std::vector<Vec3f> positions(3);
    const Status placed = scene.positions(0, 1, positions, RunContext(1));
    ASSERT_FALSE(placed.ok());
    EXPECT_EQ(placed.error().code, ErrorCode::bad_file);
    expect_near(positions_at(scene, 0)[1], {10, 0, 0});
}

TEST(GltfAnimation, ASkinOfTheCorpus) {
    const Result<GltfScene> scene = GltfScene::read(good("simple_skin.gltf"), RunContext(1));
    if (!scene) GTEST_SKIP() << "no corpus at " << corpus_folder();
    // joint 1 turns about (0.5, 1, 0) bound to (0, 1, 0): p' = (1 - w) (p - (0.5, 0, 0)) + w (R (p - (0.5, 1, 0)) + (0,
    // 1, 0))
    const auto expected = [](const Vec3d& p, double weight, double angle) {
        const double x = p.x() - 0.5, y = p.y() - 1;
        const Vec3d turned(std::cos(angle) * x - std::sin(angle) * y, std::sin(angle) * x + std::cos(angle) * y + 1, 0);
        return Vec3d((1 - weight) * Vec3d(x, p.y(), 0) + weight * turned);
    };
    const double eighth = 2 * std::atan2(0.382999986410141, 0.9240000247955322); // the key at 0.5 s
    for (const auto& [seconds, angle] :
         {std::pair(0.0, 0.0), std::pair(0.5, eighth), std::pair(0.25, eighth / 2),
          std::pair(1.0, std::numbers::pi / 2), std::pair(4.25, -std::numbers::pi / 2), std::pair(7.0, 0.0)}) {
        const std::vector<Vec3f> positions = positions_at(*scene, seconds);
        for (int v = 0; v < 10; ++v)
            expect_near(positions[static_cast<std::size_t>(v)],
                        expected(Vec3d(v % 2, 0.5 * (v / 2), 0), 0.25 * (v / 2), angle));
    }
}

TEST(GltfAnimation, AMorphCubeOfTheCorpus) {
    const Result<GltfScene> scene = GltfScene::read(good("AnimatedMorphCube/AnimatedMorphCube.gltf"), RunContext(1));
    if (!scene) GTEST_SKIP() << "no corpus at " << corpus_folder();
    // at the third key the first weight is 0.0050636...; vertex 2 goes up by 0.0189325... of it in the mesh's own axes,
    // and the node turns (x, y, z) to (-x, -z, -y) * 100 (nearly: its rotation is half a turn about (0, 1, -1))
    const double up = 0.005063657183200121 * 0.018932530656456947;
    const Vec3d p(0.010000000707805157, -0.009999997913837433 + up, 0.009999999776482582);
    expect_near(positions_at(*scene, 0.06666667014360428)[2], 100 * Vec3d(-p.x(), -p.z(), -p.y()), 1e-6);
    const Result<Mesh> mesh = scene->mesh_at(0, 2, RunContext(1));
    ASSERT_TRUE(mesh.ok());
    EXPECT_EQ(check_mesh(*mesh), "");
}

TEST(GltfAnimation, AFoxOfTheCorpus) {
    const Result<GltfScene> scene = GltfScene::read(good("Fox/Fox.gltf"), RunContext(1));
    if (!scene) GTEST_SKIP() << "no corpus at " << corpus_folder();
    ASSERT_EQ(scene->animations().size(), 3u);
    EXPECT_EQ(scene->animations()[2].name, "Run");
    ASSERT_EQ(scene->mesh().embedded_materials.size(), 1u);
    ASSERT_TRUE(scene->mesh().embedded_materials[0].picture_bytes);
    expect_near(scene->mesh().positions[500], {7.778813, 20.654625, -30.463173}, 1e-5);
    struct Moment {
        std::size_t animation;
        double seconds;
        Vec3d first, last, sums; ///< vertices 0 and 1727; of absolute coordinates
    };
    const Moment moments[] = {
        {0,
         1.2345,
         {2.055216, 32.960862, -20.40575},
         {25.604389, 50.376162, 55.38315},
         {14252.65320139, 55752.66597439, 53397.50825417}},
        {1,
         0.3,
         {1.94988, 33.14065, -21.893863},
         {-0.058079, 52.777509, 69.954183},
         {10792.46315538, 59428.96370432, 60187.06255496}},
        {2,
         0.5,
         {3.013685, 32.507919, -28.351981},
         {-0.000075, 41.292142, 68.206712},
         {11716.95991148, 64423.18621283, 70361.84560051}},
    };
    for (const Moment& moment : moments) {
        const std::vector<Vec3f> positions = positions_at(*scene, moment.seconds, moment.animation);
        expect_near(positions[0], moment.first, 1e-5);
        expect_near(positions[1727], moment.last, 1e-5);
        Vec3d sums = Vec3d::Zero();
        for (const Vec3f& p : positions) sums += p.cast<double>().cwiseAbs();
        EXPECT_LE((sums - moment.sums).norm(), 0.01) << sums.transpose();
    }
}

TEST(GltfAnimation, SameBytesForAnyNumberOfThreads) {
    const Result<GltfScene> scene = GltfScene::read(good("Fox/Fox.gltf"), RunContext(1));
    if (!scene) GTEST_SKIP() << "no corpus at " << corpus_folder();
    std::vector<Vec3f> one(scene->mesh().vertex_count()), more = one;
    ASSERT_TRUE(scene->positions(1, 0.2, one, RunContext(1)).ok());
    ASSERT_TRUE(scene->positions(1, 0.2, more, RunContext(0)).ok());
    EXPECT_EQ(std::memcmp(one.data(), more.data(), 12 * one.size()), 0);
}

TEST(GltfAnimation, NodesThatNothingShowsCostNoWeights) {
    // 20,000 nodes of 2,000 weights would be 320 MB; only one is in the scene.
    std::string nodes = R"({"mesh":0})", targets = R"({"POSITION":0})", weights = "0.5";
    for (int n = 1; n < 20000; ++n) nodes += R"(,{"mesh":0})";
    for (int t = 1; t < 2000; ++t) targets += R"(,{"POSITION":0})", weights += ",0";
    GltfText file;
    file.add(kTriangle, "VEC3");
    const std::string mesh = R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"targets":[)" + targets +
                             R"(]}],"weights":[)" + weights + R"(]}],"nodes":[)" + nodes + "]";
    const GltfScene scene = scene_of(file.text(R"("scenes":[{"nodes":[0]}],)" + mesh));
    expect_near(scene.mesh().positions[1], {1.5, 0, 0});
    // Without a scene all of them are shown: refused before it takes memory.
    const Result<GltfScene> all = GltfScene::read(file.text(mesh), "a.gltf", RunContext(1));
    ASSERT_FALSE(all.ok());
    EXPECT_EQ(all.error().code, ErrorCode::unsupported);
}
