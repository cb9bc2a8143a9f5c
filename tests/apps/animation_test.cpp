// Animations in and out, as a user makes them: restore --poses and --frames, deform --frames, simulate.
#include "apps/program.h"
#include "blend/part_meshes.h"
#include "threads.h"

#include "filigree/file.h"
#include "filigree/io/animation/point_cache.h"
#include "filigree/io/model/model_file.h"
#include "filigree/mesh.h"
#include "filigree/restore.h"
#include "filigree/strip.h"

#include <cmath>
#include <cstring>
#include <fstream>

#include <sys/stat.h>

using namespace filigree_test;
using namespace filigree;

namespace {

class Animation : public Program {
protected:
    void SetUp() override {
        model_ = strip(make_wavy_cube({.resolution = 8, .frequency = 1}), {}, kOneThread).value().model;
        poses_.frames_per_second = 25;
        for (int k = 0; k < 3; ++k) {
            Pose& pose = poses_.frames.emplace_back();
            for (const Vec3f& p : driver_positions(model_))
                pose.positions.emplace_back(p.x() + float(k) * p.y(), p.y(), p.z());
        }
        EXPECT_TRUE(write_model(model_, poses_, path("moving.fil"), kOneThread).ok());
        EXPECT_TRUE(write_mesh(model_.mesh, path("mesh.ply"), {}, kOneThread).ok());
        driver_ = level_mesh(model_, 0);
        const MeshAnimation driver{&driver_, 3, 25, [this](std::size_t frame, std::span<Vec3f> positions) -> Status {
                                       const std::vector<Vec3f>& moved = poses_.frames[frame].positions;
                                       std::copy(moved.begin(), moved.end(), positions.begin());
                                       return Success{};
                                   }};
        for (const char* name : {"driver.pc2", "driver.mdd", "driver/"})
            EXPECT_TRUE(write_animation(driver, path(name), kOneThread).ok());
    }

    Model model_;
    Mesh driver_;
    PoseSequence poses_;
};

} // namespace

/// A GLB with a picture that is a file of its own.
void with_picture_beside(const std::string& from, const std::string& picture, const std::string& to) {
    constexpr std::size_t kHeader = 12, kChunk = 8;
    const std::string glb = bytes_of(from);
    std::uint32_t length = 0;
    std::memcpy(&length, glb.data() + kHeader, sizeof length);
    Json document = Json::parse(glb.substr(kHeader + kChunk, length));
    document["images"].push_back({{"uri", picture}});
    std::string text = document.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    const std::string rest = glb.substr(kHeader + kChunk + length);
    const auto number = [](std::size_t value) {
        const auto bits = std::uint32_t(value);
        return std::string(reinterpret_cast<const char*>(&bits), sizeof bits);
    };
    std::ofstream(to, std::ios::binary) << glb.substr(0, 8) << number(kHeader + kChunk + text.size() + rest.size())
                                        << number(text.size()) << "JSON" << text << rest;
}

TEST_F(Animation, PosesOfAnotherProgramAreRestoredAsOurOwn) {
    const Json own = json({"restore", "moving.fil", "--frames", "-o", "own.pc2"});
    EXPECT_EQ(own["frames"], 3);
    EXPECT_EQ(own["frames_per_second"], 25);
    EXPECT_EQ(own["from"], "positions");
    EXPECT_EQ(own["bytes"], 32 + 3 * 12 * model_.mesh.vertex_count());
    for (const std::string poses : {"driver.pc2", "driver.mdd", "driver", "driver/driver_####.ply", "moving.fil"}) {
        ok({"restore", "moving.fil", "--poses", poses, "-o", "back.pc2"});
        EXPECT_TRUE(bytes_of(path("back.pc2")) == bytes_of(path("own.pc2"))) << poses;
    }
    const auto back = open_animation(path("own.pc2"), model_.mesh, {}, kOneThread);
    ASSERT_TRUE(back.ok());
    std::vector<Vec3f> positions(model_.mesh.vertex_count());
    ASSERT_TRUE(back->positions(2, positions).ok());
    const Restorer restorer = Restorer::create(model_, {}, kOneThread).value();
    EXPECT_TRUE(positions == restorer.positions(poses_.frames[2], kOneThread).value());
}

