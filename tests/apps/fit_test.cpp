// `filigree fit`: what every input gives, every output holds, and every bad input is told.
#include "apps/program.h"
#include "fit/made_animations.h"

#include "filigree/file.h"
#include "filigree/fit.h"
#include "filigree/io/gltf/gltf.h"
#include "filigree/restore.h"

using namespace filigree_test;
using namespace filigree;

namespace {

class FitCommand : public Program {
protected:
    void SetUp() override {
        made_ = flag(60, 40, 8);
        made_.animation.frames_per_second = 24;
        ASSERT_TRUE(write_mesh(*made_.rest, path("rest.obj")).ok());
        ASSERT_TRUE(write_animation(made_.animation, path("flag.pc2")).ok());
    }
    /// How far a model's poses are from the flag, fractions of the diagonal at rest.
    AnimationError error_of(const std::string& name) const {
        const Model model = read_model(path(name)).value();
        AnimationError error = animation_error(model, read_poses(path(name)).value(), made_.animation).value();
        const double diagonal = bounds(*made_.rest).diagonal();
        error.rms /= diagonal;
        error.max /= diagonal;
        return error;
    }

    MadeAnimation made_;
};

} // namespace

TEST_F(FitCommand, ACacheBecomesAModelASkinAndACache) {
    const Json said = json({"fit", "flag.pc2", "--mesh", "rest.obj", "--error", "3e-4", "--frame-rate", "24", "-o",
                            "out.fil", "-o", "out.glb", "-o", "out.pc2"});
    const double rms = said["rms"], max = said["max"];
    EXPECT_LE(rms, 3e-4);
    const AnimationError error = error_of("out.fil");
    EXPECT_NEAR(error.rms, rms, 1e-3 * rms);
    EXPECT_NEAR(error.max, max, 1e-3 * max);
    EXPECT_EQ(error.max_frame + 1, said["max_frame"]);
    EXPECT_EQ(error.max_vertex, said["max_vertex"]);
    EXPECT_EQ(read_poses(path("out.fil")).value().frames_per_second, 24);
    EXPECT_EQ(said["vertices"], made_.rest->vertex_count());
    EXPECT_EQ(said["frames"], 8);
    ASSERT_EQ(said["written"].size(), 3u);
    EXPECT_EQ(said["written"][1]["joints"], said["driver_vertices"]);
    for (std::size_t k = 0; k < 3; ++k) {
        const auto bytes = std::filesystem::file_size(path(said["written"][k]["output"]));
        EXPECT_EQ(said["written"][k]["bytes"], bytes);
        EXPECT_NEAR(said["written"][k]["times_smaller"], 8.0 * 12 * double(made_.rest->vertex_count()) / double(bytes),
                    1e-6);
    }
    // The skin that a viewer plays is the flag too.
    const GltfScene scene = GltfScene::read(path("out.glb"), RunContext()).value();
    std::vector<Vec3f> played(scene.mesh().vertex_count()), truth(made_.rest->vertex_count());
    ASSERT_EQ(played.size(), truth.size());
    ASSERT_TRUE(scene.positions(0, 5 / 24.0, played, RunContext()).ok());
    ASSERT_TRUE(made_.animation.positions(5, truth).ok());
    double squared = 0;
    for (std::size_t v = 0; v < truth.size(); ++v) squared += double((played[v] - truth[v]).squaredNorm());
    EXPECT_LT(std::sqrt(squared / double(truth.size())), 4e-4 * bounds(*made_.rest).diagonal());

    const std::string text = ok({"fit", "flag.pc2", "--mesh", "rest.obj", "--base", "200", "-o", "base.fil"}).out;
    EXPECT_NE(text.find("200 vertices, chosen by the"), std::string::npos) << text;
    EXPECT_NE(text.find("times smaller than the positions of all frames"), std::string::npos) << text;
}

