// Models that leave as GLB: what the file plays is what we restore, and its parts are laid out as docs/exchange.md
// says.
#include "filigree/file.h"

#include "filigree/io/animation/point_cache.h"
#include "filigree/io/gltf/gltf.h"
#include "filigree/io/system/file.h"
#include "filigree/mesh.h"
#include "filigree/pose.h"
#include "filigree/strip.h"
#include "threads.h"

#include <cstring>
#include <filesystem>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filigree {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

const Model& wavy_model() {
    static const Model model = strip(make_wavy_cube({.resolution = 16}), {.base = 100}, kAllThreads).value().model;
    return model;
}

/// From rest to a bend and twist, with gradients.
PoseSequence make_poses(const Model& model, std::size_t frames, double frames_per_second) {
    PoseSequence poses{frames_per_second, {}};
    const Box box = world_bounds(model.mesh);
    for (std::size_t f = 0; f < frames; ++f) {
        const double t = frames > 1 ? double(f) / double(frames - 1) : 1;
        std::vector<std::unique_ptr<SpaceWarp>> warps;
        warps.push_back(make_squeeze(box, Axis::y, 1 + 0.4 * t).value());
        warps.push_back(make_bend(box, Axis::z, 90 * t));
        warps.push_back(make_twist(box, Axis::x, 60 * t));
        poses.frames.push_back(
            warp_pose(*make_chain(std::move(warps)), driver_positions(model), model.mesh.origin, kAllThreads));
    }
    return poses;
}