TEST_F(Animation, EveryOutputIsWritten) {
    for (const std::string out : {"a.mdd", "a.usda", "a.glb", "new/", "n_####.obj"})
        EXPECT_EQ(json({"restore", "moving.fil", "--poses", "driver.pc2", "--frame-rate", "24", "-o",
                        out})["frames_per_second"],
                  24)
            << out;
    EXPECT_TRUE(std::filesystem::exists(path("n_0003.obj")));
    EXPECT_TRUE(std::filesystem::exists(path("new/moving_0003.ply")));
    EXPECT_EQ(json({"restore", "moving.fil", "--frames", "--as", "morph", "-o", "m.glb"})["as"], "morph");
    EXPECT_EQ(json({"restore", "moving.fil", "--frames", "-o", "s.glb"})["as"], "skin");
}

TEST_F(Animation, DeformMakesFramesFromRestToFull) {
    const std::vector<std::string> bend = {"--bend", "60", "--stretch", "2", "--frames", "3"};
    const auto deform = [&](const std::string& input, const std::string& output) {
        std::vector<std::string> words = {"deform", input, "-o", output};
        words.insert(words.end(), bend.begin(), bend.end());
        return json(words);
    };
    for (const std::string out : {"d.glb", "d.pc2", "d.fil", "d.usda"})
        EXPECT_EQ(deform("moving.fil", out)["through_driver"], true) << out;
    EXPECT_EQ(deform("mesh.ply", "m.mdd")["through_driver"], false);
    EXPECT_EQ(deform("mesh.ply", "m.glb")["as"], "morph");
    const Result<PoseSequence> poses = read_poses(path("d.fil"), kOneThread);
    ASSERT_TRUE(poses.ok());
    ASSERT_EQ(poses->frames.size(), 3u);
    EXPECT_FALSE(poses->frames[0].gradients.empty());
    for (std::size_t v = 0; v < driver_.vertex_count(); ++v)
        EXPECT_LT((poses->frames[0].positions[v] - driver_.positions[v]).norm(), 1e-6f); // the rest shape
    // the last frame is what deform alone makes
    ok({"deform", "mesh.ply", "-o", "full.ply", "--bend", "60", "--stretch", "2"});
    const auto frames = open_animation(path("m.mdd"), model_.mesh, {}, kOneThread);
    ASSERT_TRUE(frames.ok());
    std::vector<Vec3f> last(model_.mesh.vertex_count());
    ASSERT_TRUE(frames->positions(2, last).ok());
    EXPECT_TRUE(last == read_mesh(path("full.ply"), kOneThread)->mesh.positions);
}

TEST_F(Animation, SimulationsLeaveAsCachesAndSkins) {
    write("drop.toml", "[simulation]\nframes = 2\n[[body]]\nshape = \"wavy-cube\"\nresolution = 8\nparticles = 200\n"
                       "driver = 60\n");
    const Ran ran = run({"simulate", "drop.toml", "-o", "drop.fil", "-o", "drop.pc2", "-o", "drop.glb", "--json"});
    ASSERT_EQ(ran.code, 0) << ran.err;
    const Json report = Json::parse(ran.out);
    ASSERT_EQ(report["animations"].size(), 2u);
    EXPECT_EQ(report["animations"][0]["frames"], 3); // the start too
    ok({"restore", "drop.fil", "--frames", "-o", "again.pc2"});
    EXPECT_TRUE(bytes_of(path("again.pc2")) == bytes_of(path("drop.pc2")));
    fails(2, {"simulate", "drop.toml", "-o", "x.pc2", "-o", "x.pc2"}, {"x.pc2", "one place"});
}

