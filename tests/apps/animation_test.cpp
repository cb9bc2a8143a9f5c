// Animations in and out, as a user makes them: restore --poses and --frames, deform --frames, simulate.
#include "apps/program.h"

#include "filigree/hierarchy/restore.h"
#include "filigree/hierarchy/strip.h"
#include "filigree/io/mesh_file.h"
#include "filigree/io/model_file.h"
#include "filigree/io/point_cache.h"
#include "filigree/mesh/shapes.h"

using namespace filigree_test;
using namespace filigree;

namespace {

const RunContext kContext(1);

class Animation : public Program {
protected:
    void SetUp() override {
        model_ = strip(make_wavy_cube({.resolution = 8, .frequency = 1}), {}, kContext).value().model;
        poses_.frames_per_second = 25;
        for (int k = 0; k < 3; ++k) {
            Pose& pose = poses_.frames.emplace_back();
            for (const Vec3f& p : driver_positions(model_))
                pose.positions.emplace_back(p.x() + float(k) * p.y(), p.y(), p.z());
        }
        EXPECT_TRUE(write_model(model_, poses_, path("moving.fil"), kContext).ok());
        EXPECT_TRUE(write_mesh(model_.mesh, path("mesh.ply"), kContext).ok());
        driver_ = level_mesh(model_, 0);
        const MeshAnimation driver{&driver_, 3, 25, [this](std::size_t frame, std::span<Vec3f> positions) -> Status {
                                       const std::vector<Vec3f>& moved = poses_.frames[frame].positions;
                                       std::copy(moved.begin(), moved.end(), positions.begin());
                                       return Success{};
                                   }};
        for (const char* name : {"driver.pc2", "driver.mdd", "driver/"})
            EXPECT_TRUE(write_animation(driver, path(name), kContext).ok());
    }

    Model model_;
    Mesh driver_;
    PoseSequence poses_;
};

} // namespace

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
    const auto back = open_animation(path("own.pc2"), model_.mesh, {}, kContext);
    ASSERT_TRUE(back.ok());
    std::vector<Vec3f> positions(model_.mesh.vertex_count());
    ASSERT_TRUE(back->positions(2, positions).ok());
    const Restorer restorer = Restorer::create(model_, {}, kContext).value();
    EXPECT_TRUE(positions == restorer.positions(poses_.frames[2], kContext).value());
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
    const Result<PoseSequence> poses = read_poses(path("d.fil"), kContext);
    ASSERT_TRUE(poses.ok());
    ASSERT_EQ(poses->frames.size(), 3u);
    EXPECT_FALSE(poses->frames[0].gradients.empty());
    for (std::size_t v = 0; v < driver_.vertex_count(); ++v)
        EXPECT_LT((poses->frames[0].positions[v] - driver_.positions[v]).norm(), 1e-6f); // the rest shape
    // the last frame is what deform alone makes
    ok({"deform", "mesh.ply", "-o", "full.ply", "--bend", "60", "--stretch", "2"});
    const auto frames = open_animation(path("m.mdd"), model_.mesh, {}, kContext);
    ASSERT_TRUE(frames.ok());
    std::vector<Vec3f> last(model_.mesh.vertex_count());
    ASSERT_TRUE(frames->positions(2, last).ok());
    EXPECT_TRUE(last == read_mesh(path("full.ply"), kContext)->mesh.positions);
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