class GltfExport : public testing::Test {
protected:
    void SetUp() override {
        folder_ = fs::path(testing::TempDir()) /
                  ("filigree_export_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
        fs::remove_all(folder_);
        fs::create_directories(folder_);
    }
    void TearDown() override { fs::remove_all(folder_); }
    fs::path file(const std::string& name = "a.glb") const { return folder_ / name; }

    static json document(const fs::path& path) {
        const std::string bytes = read_file(path).value();
        std::uint32_t length = 0;
        std::memcpy(&length, bytes.data() + 12, 4);
        return json::parse(bytes.substr(20, length));
    }
    ExportReport skin(const Model& model, const PoseSequence& poses, const SkinOptions& options = {}) {
        const Result<ExportReport> report = write_skin_glb(model, frames_of(poses), options, file(), kAllThreads);
        EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
        return report.ok() ? *report : ExportReport{};
    }

private:
    fs::path folder_;
};

/// Largest distance of a file's animation from the restore at one moment, as a fraction of the diagonal.
double distance(const fs::path& path, const Model& model, const Pose& pose, double seconds) {
    const GltfScene scene = GltfScene::read(path, kAllThreads).value();
    std::vector<Vec3f> played(scene.mesh().vertex_count());
    EXPECT_TRUE(scene.positions(0, seconds, played, kAllThreads).ok());
    const Restorer restorer = Restorer::create(model, {}, kAllThreads).value();
    const std::vector<Vec3f> restored = restorer.positions(pose, kAllThreads).value();
    double largest = 0;
    for (std::size_t v = 0; v < restored.size(); ++v)
        largest = std::max<double>(largest, (played[v] - restored[v]).norm());
    return largest / bounds(model.mesh.positions).diagonal();
}

TEST_F(GltfExport, SkinPlaysWhatWeRestore) {
    const PoseSequence poses = make_poses(wavy_model(), 13, 24);
    for (const unsigned influences : {3u, 6u})
        for (const bool full_precision : {true, false}) {
            const ExportReport report =
                skin(wavy_model(), poses, {.influences = influences, .full_precision = full_precision});
            EXPECT_LT(report.error_at_keys, full_precision ? 5e-7 : 1e-5);
            EXPECT_EQ(report.keys, 13u);
            EXPECT_EQ(report.moments_checked, 13u + 12u);
            EXPECT_DOUBLE_EQ(report.seconds, 0.5);
            EXPECT_EQ(report.bytes, fs::file_size(file()));
            for (const std::size_t frame : {0u, 5u, 12u})
                EXPECT_LE(distance(file(), wavy_model(), poses.frames[frame], double(frame) / 24),
                          report.error_at_keys * 1.01 + 1e-7);
        }
}

TEST_F(GltfExport, CompressedKeysKeepTheErrorAskedFor) {
    const PoseSequence poses = make_poses(wavy_model(), 25, 24);
    std::size_t before = skin(wavy_model(), poses).bytes;
    for (const double error : {1e-6, 1e-5, 1e-4, 1e-3}) {
        const ExportReport report = skin(wavy_model(), poses, {.compress = true, .key_error = error});
        EXPECT_LE(report.error_at_keys, error + 7e-6) << "positions are rounded too";
        EXPECT_LT(report.bytes, before) << error;
        before = report.bytes;
        const json file = document(this->file());
        std::vector<std::string> filters;
        for (const json& view : file["bufferViews"])
            if (view.contains("extensions"))
                filters.push_back(view["extensions"]["EXT_meshopt_compression"].value("filter", ""));
        for (const char* filter : {"EXPONENTIAL", "QUATERNION"})
            EXPECT_EQ(std::ranges::count(filters, filter), 1) << filter;
    }
    for (const double error : {0.0, 0.2, double(NAN)})
        EXPECT_EQ(write_skin_glb(wavy_model(), frames_of(poses), {.key_error = error}, file("b.glb")).error().code,
                  ErrorCode::usage);
}

TEST_F(GltfExport, SkinAtRestIsTheMesh) {
    skin(wavy_model(), make_poses(wavy_model(), 5, 24));
    const GltfScene scene = GltfScene::read(file(), kAllThreads).value();
    ASSERT_EQ(scene.mesh().vertex_count(), wavy_model().mesh.vertex_count());
    for (std::size_t v = 0; v < scene.mesh().vertex_count(); ++v)
        ASSERT_LT((scene.mesh().positions[v] - wavy_model().mesh.positions[v]).norm(), 3e-7) << v;
}

TEST_F(GltfExport, InterpolationIsAsGoodAsOfTheDriver) {
    const PoseSequence poses = make_poses(wavy_model(), 25, 48);
    const ExportReport report = skin(wavy_model(), poses, {.full_precision = true});
    // Between neighbouring frames the truth is the restore of the driver half way: only rotations differ.
    EXPECT_LT(report.error_between_keys, 2e-4);
    EXPECT_GT(report.error_between_keys, report.error_at_keys);
}

TEST_F(GltfExport, CubicKeysComeCloserWhereKeysAreSparse) {
    const PoseSequence poses = make_poses(wavy_model(), 49, 48);
    const ExportReport linear = skin(wavy_model(), poses, {.key_rate = 8});
    const ExportReport cubic = skin(wavy_model(), poses, {.key_rate = 8, .interpolation = KeyInterpolation::cubic});
    EXPECT_EQ(linear.keys, 9u);
    EXPECT_EQ(cubic.keys, 9u);
    // The largest error is where two singular values cross between keys, which no interpolation of rotations follows.
    EXPECT_LT(cubic.error_between_keys, linear.error_between_keys / 2);
    EXPECT_LT(cubic.rms_between_keys, linear.rms_between_keys / 8);
    // Cubic keys are floats, so at most: two rotations by 1.2e-7 each, a scale by 6e-8, a place and its inverse at rest
    // by 1e-7 to 2e-7 each. Which part of that is reached depends on the roundings of the singular values.
    EXPECT_LT(cubic.error_at_keys, 1e-6);
}

TEST_F(GltfExport, TheLastFrameIsAKeyAtAnyRate) {
    const PoseSequence poses = make_poses(wavy_model(), 11, 30); // a third of a second
    const ExportReport report = skin(wavy_model(), poses, {.key_rate = 7});
    EXPECT_EQ(report.keys, 4u); // 0, 1/7, 2/7 and the end
    EXPECT_LT(distance(file(), wavy_model(), poses.frames.back(), 10.0 / 30), 1e-5);
}

TEST_F(GltfExport, OneFrameIsAPicture) {
    const PoseSequence poses = make_poses(wavy_model(), 1, 30);
    for (const KeyInterpolation interpolation : {KeyInterpolation::linear, KeyInterpolation::cubic}) {
        const ExportReport report = skin(wavy_model(), poses, {.interpolation = interpolation});
        EXPECT_EQ(report.keys, 1u);
        EXPECT_LT(distance(file(), wavy_model(), poses.frames[0], 0), 1e-5);
    }
}

/// The rule that keeps Blender from baking another bind pose: default rotation and place of every joint times its
/// inverse bind matrix is one matrix for all of them.
TEST_F(GltfExport, JointsFulfilBlendersRule) {
    for (const unsigned influences : {3u, 6u}) {
        skin(wavy_model(), make_poses(wavy_model(), 3, 24), {.influences = influences});
        const json doc = document(file());
        const std::string bytes = read_file(file()).value();
        const json& binds = doc["accessors"][doc["skins"][0]["inverseBindMatrices"].get<std::size_t>()];
        const json& view = doc["bufferViews"][binds["bufferView"].get<std::size_t>()];
        std::uint32_t json_length = 0;
        std::memcpy(&json_length, bytes.data() + 12, 4);
        const char* data = bytes.data() + 28 + json_length + view["byteOffset"].get<std::size_t>();
        std::size_t j = 0;
        for (const json& joint : doc["skins"][0]["joints"]) {
            const auto inner = joint.get<std::size_t>();
            const json& outer = doc["nodes"][inner - 1];
            ASSERT_EQ(outer["children"], json::array({inner}));
            ASSERT_FALSE(outer.contains("rotation"));
            ASSERT_FALSE(doc["nodes"][inner].contains("rotation"));
            float bind[16];
            std::memcpy(bind, data + 64 * j++, sizeof bind);
            for (int k = 0; k < 3; ++k) // column 3 of the product: translations cancel
                ASSERT_EQ(outer["translation"][k].get<float>() + bind[12 + k], 0);
            for (int k = 0; k < 12; ++k) ASSERT_EQ(bind[k], k % 5 == 0 ? 1 : 0);
        }
        EXPECT_EQ(j, doc["skins"][0]["joints"].size());
    }
}

TEST_F(GltfExport, JointNumbersAreAsSmallAsTheyCanBe) {
    for (const std::size_t base : {200u, 400u}) {
        const Model model = strip(make_wavy_cube({.resolution = 16}), {.base = base}, kAllThreads).value().model;
        skin(model, make_poses(model, 2, 24));
        const json doc = document(file());
        const std::size_t joints = doc["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"];
        EXPECT_EQ(doc["accessors"][joints]["componentType"], model.driver().vertices.size() <= 256 ? 5121 : 5123);
    }
}

TEST_F(GltfExport, WhatStaysAtRestTakesNoRoom) {
    PoseSequence poses = make_poses(wavy_model(), 1, 24);
    Pose rest = rest_pose(wavy_model());
    rest.gradients.assign(rest.positions.size(), Mat3f::Identity());
    poses.frames = {rest, rest, rest};
    for (Vec3f& p : poses.frames[2].positions) p += Vec3f(1, 0, 0);
    const ExportReport report = skin(wavy_model(), poses);
    const json doc = document(file());
    for (const json& channel : doc["animations"][0]["channels"]) EXPECT_EQ(channel["target"]["path"], "translation");
    EXPECT_LT(report.error_between_keys, 1e-6);

    poses.frames.pop_back(); // nothing moves at all
    EXPECT_LT(skin(wavy_model(), poses).error_at_keys, 1e-6);
    EXPECT_FALSE(document(file()).contains("animations"));
}

TEST_F(GltfExport, LevelsShareTheJoints) {
    const PoseSequence poses = make_poses(wavy_model(), 3, 24);
    for (const unsigned influences : {3u, 6u}) {
        skin(wavy_model(), poses, {.influences = influences, .all_levels = true});
        const json doc = document(file());
        EXPECT_EQ(doc["meshes"].size(), wavy_model().finest_level() + 1u);
        const json& ids = doc["nodes"][0]["extensions"]["MSFT_lod"]["ids"];
        ASSERT_EQ(ids.size(), wavy_model().finest_level());
        for (const json& id : ids) EXPECT_EQ(doc["nodes"][id.get<std::size_t>()]["skin"], 0);
        const std::size_t coarsest = doc["nodes"][ids.back().get<std::size_t>()]["mesh"];
        const std::size_t position = doc["meshes"][coarsest]["primitives"][0]["attributes"]["POSITION"];
        EXPECT_EQ(doc["accessors"][position]["count"], wavy_model().driver().vertices.size());
        EXPECT_EQ(doc["extensionsUsed"], json::array({"MSFT_lod"}));
        EXPECT_LT(distance(file(), wavy_model(), poses.frames[2], 2.0 / 24), 1e-5);
    }
}

TEST_F(GltfExport, ACoarserLevelCanBeTheFinest) {
    const unsigned level = 1;
    const PoseSequence poses = make_poses(wavy_model(), 3, 24);
    const ExportReport report = skin(wavy_model(), poses, {.restore = {.level = level}});
    EXPECT_EQ(report.vertices, wavy_model().levels[level].vertices.size());
    EXPECT_LT(report.error_at_keys, 1e-5);
}

TEST_F(GltfExport, FarFromTheOriginKeepsItsDigits) {
    Mesh mesh = make_wavy_cube({.resolution = 12});
    mesh.origin = Vec3d(500000, 4100000, 30);
    const Model model = strip(std::move(mesh), {.base = 80}, kAllThreads).value().model;
    const PoseSequence poses = make_poses(model, 3, 24);
    const ExportReport report = skin(model, poses);
    EXPECT_LT(report.error_at_keys, 1e-5);
    EXPECT_EQ(document(file())["nodes"][1]["translation"], json::array({500000.0, 4100000.0, 30.0}));
}

TEST_F(GltfExport, TellsHowFarNormalsMayBeOff) {
    const Model& model = wavy_model();
    Pose rest = rest_pose(model);
    rest.gradients.assign(rest.positions.size(), Mat3f::Identity());
    EXPECT_NEAR(skin(model, {24, {rest}}).normal_error_degrees, 0, 1e-4);
    for (Mat3f& gradient : rest.gradients) gradient.diagonal() = Vec3f(2, 1, 1);
    for (Vec3f& p : rest.positions) p[0] *= 2;
    EXPECT_NEAR(skin(model, {24, {rest}}).normal_error_degrees, 36.87, 0.01); // atan 2 - atan 1/2
}

TEST_F(GltfExport, SaysAboutItselfWhatItMeasured) {
    const ExportReport report = skin(wavy_model(), make_poses(wavy_model(), 4, 24));
    const json stored = json::parse(GltfScene::read(file(), kAllThreads).value().export_report());
    EXPECT_EQ(stored["error_at_keys"], report.error_at_keys);
    EXPECT_EQ(stored["error_between_keys"], report.error_between_keys);
    EXPECT_EQ(stored["joints"], report.joints);
}

TEST_F(GltfExport, RefusesWhatItCannotWrite) {
    const Model& model = wavy_model();
    const auto refused = [&](const PoseSequence& poses, const SkinOptions& options) {
        const Result<ExportReport> report = write_skin_glb(model, frames_of(poses), options, file(), kAllThreads);
        EXPECT_FALSE(report.ok());
        EXPECT_FALSE(fs::exists(file()));
        return report.ok() ? ErrorCode{} : report.error().code;
    };
    const PoseSequence poses = make_poses(model, 2, 24);
    EXPECT_EQ(refused({}, {}), ErrorCode::unsuitable);
    EXPECT_EQ(refused(poses, {.restore = {.level = 99}}), ErrorCode::usage);
    EXPECT_EQ(refused(poses, {.key_rate = 0}), ErrorCode::usage);
    EXPECT_EQ(refused(poses, {.influences = 4}), ErrorCode::usage);
    EXPECT_EQ(refused(make_poses(model, 100, 24), {.key_rate = 1e6}), ErrorCode::unsupported); // 17 GB, found at once
    PoseSequence other = poses;
    other.frames[1].positions.pop_back();
    EXPECT_EQ(refused(other, {}), ErrorCode::mismatch);
    RunContext cancelled;
    cancelled.cancel();
    EXPECT_EQ(write_skin_glb(model, frames_of(poses), {}, file(), cancelled).error().code, ErrorCode::cancelled);
    EXPECT_FALSE(fs::exists(file()));
}

TEST_F(GltfExport, ADriverThatLeftAsAnAnimationComesBackAsPoses) {
    const Model& model = wavy_model();
    const PoseSequence poses = make_poses(model, 7, 24);
    skin(model, poses, {.restore = {.level = 0}, .full_precision = true});
    const Result<FrameSource<Pose>> back =
        open_poses(file(), model.driver().vertices.size(), model.mesh.origin, {.frames_per_second = 24}, kAllThreads);
    ASSERT_TRUE(back.ok()) << back.error().message;
    ASSERT_EQ(back->frames, 7u);
    for (const std::size_t frame : {0u, 3u, 6u}) {
        const Pose pose = back->frame(frame).value();
        for (std::size_t i = 0; i < pose.positions.size(); ++i)
            ASSERT_LT((pose.positions[i] - poses.frames[frame].positions[i]).norm(), 1e-6);
    }
    const Result<FrameSource<Pose>> other = open_poses(file(), 3, Vec3d::Zero(), {}, kAllThreads);
    ASSERT_FALSE(other.ok());
    EXPECT_EQ(other.error().code, ErrorCode::mismatch);
}

TEST_F(GltfExport, MorphTargetsHoldEveryFrame) {
    const Mesh& mesh = wavy_model().mesh;
    const PoseSequence poses = make_poses(wavy_model(), 5, 24);
    const Restorer restorer = Restorer::create(wavy_model(), {}, kAllThreads).value();
    const MeshAnimation animation{&mesh, 5, 24, [&](std::size_t frame, std::span<Vec3f> out) {
                                      return restorer.positions(poses.frames[frame], out, kAllThreads);
                                  }};
    for (const bool normals : {false, true}) {
        const ExportReport report = write_morph_glb(animation, {.morph_normals = normals}, file(), kAllThreads).value();
        EXPECT_LT(report.error_at_keys, 2e-7);
        EXPECT_EQ(report.bytes, fs::file_size(file()));
        for (const std::size_t frame : {0u, 3u, 4u})
            EXPECT_LT(distance(file(), wavy_model(), poses.frames[frame], double(frame) / 24), 3e-7);
        const json target = document(file())["meshes"][0]["primitives"][0]["targets"][0];
        EXPECT_EQ(target.contains("NORMAL"), normals);
    }
}

TEST_F(GltfExport, MorphTargetsOfTooManyBytesAreRefusedBeforeTheWork) {
    const Mesh& mesh = wavy_model().mesh;
    bool asked = false;
    const MeshAnimation animation{&mesh, 1u << 20, 24, [&](std::size_t, std::span<Vec3f>) -> Status {
                                      asked = true;
                                      return Success{};
                                  }};
    EXPECT_EQ(write_morph_glb(animation, {}, file(), kAllThreads).error().code, ErrorCode::unsupported);
    EXPECT_FALSE(asked);
    EXPECT_FALSE(fs::exists(file()));
}

} // namespace
} // namespace filigree