TEST_F(Animation, InputsAreNeverOverwrittenUnderAnyName) {
    const std::string before = bytes_of(path("driver/driver_0001.ply"));
    ASSERT_FALSE(before.empty());
    for (const std::string poses : {"driver", "driver/", "driver/driver_####.ply", "driver/driver_%04d.ply"})
        for (const std::string out : {"driver/driver_####.ply", "./driver/driver_%04d.ply"})
            for (const std::string command : {"restore", "export"})
                fails(2, {command, "moving.fil", "--poses", poses, "-o", out}, {"driver_0001.ply", "input"});
    std::filesystem::create_directory(path("link"));
    std::filesystem::create_symlink(path("driver"), path("link/to"));
    fails(2, {"restore", "moving.fil", "--poses", "driver", "-o", "link/to/driver_####.ply"}, {"input"});
    EXPECT_TRUE(bytes_of(path("driver/driver_0001.ply")) == before);
    const std::string cache = bytes_of(path("driver.pc2"));
    fails(2, {"export", "moving.fil", "--poses", "driver.pc2", "-o", "driver.pc2"}, {"driver.pc2", "input"});
    fails(2, {"export", "moving.fil", "--poses", "driver.pc2", "-o", "./driver.pc2"}, {"driver.pc2", "input"});
    EXPECT_TRUE(bytes_of(path("driver.pc2")) == cache);
    ok({"export", "moving.fil", "-o", "m.glb"});
    const std::string glb = bytes_of(path("m.glb"));
    fails(2, {"export", "m.glb", "-o", "m.glb"}, {"m.glb", "input"});
    EXPECT_TRUE(bytes_of(path("m.glb")) == glb);
    ok({"deform", "moving.fil", "--bend", "9", "--frames", "2", "-o", "seq_####.ply"});
    fails(2, {"deform", "seq_0001.ply", "--bend", "9", "--frames", "2", "-o", "seq_####.ply"}, {"input"});
    ok({"restore", "moving.fil", "--poses", "driver", "-o", "driver/else_####.ply"}); // beside them is fine
}

TEST_F(Animation, ExportSaysWhatItsDocumentationPromises) {
    const Json glb = json({"export", "moving.fil", "-o", "m.GLB", "--frame-rate", "50"});
    for (const char* key : {"output", "bytes", "vertices", "frames", "frames_per_second", "export_seconds", "as",
                            "joints", "keys", "seconds", "error_at_keys", "rms_at_keys", "error_between_keys",
                            "rms_between_keys", "moments_checked", "normal_error_degrees", "warnings"})
        EXPECT_TRUE(glb.contains(key)) << key;
    EXPECT_EQ(glb["frames"], 3);
    EXPECT_EQ(glb["frames_per_second"], 50); // instead of the model's 25
    EXPECT_NEAR(glb["seconds"].get<double>(), 2 / 50.0, 1e-6);
    const Json morph = json({"export", "moving.fil", "-o", "m.glb", "--as", "morph"});
    EXPECT_EQ(morph["frames"], 3);
    EXPECT_EQ(morph["frames_per_second"], 25);
    const Json cache = json({"export", "moving.fil", "-o", "m.pc2"});
    EXPECT_EQ(cache["bytes"], 32 + 3 * 12 * model_.mesh.vertex_count());
    EXPECT_EQ(cache["frames"], 3);
    EXPECT_EQ(cache["vertices"], model_.mesh.vertex_count());
    const Json rest = json({"export", "moving.fil", "--rest", "-o", "m.Glb"});
    for (const char* key : {"output", "bytes", "vertices", "levels", "export_seconds"})
        EXPECT_TRUE(rest.contains(key)) << key;
}