TEST_F(FitCommand, PackedFilesKeepTheErrorAskedFor) {
    for (const std::string profile : {"compact", "stream"}) {
        const Json said = json(
            {"fit", "flag.pc2", "--mesh", "rest.obj", "--error", "2e-4", "--profile", profile, "-o", profile + ".fil"});
        EXPECT_LE(said["written"][0]["rms"], 2e-4) << profile;
        EXPECT_GT(said["written"][0]["rms"], said["rms"]) << profile; // rounding was measured
        EXPECT_EQ(said["warnings"].size(), 0u) << said["warnings"];
    }
    ok({"fit", "flag.pc2", "--mesh", "rest.obj", "--error", "2e-4", "--profile", "compact", "--keep-order", "-o",
        "order.fil"});
    EXPECT_LE(error_of("order.fil").rms, 2e-4);
    ok({"fit", "flag.pc2", "--mesh", "rest.obj", "--error", "2e-4", "--profile", "lossless", "-o", "lossless.fil"});
    ok({"fit", "flag.pc2", "--mesh", "rest.obj", "--error", "2e-4", "-o", "plain.fil"});
    EXPECT_EQ(write_model(read_model(path("lossless.fil")).value(), read_poses(path("lossless.fil")).value()),
              bytes_of(path("plain.fil")));
    EXPECT_LT(3 * std::filesystem::file_size(path("compact.fil")), std::filesystem::file_size(path("lossless.fil")));
    const Ran rough = ok({"fit", "flag.pc2", "--mesh", "rest.obj", "--error", "1e-4", "--profile", "compact", "--bits",
                          "10", "-o", "rough.fil"});
    EXPECT_NE(rough.err.find("rough.fil: packed, the error is"), std::string::npos) << rough.err;
}

TEST_F(FitCommand, GltfAndModelsMoveThemselves) {
    ok({"fit", "flag.pc2", "--mesh", "rest.obj", "--error", "1e-3", "-o", "skin.glb", "-o", "first.fil"});
    const Json of_glb = json({"fit", "skin.glb", "--frame-rate", "60", "--error", "2e-3", "-o", "again.fil"});
    EXPECT_EQ(of_glb["frames"], 8);
    EXPECT_LE(of_glb["rms"], 2e-3);
    const Json of_model = json({"fit", "first.fil", "--error", "2e-3", "-o", "second.fil"});
    EXPECT_EQ(of_model["frames"], 8);
    EXPECT_LT(of_model["driver_vertices"], 100);
    ASSERT_TRUE(write_animation(made_.animation, path("flag.usda")).ok());
    const Json of_usd = json({"fit", "flag.usda", "--error", "1e-3", "-o", "usd.fil"});
    EXPECT_EQ(of_usd["frames"], 8);
    EXPECT_LE(of_usd["rms"], 1e-3);
    ok({"convert", "flag.usda", "back.pc2"});
    EXPECT_EQ(bytes_of(path("back.pc2")), bytes_of(path("flag.pc2")));
    // A skin of few joints is told to be smaller as it is.
    const Ran ran = ok({"fit", "skin.glb", "--base", "600", "-o", "more.fil"});
    EXPECT_NE(ran.err.find("is a skin of"), std::string::npos) << ran.err;
}

TEST_F(FitCommand, SmallKeysAreAsPreciseAsTheFit) {
    const Json said = json({"fit", "flag.pc2", "--mesh", "rest.obj", "--error", "1e-3", "--compress", "-o", "small.glb",
                            "-o", "model.fil"});
    const double fitted = said["rms"], keys = said["written"][0]["error_at_keys"];
    EXPECT_LE(keys, fitted * 1.05);
    const Json exact = json({"export", "model.fil", "-o", "exact.glb", "--compress", "--key-error", "1e-6"});
    EXPECT_LT(exact["error_at_keys"], keys);
    EXPECT_LT(std::filesystem::file_size(path("small.glb")), std::filesystem::file_size(path("exact.glb")));
    fails(2, {"export", "model.fil", "-o", "other.glb", "--key-error", "1e-4"}, {"--key-error", "--compress"});
    fails(2, {"export", "model.fil", "-o", "other.glb", "--compress", "--key-error", "0.5"}, {"--key-error"});
}

TEST_F(FitCommand, APageIsWritten) {
    const Ran ran =
        run({"fit", "flag.pc2", "--mesh", "rest.obj", "--base", "100", "-o", "page/", "--web", "-o", "beside.fil"});
    if (ran.code == 5) GTEST_SKIP() << ran.err; // built without the page
    ASSERT_EQ(ran.code, 0) << ran.err;
    EXPECT_TRUE(std::filesystem::exists(path("page/index.html")));
    EXPECT_TRUE(std::filesystem::exists(path("page/model.glb")));
    EXPECT_TRUE(std::filesystem::exists(path("beside.fil")));
}

