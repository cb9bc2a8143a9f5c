#include "filigree/io/animation/point_cache.h"

#include "filigree/blend/pose_mesh.h"
#include "filigree/file.h"
#include "filigree/io/model/model_file.h"
#include "filigree/io/system/file.h"
#include "filigree/mesh.h"
#include "filigree/strip.h"
#include "io/gltf_text.h"
#include "io/sample_meshes.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <thread>

#include <sys/stat.h>
#include <unistd.h>

using namespace filigree;
namespace fs = std::filesystem;

namespace {

/// Frame k of anything: no two numbers alike, and some that only 32 bits hold.
Vec3f moved(const Vec3f& p, std::size_t frame, std::size_t vertex) {
    const auto k = static_cast<float>(frame);
    return {p.x() + k / 3, p.y() * (1 + k), p.z() - 1e-20f * static_cast<float>(vertex)};
}

/// The mesh moving; `broken` is a frame with a NaN.
MeshAnimation moving(const Mesh& rest, std::size_t frames, double rate = 60, std::size_t broken = kNoIndex) {
    return {&rest, frames, rate, [&rest, broken](std::size_t frame, std::span<Vec3f> positions) -> Status {
                for (std::size_t v = 0; v < positions.size(); ++v) positions[v] = moved(rest.positions[v], frame, v);
                if (frame == broken) positions[1].y() = std::nanf("");
                return Success{};
            }};
}

std::vector<Vec3f> frame_of(const MeshAnimation& animation, std::size_t frame) {
    std::vector<Vec3f> positions(animation.rest->vertex_count());
    EXPECT_TRUE(animation.positions(frame, positions).ok());
    return positions;
}

std::string little(std::initializer_list<std::int32_t> words) {
    return {reinterpret_cast<const char*>(words.begin()), 4 * words.size()};
}
std::string turned(std::string bytes) {
    for (std::size_t i = 0; i + 3 < bytes.size(); i += 4)
        std::reverse(bytes.begin() + long(i), bytes.begin() + long(i) + 4);
    return bytes;
}
std::string floats(std::initializer_list<float> values) {
    return {reinterpret_cast<const char*>(values.begin()), 4 * values.size()};
}

class PointCache : public testing::Test {
protected:
    PointCache() {
        std::string name = (fs::temp_directory_path() / "filigree-XXXXXX").string();
        folder_ = ::mkdtemp(name.data());
    }
    ~PointCache() override { fs::remove_all(folder_); }