TEST_F(Animation, APageTakesAGlbAsItIs) {
    ok({"export", "moving.fil", "-o", "m.glb"});
    if (run({"export", "m.glb", "-o", "page/", "--web"}).code == 5) GTEST_SKIP() << "built without the page";
    EXPECT_TRUE(bytes_of(path("page/model.glb")) == bytes_of(path("m.glb")));
    EXPECT_TRUE(std::filesystem::exists(path("page/index.html")));
    EXPECT_NE(bytes_of(path("page/licenses.txt")).find("three.js"), std::string::npos);
    write("logo.svg", "<svg"); // cut off
    fails(5, {"export", "m.glb", "-o", "other/", "--web", "--logo", "logo.svg"}, {"logo.svg", "SVG", "PNG"});
    fails(3, {"export", "m.glb", "-o", "other/", "--web", "--logo", "none.png"}, {"none.png"});
    fails(2, {"export", "m.glb", "-o", "other/", "--web", "--title", " "}, {"--title"});
    fails(2, {"export", "m.glb", "-o", "other.glb", "--title", "x"}, {"--title", "--web"});
    fails(2, {"export", "m.glb", "-o", "other/", "--web", "--key-rate", "9"}, {"--key-rate", "m.glb"});
    fails(7, {"export", "mesh.ply", "-o", "other/", "--web"}, {"mesh.ply", "strip"});
    with_picture_beside(path("m.glb"), "t.png", path("beside.glb"));
    fails(7, {"export", "beside.glb", "-o", "other/", "--web"}, {"beside.glb", "t.png"});
    std::filesystem::resize_file(path("m.glb"), 100);
    fails(4, {"export", "m.glb", "-o", "other/", "--web"}, {"m.glb"});
    EXPECT_FALSE(std::filesystem::exists(path("other")));
}

/// Said, and no warning: the file is as it should be, and what to do depends on who plays it.
TEST_F(Animation, NormalsFarOffAreSaid) {
    const std::vector<std::string> stretched = {"deform",   "moving.fil", "--stretch", "3",
                                                "--frames", "2",          "-o",        "s.glb"};
    const Json report = json(stretched);
    EXPECT_GT(report["normal_error_degrees"].get<double>(), 10);
    EXPECT_EQ(report["warnings"].dump(), "[]");
    const Ran ran = ok(stretched);
    EXPECT_NE(ran.out.find("degrees at 95 % of the driver"), std::string::npos) << ran.out;
    EXPECT_NE(ran.out.find("Shading: Smooth"), std::string::npos) << ran.out;
    EXPECT_EQ(ran.err, "");
    std::vector<std::string> without = stretched;
    without.push_back("--no-normals");
    EXPECT_EQ(ok(without).out.find("normals"), std::string::npos);
}

TEST_F(Animation, OptionsWithoutEffectAreRefused) {
    ok({"strip", "mesh.ply", "-o", "still.fil"});
    for (const std::vector<std::string>& option : std::vector<std::vector<std::string>>{
             {"--level", "0"}, {"--no-normals"}, {"--as", "skin"}, {"--influences", "6"}, {"--frame-rate", "24"}}) {
        std::vector<std::string> words = {"export", "still.fil", "-o", "x.glb"};
        words.insert(words.end(), option.begin(), option.end());
        fails(2, words, {option[0], "at rest"});
    }
    fails(2, {"export", "moving.fil", "--animation", "Run", "-o", "x.glb"}, {"--animation", "--poses"});
    fails(2, {"export", "moving.fil", "--key-rate", "9", "-o", "x.pc2"}, {"--key-rate", ".glb"});
    fails(2, {"restore", "moving.fil", "--frames", "--no-normals", "-o", "x.pc2"}, {"--no-normals", ".glb"});
    fails(2, {"restore", "moving.fil", "--frame", "1", "--as", "skin", "-o", "x.ply"}, {"--as", "--frames"});
    fails(2, {"deform", "moving.fil", "--bend", "9", "--full-precision", "-o", "x.ply"},
          {"--full-precision", "--frames"});
    fails(7, {"export", "mesh.ply", "-o", "x.glb"}, {"mesh.ply", "does not move", "--poses"});
    fails(7, {"export", "still.fil", "-o", "page/"}, {"still.fil", "--web"});
    fails(2, {"deform", "moving.fil", "--bend", "9", "--frames", "3", "-o", "-"}, {"standard output"});
    fails(2, {"deform", "moving.fil", "--bend", "9", "--frames", "100000000", "-o", "x.fil"}, {"x.fil", "GB", ".pc2"});
    for (const std::string& file : files()) EXPECT_FALSE(file.starts_with("x.") || file == "page") << file;
}