TEST_F(FitCommand, BadInputsGetOneSentence) {
    fails(2, {"fit", "flag.pc2", "-o", "out.fil"}, {"flag.pc2", "--mesh FILE"});
    fails(2, {"fit", "flag.pc2", "--mesh", "rest.obj", "--error", "2", "-o", "out.fil"}, {"--error"});
    fails(2, {"fit", "flag.pc2", "--mesh", "rest.obj", "--base", "5", "-o", "out.fil"}, {"--base"});
    fails(2, {"fit", "flag.pc2", "--mesh", "rest.obj", "--rest", "9", "-o", "out.fil"}, {"--rest", "8"});
    fails(2, {"fit", "flag.pc2", "--mesh", "rest.obj", "-o", "out.fil", "-o", "./out.fil"}, {"two outputs"});
    fails(2, {"fit", "flag.pc2", "--mesh", "rest.obj", "-o", "flag.pc2"}, {"flag.pc2"});
    fails(2, {"fit", "flag.pc2", "--mesh", "rest.obj", "--web", "-o", "out.fil"}, {"--web", "NAME/"});
    fails(2, {"fit", "flag.pc2", "--mesh", "rest.obj", "--profile", "compact", "-o", "out.glb"}, {"--profile"});
    fails(2, {"fit", "flag.pc2", "--mesh", "rest.obj", "--bits", "12", "-o", "out.fil"}, {"--bits", "--profile"});
    fails(2, {"fit", "flag.pc2", "--mesh", "rest.obj", "--compress", "-o", "out.fil"}, {"--compress", ".glb"});
    fails(3, {"fit", "none.pc2", "--mesh", "rest.obj", "-o", "out.fil"}, {"none.pc2"});
    fails(5, {"fit", "cloth.abc", "-o", "out.fil"}, {"Alembic", ".pc2"});
    ASSERT_TRUE(write_mesh(filigree_test::sheet(10, 10), path("other.obj")).ok());
    fails(8, {"fit", "flag.pc2", "--mesh", "other.obj", "-o", "out.fil"}, {"flag.pc2", "121"});
    ok({"strip", "rest.obj", "-o", "still.fil"});
    fails(7, {"fit", "still.fil", "-o", "out.fil"}, {"no poses"});

    // A frame of another order, one that is not finite: the frame is named, nothing is written.
    const auto sound = made_.animation.positions;
    made_.animation.positions = [=](std::size_t frame, std::span<Vec3f> positions) -> Status {
        if (Status done = sound(frame, positions); !done) return done;
        if (frame == 4) std::shuffle(positions.begin(), positions.end(), std::mt19937(1));
        return Success{};
    };
    ASSERT_TRUE(write_animation(made_.animation, path("order.pc2")).ok());
    fails(7, {"fit", "order.pc2", "--mesh", "rest.obj", "-o", "out.fil"}, {"Frame 5", "another order"});
    std::string bytes = bytes_of(path("flag.pc2"));
    const float bad = std::numeric_limits<float>::infinity();
    std::memcpy(bytes.data() + 32 + 12 * (2 * made_.rest->vertex_count() + 7), &bad, sizeof bad);
    write("infinite.pc2", bytes);
    fails(4, {"fit", "infinite.pc2", "--mesh", "rest.obj", "-o", "out.fil"}, {"frame 3"});

    const MadeAnimation flow = fluid(wavy_sphere(20), 30);
    ASSERT_TRUE(write_mesh(*flow.rest, path("drop.obj")).ok());
    ASSERT_TRUE(write_animation(flow.animation, path("flow.pc2")).ok());
    fails(7, {"fit", "flow.pc2", "--mesh", "drop.obj", "--error", "1e-5", "-o", "out.fil"},
          {"The error is not reached", "rms"});
    EXPECT_FALSE(std::filesystem::exists(path("out.fil")));
}

TEST_F(FitCommand, TheFrameStretchedLeastIsTheRest) {
    std::filesystem::create_directories(path("frames"));
    ok({"fit", "flag.pc2", "--mesh", "rest.obj", "--error", "1e-3", "-o", "frames/f_####.obj"});
    const Json said = json({"fit", "frames/f_####.obj", "--error", "1e-3", "-o", "out.fil"});
    EXPECT_EQ(said["frames"], 8);
    EXPECT_GE(said["rest_frame"], 1);
    EXPECT_LE(said["rest_frame"], 8);
    EXPECT_EQ(json({"fit", "frames/", "--error", "1e-3", "--rest", "3", "-o", "out.fil"})["rest_frame"], 3);
}
