// Models that hold poses, in info, restore and render.
#include "apps/program.h"
#include "threads.h"

#include "filigree/file.h"
#include "filigree/io/model_file.h"
#include "filigree/mesh.h"
#include "filigree/render.h"
#include "filigree/restore.h"
#include "filigree/strip.h"

#include <numbers>

using namespace filigree_test;
using namespace filigree;

namespace {

class OwnPoses : public Program {
protected:
    void SetUp() override {
        model_ = strip(make_wavy_cube({.resolution = 8, .frequency = 1}), {}, kOneThread).value().model;
        poses_.frames_per_second = 25;
        for (int k = 0; k < 4; ++k) { // turns and grows, far up
            const Mat3f gradient =
                (1 + 0.2f * float(k)) *
                Eigen::AngleAxisf(float(k) * std::numbers::pi_v<float> / 8, Vec3f::UnitY()).toRotationMatrix();
            Pose& pose = poses_.frames.emplace_back();
            for (const Vec3f& p : driver_positions(model_))
                pose.positions.push_back(gradient * p + Vec3f(0, float(k), 0));
            pose.gradients.assign(pose.positions.size(), gradient);
        }
        ASSERT_TRUE(write_model(model_, poses_, path("moving.fil"), kOneThread).ok());
        ASSERT_TRUE(write_model(model_, path("still.fil"), kOneThread).ok());
    }
    static std::vector<std::string> quick(const std::string& input, const std::string& output,
                                          const std::vector<std::string>& more = {}) {
        std::vector<std::string> words = {"render", input, "-o", output, "--passes", "1", "--size", "64x48"};
        words.insert(words.end(), more.begin(), more.end());
        return words;
    }
    Picture picture(const std::string& name) const { return read_picture(path(name)).value(); }
    bool has_opengl() const { return run(quick("still.fil", "first.png")).err.find("No OpenGL") == std::string::npos; }

    Model model_;
    PoseSequence poses_;
};

} // namespace

TEST_F(OwnPoses, InfoTellsOfThem) {
    const Json poses = json({"info", "moving.fil"})["poses"];
    EXPECT_EQ(poses["frames"], 4);
    EXPECT_EQ(poses["frames_per_second"], 25);
    EXPECT_EQ(poses["gradients"], true);
    EXPECT_NE(ok({"info", "moving.fil"}).out.find("4 at 25 frames a second, with gradients"), std::string::npos);
    EXPECT_FALSE(json({"info", "still.fil"}).contains("poses"));
}

TEST_F(OwnPoses, AreRestoredOneByOne) {
    const Json one = json({"restore", "moving.fil", "--frame", "3", "-o", "third.ply"});
    EXPECT_EQ(one["from"], "positions and gradients");
    const Mesh third = read_mesh(path("third.ply"), kOneThread).value().mesh;
    const Restorer restorer = Restorer::create(model_, {}, kOneThread).value();
    EXPECT_EQ(third.positions, restorer.positions(poses_.frames[2], kOneThread).value());
    fails(2, {"restore", "moving.fil", "--frame", "5", "-o", "x.ply"}, {"moving.fil", "1 to 4", "5"});
    fails(2, {"restore", "moving.fil", "--frame", "0", "-o", "x.ply"}, {"--frame"});
    fails(7, {"restore", "still.fil", "--frame", "1", "-o", "x.ply"}, {"still.fil", "no poses", "filigree simulate"});
    fails(2, {"restore", "moving.fil", "-o", "x.ply"}, {"--pose", "--frame"});
    fails(2, {"restore", "moving.fil", "--frame", "1", "--pose", "third.ply", "-o", "x.ply"}, {"--pose", "--frame"});
}

TEST_F(OwnPoses, AreRestoredAllIntoAFolder) {
    const Json all = json({"restore", "moving.fil", "--frames", "-o", "out/frames"});
    EXPECT_EQ(all["frames"], 4);
    ok({"restore", "moving.fil", "--frame", "4", "-o", "fourth.ply"});
    EXPECT_EQ(bytes_of(path("out/frames/moving_0004.ply")), bytes_of(path("fourth.ply")));
    EXPECT_FALSE(std::filesystem::exists(path("out/frames/moving_0005.ply")));
    fails(7, {"restore", "still.fil", "--frames", "-o", "other"}, {"no poses"});
    EXPECT_FALSE(std::filesystem::exists(path("other")));
    fails(2, {"restore", "moving.fil", "--frames", "-o", "-"}, {"folder"});
    fails(2, {"restore", "moving.fil", "--frames", "--frame", "1", "-o", "x"}, {"--frames"});
}

TEST_F(OwnPoses, PlayInFilms) {
    if (!has_opengl()) GTEST_SKIP() << "needs OpenGL";
    EXPECT_EQ(json(quick("moving.fil", "a_%d.png"))["frames"], 4);
    EXPECT_GT(picture_distance(picture("a_1.png"), picture("a_4.png")), 2);
    // One of them alone is framed by itself; at rest the file is a model like others.
    ok(quick("moving.fil", "third.png", {"--frame", "3"}));
    ok(quick("moving.fil", "rest.png"));
    ok(quick("still.fil", "still.png"));
    EXPECT_EQ(bytes_of(path("rest.png")), bytes_of(path("still.png")));
    EXPECT_GT(picture_distance(picture("third.png"), picture("rest.png")), 2);
    // What restore writes looks as what the shader restores.
    ok({"restore", "moving.fil", "--frame", "3", "-o", "third.ply"});
    ok(quick("third.ply", "mesh.png", {"--no-ground"}));
    ok(quick("moving.fil", "shader.png", {"--frame", "3", "--no-ground"}));
    EXPECT_LT(picture_distance(picture("mesh.png"), picture("shader.png")), 10);
    EXPECT_EQ(json(quick("moving.fil", "turn_%d.png", {"--turntable", "--frame", "2", "--frames", "3"}))["frames"], 3);
    EXPECT_EQ(json(quick("moving.fil", "both_%d.png", {"--turntable", "--frames", "8"}))["frames"], 8);

    fails(2, quick("still.fil", "x_%d.png"), {"film", "poses", "--turntable"});
    fails(2, quick("moving.fil", "x.png", {"--frame", "5"}), {"1 to 4"});
    fails(7, quick("still.fil", "x.png", {"--frame", "1"}), {"no poses"});
    fails(2, quick("moving.fil", "x_%d.png", {"--frame", "1"}), {"--frame", "--turntable"});
    fails(7, quick("moving.fil", "x_%d.png", {"--scalar", "f00"}), {"f00"});
    fails(2, quick("third.ply", "x.png", {"--frame", "1"}), {"third.ply", "mesh", "--frame"});
    EXPECT_FALSE(std::filesystem::exists(path("x.png")) || std::filesystem::exists(path("x_1.png")));
}

TEST_F(OwnPoses, FilmsKeepTheirRate) {
    if (!has_opengl()) GTEST_SKIP() << "needs OpenGL";
    if (std::system("ffprobe -version > /dev/null 2>&1") != 0) GTEST_SKIP() << "needs ffmpeg";
    ok(quick("moving.fil", "own.mp4"));
    ok(quick("moving.fil", "slow.mp4", {"--fps", "5"}));
    const std::string probe = "ffprobe -v error -select_streams v -show_entries stream=r_frame_rate -of csv=p=0 ";
    EXPECT_EQ(run_shell(probe + "own.mp4").out, "25/1\n");
    EXPECT_EQ(run_shell(probe + "slow.mp4").out, "5/1\n");
}