TEST_F(Animation, WhatCannotBeIsSaidBeforeTheWork) {
    const auto refuses = [&](int code, const std::vector<std::string>& more, const std::vector<std::string>& words) {
        std::vector<std::string> all = {"restore", "moving.fil"};
        all.insert(all.end(), more.begin(), more.end());
        fails(code, all, words);
    };
    refuses(2, {"--poses", "driver.pc2", "-o", "x.ply"}, {"x.ply", "one mesh", "####"});
    refuses(5, {"--poses", "driver.pc2", "-o", "x.usdc"}, {"x.usdc", ".usda"});
    refuses(6, {"--poses", "driver.pc2", "-o", "missing/x.pc2"}, {"missing/x.pc2", "no such folder"});
    refuses(2, {"--poses", "driver.pc2", "-o", "driver.pc2"}, {"driver.pc2", "input"});
    refuses(2, {"--poses", "driver.pc2", "-o", "-"}, {"standard output"});
    std::filesystem::remove(path("driver/driver_0002.ply"));
    ASSERT_EQ(::mkfifo(path("driver/driver_0002.ply").c_str(), 0600), 0);
    refuses(5, {"--poses", "driver", "-o", "new/er/"}, {"driver_0002.ply", "pipe"}); // without waiting for a writer
    EXPECT_FALSE(std::filesystem::exists(path("new")));
    refuses(2, {"--poses", "driver.pc2", "--frames", "-o", "x.pc2"}, {"--poses"});
    refuses(3, {"--poses", "missing.pc2", "-o", "x.pc2"}, {"missing.pc2"});
    refuses(2, {"--frame", "1", "--frame-rate", "24", "-o", "x.ply"}, {"--frame-rate"});
    std::filesystem::resize_file(path("driver.pc2"), 100);
    refuses(4, {"--poses", "driver.pc2", "-o", "x.pc2"}, {"driver.pc2", "cut off"});
    fails(2, {"deform", "moving.fil", "--bend", "9", "--frames", "1", "-o", "x.pc2"}, {"--frames"});
    fails(2, {"deform", "moving.fil", "--bend", "9", "--frames", "3", "--pose", "p.ply", "-o", "x.pc2"}, {"--pose"});
    fails(2, {"deform", "mesh.ply", "--bend", "9", "--frames", "3", "-o", "x.fil"}, {"x.fil", "mesh"});
    EXPECT_FALSE(std::filesystem::exists(path("x.pc2")));
}

/// A finer driver does not help parts that it still has no vertex of: the sentence says what does.
TEST_F(Animation, LooseParts) {
    Mesh mesh = make_wavy_sphere({.resolution = 24, .amplitude = 0, .size = 2});
    const Mesh rivet = make_wavy_sphere({.resolution = 4, .amplitude = 0, .size = 2});
    for (float turn = 0; turn < 6; turn += 0.1f) // a belt of them
        filigree_test::add_part(mesh, rivet, 0.01f, 1.01f * Vec3f(std::cos(turn), std::sin(turn), 0));
    EXPECT_TRUE(write_mesh(mesh, path("rivets.ply"), {}, kOneThread).ok());
    ok({"strip", "rivets.ply", "-o", "rivets.fil", "--base", "300"});
    ok({"deform", "rivets.fil", "--bend", "170", "--twist", "170", "-o", "b.ply", "--pose", "pose.obj"});
    const Ran ran = ok({"restore", "rivets.fil", "--pose", "pose.obj", "-o", "c.ply"});
    EXPECT_NE(ran.err.find("give the pose with gradients"), std::string::npos) << ran.err;
}