    std::string path(const std::string& name) const { return (folder_ / name).string(); }
    std::string put(const std::string& name, const std::string& bytes) const {
        EXPECT_TRUE(write_file(path(name), bytes).ok());
        return path(name);
    }
    std::size_t files() const {
        return std::size_t(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
    }
    /// Opening fails so, with these words in one sentence.
    void refuses(const std::string& file, std::size_t points, ErrorCode code, const std::vector<std::string>& words,
                 const PoseFileOptions& options = {}) const {
        SCOPED_TRACE(file);
        const auto poses = open_poses(file, points, Vec3d::Zero(), options, kOneThread);
        ASSERT_FALSE(poses.ok());
        says(poses.error(), code, words);
    }
    static void says(const Error& error, ErrorCode code, const std::vector<std::string>& words) {
        EXPECT_EQ(error.code, code) << error.message;
        EXPECT_TRUE(error.message.ends_with(".")) << error.message;
        for (const std::string& word : words)
            EXPECT_NE(error.message.find(word), std::string::npos) << word << " in " << error.message;
    }

    fs::path folder_;
    Mesh mesh_ = filigree_test::make_vertex_attribute_mesh();
};

} // namespace

TEST_F(PointCache, NamesTellTheFormat) {
    EXPECT_EQ(*animation_format("a/b.PC2"), AnimationFormat::pc2);
    EXPECT_EQ(*animation_format("b.mdd"), AnimationFormat::mdd);
    EXPECT_EQ(*animation_format("b.usda"), AnimationFormat::usda);
    EXPECT_EQ(*animation_format("b.glb"), AnimationFormat::glb);
    EXPECT_EQ(*animation_format("new/"), AnimationFormat::numbered);
    EXPECT_EQ(*animation_format(folder_), AnimationFormat::numbered);
    EXPECT_EQ(*animation_format("m_####.obj"), AnimationFormat::numbered);
    EXPECT_EQ(*animation_format("m_%04d.ply"), AnimationFormat::numbered);
    for (const char* name : {"a.ply", "a", "-", "a.usdc", "a.fil", "a.gltf", "m_####.xyz", ""}) {
        ASSERT_FALSE(animation_format(name).ok()) << name;
        EXPECT_EQ(animation_format(name).error().code, ErrorCode::unsupported) << name;
    }
}

TEST_F(PointCache, Pc2IsWhatItsDescriptionSays) {
    Mesh rest;
    rest.positions = {{1, 2, 3}, {4, 5, 6}};
    const MeshAnimation animation{&rest, 2, 60, [](std::size_t frame, std::span<Vec3f> positions) -> Status {
                                      positions[0] = Vec3f(1, 2, 3) * float(frame + 1);
                                      positions[1] = Vec3f(4, 5, 6);
                                      return Success{};
                                  }};
    ASSERT_TRUE(write_animation(animation, path("a.pc2"), kOneThread).ok());
    const std::string expected = std::string("POINTCACHE2\0", 12) + little({1, 2}) + floats({0, 1}) + little({2}) +
                                 floats({1, 2, 3, 4, 5, 6, 2, 4, 6, 4, 5, 6});
    EXPECT_TRUE(*read_file(path("a.pc2")) == expected);
    ASSERT_TRUE(write_animation(animation, path("a.mdd"), kOneThread).ok());
    const std::string big =
        turned(little({2, 2}) + floats({0, 1.0f / 60}) + floats({1, 2, 3, 4, 5, 6, 2, 4, 6, 4, 5, 6}));
    EXPECT_TRUE(*read_file(path("a.mdd")) == big);
}

TEST_F(PointCache, EveryFormatComesBackToTheBit) {
    constexpr std::size_t kFrames = 12;
    for (const char* name : {"a.pc2", "a.mdd", "folder/", "n_####.ply", "n_%d.obj", "deeper/still/n_##.off"}) {
        SCOPED_TRACE(name);
        ASSERT_TRUE(write_animation(moving(mesh_, kFrames, 25), path(name), kOneThread).ok());
        const auto back = open_animation(path(name), mesh_, {.frames_per_second = 25}, kOneThread);
        ASSERT_TRUE(back.ok()) << back.error().message;
        EXPECT_EQ(back->frames, kFrames);
        EXPECT_EQ(back->frames_per_second, 25);
        for (const std::size_t frame : {11, 0, 5, 5}) // any order, and again
            EXPECT_TRUE(frame_of(*back, frame) == frame_of(moving(mesh_, kFrames), frame));
        const auto poses = open_poses(path(name), mesh_.vertex_count(), mesh_.origin, {}, kOneThread);
        ASSERT_TRUE(poses.ok());
        const Result<Pose> pose = poses->frame(3);
        ASSERT_TRUE(pose.ok());
        EXPECT_TRUE(pose->positions == frame_of(moving(mesh_, kFrames), 3));
        EXPECT_TRUE(pose->gradients.empty());
    }
    EXPECT_TRUE(fs::exists(path("folder/folder_0012.ply")));
    EXPECT_TRUE(fs::exists(path("n_12.obj")));
}

TEST_F(PointCache, RatesAreTheFilesOrTheOptions) {
    const auto rate = [&](const std::string& name, std::optional<double> option) {
        const auto poses =
            open_poses(path(name), mesh_.vertex_count(), mesh_.origin, {.frames_per_second = option}, kOneThread);
        return poses.ok() ? poses->frames_per_second : -1;
    };
    ASSERT_TRUE(write_animation(moving(mesh_, 700, 30), path("a.mdd"), kOneThread).ok());
    EXPECT_EQ(rate("a.mdd", {}), 30); // not 29.99999
    EXPECT_EQ(rate("a.mdd", 24), 24);
    ASSERT_TRUE(write_animation(moving(mesh_, 40, 23.976), path("b.mdd"), kOneThread).ok());
    EXPECT_NEAR(rate("b.mdd", {}), 23.976, 1e-4);
    ASSERT_TRUE(write_animation(moving(mesh_, 3, 30), path("a.pc2"), kOneThread).ok());
    EXPECT_EQ(rate("a.pc2", {}), 60);
    EXPECT_EQ(rate("a.pc2", 24), 24);
    std::string every_other = *read_file(path("a.pc2"));
    const float two = 2;
    std::memcpy(every_other.data() + 24, &two, 4); // the sample rate
    put("a.pc2", every_other);
    EXPECT_EQ(rate("a.pc2", 24), 12);
    EXPECT_EQ(rate("a.pc2", 0.0), -1);
    EXPECT_EQ(rate("a.pc2", NAN), -1);
}

TEST_F(PointCache, DamagedPc2IsRefused) {
    const std::string magic("POINTCACHE2\0", 12);
    const auto header = [&](std::int32_t version, std::int32_t points, float start, float rate, std::int32_t frames) {
        return magic + little({version, points}) + floats({start, rate}) + little({frames});
    };
    const std::string frame = floats({1, 2, 3, 4, 5, 6});
    ASSERT_TRUE(open_poses(put("a.pc2", header(1, 2, -5, 0.5f, 1) + frame), 2, Vec3d::Zero(), {}, kOneThread).ok());
    const auto bad = [&](const std::string& bytes, const std::vector<std::string>& words,
                         ErrorCode code = ErrorCode::bad_file) { refuses(put("a.pc2", bytes), 2, code, words); };
    bad("", {"too short"});
    bad(header(1, 2, 0, 1, 1).substr(0, 31), {"too short"});
    bad("POINTCACHE3" + header(1, 2, 0, 1, 1).substr(11) + frame, {"POINTCACHE2"});
    bad(header(2, 2, 0, 1, 1) + frame, {"version 2"}, ErrorCode::unsupported);
    bad(header(1, 0, 0, 1, 1), {"0 points"});
    bad(header(1, -2, 0, 1, 1) + frame, {"-2 points"});
    bad(header(1, 2, 0, 1, 0), {"0 frames"});
    bad(header(1, 2, 0, 1, -1) + frame, {"-1 frames"});
    bad(header(1, 2, 0, 1, 1) + frame.substr(1), {"1 frame", "56 bytes", "55", "cut off"});
    bad(header(1, 2, 0, 1, 1) + frame + "x", {"57"});
    bad(header(1, 2, 0, 1, 2) + frame, {"2 frames"});
    bad(header(1, 2147483647, 0, 1, 2147483647), {"2147483647"});
    bad(header(1, 1073741825, 0, 1, 4) + frame, {"damaged"}); // the product passes 32 bits
    bad(header(1, 2, NAN, 1, 1) + frame, {"start frame"});
    bad(header(1, 2, 0, INFINITY, 1) + frame, {"sample rate"});
    bad(header(1, 2, 0, 0, 1) + frame, {"sample rate"});
    bad(header(1, 2, 0, -1, 1) + frame, {"sample rate"});
    bad(header(1, 1, 0, 1, 2) + frame, {"1 point,", "has 2", "another mesh"}, ErrorCode::mismatch);
}

TEST_F(PointCache, DamagedMddIsRefused) {
    const std::string frame = floats({1, 2, 3, 4, 5, 6});
    const auto bad = [&](const std::string& bytes, const std::vector<std::string>& words,
                         ErrorCode code = ErrorCode::bad_file) {
        refuses(put("a.mdd", turned(bytes)), 2, code, words);
    };
    ASSERT_TRUE(
        open_poses(put("a.mdd", turned(little({1, 2}) + floats({0}) + frame)), 2, Vec3d::Zero(), {}, kOneThread).ok());
    bad("", {"too short"});
    bad(little({1}), {"too short"});
    bad(little({0, 2}), {"0 frames"});
    bad(little({-1, 2}) + frame, {"-1 frames"});
    bad(little({1, 0}) + floats({0}), {"0 points"});
    bad(little({1, 2}) + floats({0}) + frame.substr(4), {"cut off"});
    bad(little({2147483647, 2147483647}), {"2147483647"});
    bad(turned(little({1, 2}) + floats({0}) + frame), {"damaged"}); // little-endian
    bad(little({2, 1}) + floats({0, 1}) + frame, {"1 point,"}, ErrorCode::mismatch);
    bad(little({1, 2}) + floats({NAN}) + frame, {"times"});
    bad(little({3, 2}) + floats({0, 1, 5}) + frame + frame + frame, {"evenly"}, ErrorCode::unsupported);
    bad(little({2, 2}) + floats({1, 0}) + frame + frame, {"evenly"}, ErrorCode::unsupported);
    const auto forced = open_poses(put("a.mdd", turned(little({2, 2}) + floats({1, 0}) + frame + frame)), 2,
                                   Vec3d::Zero(), {.frames_per_second = 10}, kOneThread);
    ASSERT_TRUE(forced.ok());
    EXPECT_EQ(forced->frames_per_second, 10);
    const auto unsaid = open_poses(put("a.mdd", turned(little({2, 2}) + floats({0, 0}) + frame + frame)), 2,
                                   Vec3d::Zero(), {}, kOneThread);
    ASSERT_TRUE(unsaid.ok());
    EXPECT_EQ(unsaid->frames_per_second, 60);
}

TEST_F(PointCache, NumbersThatAreNotFiniteAreFoundWhenTheirFrameIs) {
    const std::string good = floats({1, 2, 3, 4, 5, 6}), bad = floats({1, 2, 3, 4, INFINITY, 6});
    put("a.pc2", std::string("POINTCACHE2\0", 12) + little({1, 2}) + floats({0, 1}) + little({2}) + good + bad);
    const auto poses = open_poses(path("a.pc2"), 2, Vec3d::Zero(), {}, kOneThread);
    ASSERT_TRUE(poses.ok());
    EXPECT_TRUE(poses->frame(0).ok());
    ASSERT_FALSE(poses->frame(1).ok());
    says(poses->frame(1).error(), ErrorCode::bad_file, {"a.pc2", "frame 2", "point 1"});
    // cut off after it was opened
    ASSERT_EQ(::truncate(path("a.pc2").c_str(), 70), 0);
    EXPECT_TRUE(poses->frame(0).ok());
    says(poses->frame(1).error(), ErrorCode::not_found, {"a.pc2", "became shorter"});
}

TEST_F(PointCache, OnlyFilesAreOpened) {
    refuses(path("missing.pc2"), 2, ErrorCode::not_found, {"missing.pc2", "no such file"});
    fs::create_directory(path("folder.pc2"));
    refuses(path("folder.pc2"), 2, ErrorCode::not_found, {"folder"});
    ASSERT_EQ(::mkfifo(path("pipe.pc2").c_str(), 0600), 0);
    refuses(path("pipe.pc2"), 2, ErrorCode::unsupported, {"pipe", "file first"}); // and does not wait for a writer
    refuses("-", 2, ErrorCode::unsupported, {".pc2"});
    refuses(put("a.usda", "#usda 1.0"), 2, ErrorCode::unsuitable, {"no mesh"});
    refuses(put("a.usdc", "PXR-USDC"), 2, ErrorCode::unsupported, {"binary USD", "usdcat", ".pc2"});
    refuses(put("a.abc", "Ogawa"), 2, ErrorCode::unsupported, {"Alembic", "Blender", ".pc2"});
    refuses(put("a.ply", "ply"), 2, ErrorCode::unsupported, {".mdd"});
}

TEST_F(PointCache, NumberedMeshesMustBeWhole) {
    ASSERT_TRUE(write_animation(moving(mesh_, 4), path("n/m_####.ply"), kOneThread).ok());
    const std::size_t points = mesh_.vertex_count();
    ASSERT_TRUE(open_poses(path("n"), points, Vec3d::Zero(), {}, kOneThread).ok());
    // others in the folder: no mesh, no number, hidden
    put("n/notes_1.txt", "x"), put("n/rest.ply", "x"), put("n/.m_0009.ply", "x"), put("n/m_0009b.ply", "x");
    EXPECT_EQ(open_poses(path("n"), points, Vec3d::Zero(), {}, kOneThread)->frames, 4u);

    refuses(path("n"), points + 1, ErrorCode::mismatch, {"m_0001.ply", "8 vertices", "has 9"});
    put("n/other_0001.ply", "x");
    refuses(path("n"), points, ErrorCode::usage, {"m_####.ply", "other_####.ply", "name one"});
    EXPECT_TRUE(open_poses(path("n/m_####.ply"), points, Vec3d::Zero(), {}, kOneThread).ok());
    EXPECT_TRUE(open_poses(path("n/m_%04d.ply"), points, Vec3d::Zero(), {}, kOneThread).ok());
    refuses(path("n/x_####.ply"), points, ErrorCode::not_found, {"x_0001.ply"});
    refuses(path("missing/"), points, ErrorCode::not_found, {"missing"});
    put("n/m_3.ply", "x");
    refuses(path("n/m_####.ply"), points, ErrorCode::usage, {"m_3.ply", "m_0003.ply"});
    fs::remove(path("n/m_3.ply"));
    fs::remove(path("n/m_0003.ply"));
    refuses(path("n/m_####.ply"), points, ErrorCode::not_found, {"m_0003.ply", "missing", "4"});
    fs::create_directory(path("empty"));
    refuses(path("empty"), points, ErrorCode::not_found, {"no numbered meshes"});
}

TEST_F(PointCache, NumberedPlyGivesGradients) {
    Mesh mesh = filigree_test::make_plain_mesh();
    Pose pose{mesh.positions, {}};
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
        pose.gradients.push_back((Mat3f() << 1, float(v), 2, 3, 4, 5, 6, 7, 8).finished());
    const auto with_gradients = [&](std::size_t frame) -> Result<Mesh> {
        Mesh moved = mesh;
        if (frame != 2) add_gradients(moved, pose);
        return moved;
    };
    ASSERT_TRUE(write_numbered_meshes({3, 60, with_gradients}, path("g/"), kOneThread).ok());
    const auto poses = open_poses(path("g"), mesh.vertex_count(), Vec3d::Zero(), {}, kOneThread);
    ASSERT_TRUE(poses.ok());
    EXPECT_TRUE(poses->frame(1)->gradients == pose.gradients);
    says(poses->frame(2).error(), ErrorCode::mismatch, {"g_0003.ply", "no gradients"});
}

TEST_F(PointCache, NumberedMeshesOfOneFolderComeTogetherOrNotAtAll) {
    const Mesh mesh = make_wavy_plane({.resolution = 3});
    std::size_t broken = kNoIndex;
    const auto frame_of = [&](std::size_t frame) {
        Mesh moved = mesh;
        moved.positions[0].x() = frame == broken ? std::nanf("") : float(frame);
        return Result<Mesh>(moved);
    };
    const std::vector<NumberedMeshes> parts = {{{path("both"), "a#1_", ".ply"}, {3, 60, frame_of}},
                                               {{path("both"), "b_", ".ply"}, {3, 60, frame_of}}};
    ASSERT_TRUE(write_numbered_meshes(parts, kOneThread).ok());
    EXPECT_TRUE(fs::exists(path("both/a#1_0003.ply"))); // the name is known: no '#' stands for a number
    EXPECT_TRUE(fs::exists(path("both/b_0003.ply")));
    const std::string before = read_file(path("both/a#1_0002.ply")).value();
    broken = 2;
    says(write_numbered_meshes(parts, kOneThread).error(), ErrorCode::unsuitable, {"a#1_0003.ply"});
    EXPECT_EQ(read_file(path("both/a#1_0002.ply")).value(), before);
}

TEST_F(PointCache, NumberedMeshesKeepAttributes) {
    const Mesh rest = filigree_test::make_corner_attribute_mesh();
    ASSERT_TRUE(write_animation(moving(rest, 2), path("n_####.obj"), kOneThread).ok());
    const Result<MeshFile> second = read_mesh(path("n_0002.obj"), kOneThread);
    ASSERT_TRUE(second.ok());
    EXPECT_TRUE(second->mesh.uvs.corners == rest.uvs.corners);
    EXPECT_EQ(second->mesh.materials.names.size(), 2u);
    EXPECT_EQ(second->mesh.corners, rest.corners);
    EXPECT_EQ(second->mesh.normals.values.size(), rest.vertex_count()); // the frame's own
}

TEST_F(PointCache, ModelsPosesAreAnAnimationToo) {
    const Model model = strip(make_wavy_plane({.resolution = 6}), {.base = 9}, kOneThread).value().model;
    PoseSequence poses{24, {}};
    poses.frames.resize(2);
    for (Pose& pose : poses.frames) {
        pose.positions = driver_positions(model);
        pose.gradients.assign(pose.positions.size(), Mat3f::Identity());
    }
    ASSERT_TRUE(write_model(model, poses, path("m.fil"), kOneThread).ok());
    ASSERT_TRUE(write_model(model, path("still.fil"), kOneThread).ok());
    const std::size_t points = poses.frames[0].positions.size();
    const auto stream = open_poses(path("m.fil"), points, Vec3d::Zero(), {}, kOneThread);
    ASSERT_TRUE(stream.ok());
    EXPECT_EQ(stream->frames_per_second, 24);
    EXPECT_EQ(stream->frames, 2u);
    EXPECT_EQ(stream->frame(1)->gradients.size(), points);
    refuses(path("m.fil"), points + 1, ErrorCode::mismatch, {"another model"});
    refuses(path("still.fil"), points, ErrorCode::unsuitable, {"no poses"});
}

TEST_F(PointCache, FilesAreInTheWorld) {
    Mesh rest = filigree_test::make_plain_mesh();
    rest.origin = {1000, -2000, 0.5};
    for (Vec3f& p : rest.positions) p = Vec3f(p.array().max(-8).min(8).round()); // what 32 bits hold there too
    const MeshAnimation still{&rest, 1, 60, [&](std::size_t, std::span<Vec3f> positions) -> Status {
                                  std::copy(rest.positions.begin(), rest.positions.end(), positions.begin());
                                  return Success{};
                              }};
    EXPECT_TRUE(write_animation(still, path("a.pc2"), kOneThread)->empty());
    float x = 0;
    std::memcpy(&x, read_file(path("a.pc2"))->data() + 32, 4);
    EXPECT_EQ(x, 1000 + rest.positions[0].x());
    EXPECT_TRUE(frame_of(*open_animation(path("a.pc2"), rest, {}, kOneThread), 0) == rest.positions);
    rest.origin = {4e6, 0, 0};
    rest.positions[3].x() = 0.1f;
    const auto warnings = write_animation(still, path("a.pc2"), kOneThread);
    ASSERT_EQ(warnings->size(), 1u);
    EXPECT_NE((*warnings)[0].find("far from the world's origin"), std::string::npos);
}

TEST_F(PointCache, WhatFailsLeavesNothing) {
    for (const char* name : {"a.pc2", "a.mdd", "a.usda", "n_####.ply", "folder/", "new/er/n_####.ply"}) {
        SCOPED_TRACE(name);
        const auto nan = write_animation(moving(mesh_, 4, 60, 2), path(name), kOneThread);
        ASSERT_FALSE(nan.ok());
        says(nan.error(), ErrorCode::unsuitable, {"not written"});
        EXPECT_FALSE(write_animation(moving(mesh_, 0), path(name), kOneThread).ok());
        const RunContext cancelled(1);
        MeshAnimation stops = moving(mesh_, 4);
        stops.positions = [&, inner = stops.positions](std::size_t frame, std::span<Vec3f> positions) {
            if (frame == 2) cancelled.cancel();
            return inner(frame, positions);
        };
        const auto stopped = write_animation(stops, path(name), cancelled);
        ASSERT_FALSE(stopped.ok());
        EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
        EXPECT_FALSE(fs::exists(path(std::string(name) == "folder/" ? "folder" : name)));
        EXPECT_EQ(files(), 0u);
    }
    // and what was there stays
    put("a.pc2", "old");
    EXPECT_FALSE(write_animation(moving(mesh_, 4, 60, 2), path("a.pc2"), kOneThread).ok());
    EXPECT_EQ(*read_file(path("a.pc2")), "old");
    put("n_0001.ply", "old");
    EXPECT_FALSE(write_animation(moving(mesh_, 4, 60, 2), path("n_####.ply"), kOneThread).ok());
    EXPECT_EQ(*read_file(path("n_0001.ply")), "old");
    EXPECT_FALSE(write_animation(moving(mesh_, 1), path("missing/a.pc2"), kOneThread).ok());
    EXPECT_EQ(files(), 2u);
}

TEST_F(PointCache, PipesInASequenceAreRefused) {
    ASSERT_TRUE(write_animation(moving(mesh_, 3), path("n/m_####.ply"), kOneThread).ok());
    const auto poses = open_poses(path("n"), mesh_.vertex_count(), Vec3d::Zero(), {}, kOneThread);
    ASSERT_TRUE(poses.ok());
    fs::remove(path("n/m_0002.ply"));
    ASSERT_EQ(::mkfifo(path("n/m_0002.ply").c_str(), 0600), 0);
    says(poses->frame(1).error(), ErrorCode::unsupported, {"m_0002.ply", "pipe"}); // and does not wait for a writer
    fs::rename(path("n/m_0001.ply"), path("elsewhere.ply"));
    fs::create_symlink(path("elsewhere.ply"), path("n/m_0001.ply"));
    EXPECT_TRUE(poses->frame(0).ok()); // links are followed
}

TEST_F(PointCache, NumberedMeshesReplaceFilesAllOrNone) {
    put("n_0001.ply", "old"), put("n_0002.ply", "old");
    fs::permissions(path("n_0001.ply"), fs::perms(0640));
    const auto refused = [&](const std::vector<std::string>& words) {
        const auto written = write_animation(moving(mesh_, 3), path("n_####.ply"), kOneThread);
        ASSERT_FALSE(written.ok());
        says(written.error(), ErrorCode::unwritable, words);
        EXPECT_EQ(*read_file(path("n_0001.ply")), "old");
        EXPECT_EQ(*read_file(path("n_0002.ply")), "old");
    };
    fs::create_symlink(path("n_0001.ply"), path("n_0003.ply"));
    refused({"n_0003.ply", "symbolic link"});
    fs::remove(path("n_0003.ply"));
    ASSERT_EQ(::mkfifo(path("n_0003.ply").c_str(), 0600), 0);
    refused({"n_0003.ply", "pipe"});
    fs::remove(path("n_0003.ply"));
    EXPECT_EQ(files(), 2u);
    // found only when it is its turn: those before it are put back
    MeshAnimation late = moving(mesh_, 3);
    late.positions = [&, inner = late.positions](std::size_t frame, std::span<Vec3f> positions) {
        if (frame == 2) fs::remove(path("n_0002.ply")), fs::create_directory(path("n_0002.ply"));
        return inner(frame, positions);
    };
    EXPECT_FALSE(write_animation(late, path("n_####.ply"), kOneThread).ok());
    EXPECT_EQ(*read_file(path("n_0001.ply")), "old");
    EXPECT_EQ(files(), 2u);
    fs::remove(path("n_0002.ply"));
    ASSERT_TRUE(write_animation(moving(mesh_, 3), path("n_####.ply"), kOneThread).ok());
    EXPECT_EQ(fs::status(path("n_0001.ply")).permissions(), fs::perms(0640));
    EXPECT_EQ(files(), 3u);
}

TEST_F(PointCache, ManyTimesOfAnMddAreWrittenInPieces) {
    constexpr std::size_t kFrames = 40'000; // more than a piece holds
    Mesh rest;
    rest.positions = {{1, 2, 3}};
    ASSERT_TRUE(write_animation(moving(rest, kFrames, 50), path("a.mdd"), kOneThread).ok());
    const auto back = open_animation(path("a.mdd"), rest, {}, kOneThread);
    ASSERT_TRUE(back.ok()) << back.error().message;
    EXPECT_EQ(back->frames, kFrames);
    EXPECT_EQ(back->frames_per_second, 50);
    EXPECT_TRUE(frame_of(*back, kFrames - 1) == frame_of(moving(rest, kFrames), kFrames - 1));
}

TEST_F(PointCache, LongerSequencesFromBeforeAreTold) {
    ASSERT_TRUE(write_animation(moving(mesh_, 5), path("n_####.ply"), kOneThread)->size() <= 1);
    const auto warnings = write_animation(moving(mesh_, 2), path("n_####.ply"), kOneThread);
    ASSERT_TRUE(warnings.ok());
    ASSERT_FALSE(warnings->empty());
    EXPECT_NE(warnings->back().find("3 more of n_####.ply"), std::string::npos) << warnings->back();
}

TEST_F(PointCache, ASequenceHalfInItsPlacesIsNotReadUntilItIsWrittenAgain) {
    ASSERT_TRUE(write_animation(moving(mesh_, 4), path("n/m_####.ply"), kOneThread).ok());
    ASSERT_TRUE(write_animation(moving(mesh_, 4), path("n/other_####.ply"), kOneThread).ok());
    const std::string old = *read_file(path("n/m_0003.ply"));
    // a writer that was killed when frames 3 and 4 were still to come
    const fs::path batch = path("n/.filigree-0123456789abcdef-placing");
    fs::create_directories(batch / "new");
    for (const char* name : {"m_0003.ply", "m_0004.ply"}) ASSERT_TRUE(write_file(batch / "new" / name, "new").ok());
    const auto half = open_poses(path("n/m_####.ply"), mesh_.vertex_count(), Vec3d::Zero(), {}, kOneThread);
    ASSERT_FALSE(half.ok());
    says(half.error(), ErrorCode::bad_file, {"m_0001.ply", "2 files", "write the sequence again", batch.string()});
    EXPECT_TRUE(open_poses(path("n/other_####.ply"), mesh_.vertex_count(), Vec3d::Zero(), {}, kOneThread).ok());
    EXPECT_EQ(*read_file(path("n/m_0003.ply")), old);
    ASSERT_TRUE(write_file(batch / "lock", "").ok()); // as the writer made it
    ASSERT_TRUE(write_animation(moving(mesh_, 4), path("n/m_####.ply"), kOneThread).ok());
    EXPECT_TRUE(open_poses(path("n/m_####.ply"), mesh_.vertex_count(), Vec3d::Zero(), {}, kOneThread).ok());
    EXPECT_FALSE(fs::exists(batch));
}

TEST_F(PointCache, SequencesOfManyThreadsDoNotDisturbEachOther) {
    std::atomic<int> failures = 0;
    std::vector<std::thread> threads;
    for (const char* name : {"n/a_####.ply", "n/b_####.ply", "n/c_####.ply", "n/d_####.ply"})
        threads.emplace_back([&, name] {
            for (int round = 0; round < 4; ++round)
                if (!write_animation(moving(mesh_, 6), path(name), kOneThread).ok()) ++failures;
        });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(failures, 0);
    EXPECT_EQ(std::distance(fs::directory_iterator(path("n")), fs::directory_iterator()), 24);
}

TEST_F(PointCache, AClipOfGltfBeginsAtNoughtAndHoldsItsFirstKey) {
    filigree_test::GltfText file;
    file.add(filigree_test::kTriangle, "VEC3");
    file.add({1.5f, 2.5f}, "SCALAR");
    file.add({1, 0, 0, 2, 0, 0}, "VEC3");
    file.add({0, 0, 1, 0, 0, 2, 0, 0, 3}, "VEC3"); // of a morph target
    file.add({0.25f, 1}, "SCALAR");
    const auto clip = [&](const std::string& channel, const std::string& output) {
        return put(channel + ".gltf",
                   file.text(R"("nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},)"
                             R"("targets":[{"POSITION":3}]}]}],"animations":[{"channels":[{"sampler":0,)"
                             R"("target":{"node":0,"path":")" +
                             channel + R"("}}],"samplers":[{"input":1,"output":)" + output + "}]}]"));
    };
    for (const auto& [channel, output] : {std::pair{"translation", "2"}, std::pair{"weights", "4"}}) {
        const auto poses = open_poses(clip(channel, output), 3, Vec3d::Zero(), {.frames_per_second = 10}, kOneThread);
        ASSERT_TRUE(poses.ok()) << poses.error().message;
        EXPECT_EQ(poses->frames, 26u) << channel;
        const std::vector<Vec3f> held = poses->frame(15)->positions;
        EXPECT_EQ(poses->frame(0)->positions, held) << channel;
        EXPECT_NE(poses->frame(20)->positions, held) << channel;
    }
    EXPECT_EQ(open_poses(clip("translation", "2"), 3, Vec3d::Zero(), {.frames_per_second = 10}, kOneThread)
                  ->frame(20)
                  ->positions[0],
              Vec3f(1.5f, 0, 0));
}