TEST_F(Animation, ACageWhoseVerticesWereSplitIsRestoredAsTheCage) {
    Mesh moved = driver_, flat;
    moved.positions = poses_.frames[2].positions;
    std::vector<Index> place(moved.corner_count()); // corners by their vertices, as Blender writes them
    for (Index v = 0; v < moved.vertex_count(); ++v)
        for (std::size_t c = 0; c < moved.corner_count(); ++c)
            if (moved.corners[c] == v) {
                place[c] = static_cast<Index>(flat.positions.size());
                flat.positions.push_back(moved.positions[v]);
            }
    for (std::size_t f = 0; f < moved.face_count(); ++f) {
        std::vector<Index> corners;
        for (std::size_t c = moved.face_offsets[f]; c < moved.face_offsets[f + 1]; ++c) corners.push_back(place[c]);
        flat.add_face(corners);
    }
    EXPECT_TRUE(write_mesh(moved, path("smooth.ply"), {}, kOneThread).ok());
    EXPECT_TRUE(write_mesh(flat, path("flat.ply"), {}, kOneThread).ok());
    ok({"restore", "moving.fil", "--pose", "smooth.ply", "-o", "a.ply"});
    const Ran ran = ok({"restore", "moving.fil", "--pose", "flat.ply", "-o", "b.ply"});
    EXPECT_EQ(bytes_of(path("a.ply")), bytes_of(path("b.ply")));
    EXPECT_NE(ran.err.find("were split for their normals or UVs"), std::string::npos) << ran.err;
    std::rotate(flat.positions.begin(), flat.positions.begin() + 7,
                flat.positions.end()); // another mesh of as many places
    EXPECT_TRUE(write_mesh(flat, path("other.ply"), {}, kOneThread).ok());
    fails(8, {"restore", "moving.fil", "--pose", "other.ply", "-o", "c.ply"}, {"filigree level MODEL 0"});
}

TEST_F(Animation, ACacheOfAProgramWithZUpIsToldOfAndTurnedBack) {
    const MeshAnimation lying{&driver_, 3, 25, [this](std::size_t frame, std::span<Vec3f> positions) -> Status {
                                  for (std::size_t v = 0; v < positions.size(); ++v) {
                                      const Vec3f& p = poses_.frames[frame].positions[v];
                                      positions[v] = Vec3f(p.x(), -p.z(), p.y());
                                  }
                                  return Success{};
                              }};
    EXPECT_TRUE(write_animation(lying, path("z.mdd"), kOneThread).ok());
    const Ran ran = ok({"restore", "moving.fil", "--poses", "z.mdd", "-o", "z.pc2"});
    EXPECT_NE(ran.err.find("turned by 90 degrees about x"), std::string::npos) << ran.err;
    EXPECT_NE(ran.err.find("pose-up z"), std::string::npos) << ran.err;
    const Ran back = ok({"restore", "moving.fil", "--poses", "z.mdd", "--pose-up", "z", "-o", "back.pc2"});
    EXPECT_EQ(back.err.find("turned by"), std::string::npos) << back.err;
    ok({"restore", "moving.fil", "--frames", "-o", "own.pc2"});
    EXPECT_TRUE(bytes_of(path("back.pc2")) == bytes_of(path("own.pc2")));
    ok({"export", "moving.fil", "--poses", "z.mdd", "--pose-up", "z", "-o", "back.glb"});
    fails(2, {"restore", "moving.fil", "--frames", "--pose-up", "z", "-o", "x.pc2"}, {"--pose-up belongs to"});
}
