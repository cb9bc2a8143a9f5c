// A shot restored in chunks by many processes, some of which are killed: the same bytes as by one.
#include "apps/program.h"

#include "filigree/hierarchy/strip.h"
#include "filigree/io/model_file.h"
#include "filigree/io/point_cache.h"
#include "filigree/mesh/shapes.h"

#include <algorithm>
#include <cmath>

using namespace filigree_test;
using namespace filigree;

namespace {

const RunContext kContext(1);
constexpr std::size_t kFrames = 40;

class Chunks : public Program {
protected:
    void SetUp() override {
        const Model model = strip(make_wavy_sphere({.resolution = 120}), {}, kContext).value().model;
        PoseSequence poses;
        for (std::size_t k = 0; k < kFrames; ++k) {
            Pose& pose = poses.frames.emplace_back();
            for (const Vec3f& p : driver_positions(model))
                pose.positions.emplace_back(p.x() + 0.3f * std::sin(0.2f * float(k) + p.y()), p.y(), p.z());
        }
        ASSERT_TRUE(write_model(model, poses, path("moving.fil"), kContext));
        ok({"restore", "moving.fil", "--frames", "-o", "serial.pc2"});
        serial_ = bytes_of(path("serial.pc2"));
    }
    std::vector<std::string> chunk(const std::string& which, const std::string& output = "shot.pc2") const {
        return {"restore", "moving.fil", "--frames", "-o", output, "--chunk", which};
    }
    /// Folders and temporary files of a shot that is not whole.
    std::size_t left_over() const {
        const std::vector<std::string> names = files();
        return std::size_t(std::ranges::count_if(
            names, [](const std::string& name) { return name.ends_with(".chunks") || name.starts_with(".filigree"); }));
    }

    std::string serial_;
};

} // namespace

TEST_F(Chunks, InAnyOrderTheyGiveTheSameBytesAsOneProcess) {
    write("shot.pc2", "what was there before");
    for (const int k : {3, 1, 7, 6, 2, 5}) {
        const Json said = json(chunk(std::to_string(k) + "/7"));
        EXPECT_FALSE(said["is_whole"]);
        EXPECT_FALSE(said["was_done"]);
        EXPECT_EQ(bytes_of(path("shot.pc2")), "what was there before") << "until all is there";
    }
    EXPECT_TRUE(json(chunk("2/7"))["was_done"]);
    const Json last = json(chunk("4/7"));
    EXPECT_TRUE(last["is_whole"]);
    EXPECT_EQ(last["chunks_done"], 7);
    EXPECT_EQ(bytes_of(path("shot.pc2")), serial_);
    EXPECT_EQ(left_over(), 0u);
    // A scheduler that runs one once more does no harm.
    EXPECT_TRUE(json(chunk("5/7"))["was_done"]);
    EXPECT_EQ(bytes_of(path("shot.pc2")), serial_);
    EXPECT_EQ(left_over(), 0u);
}

TEST_F(Chunks, ManyAtTheSameTimeAlsoTwiceTheSame) {
    const Ran ran = run_shell("for k in 1 2 3 4 5 6 3 1; do "
                              "\"$0\" restore moving.fil --frames -o shot.pc2 --quiet --chunk $k/6 & done; wait");
    EXPECT_EQ(ran.code, 0);
    EXPECT_EQ(ran.err, "");
    EXPECT_EQ(bytes_of(path("shot.pc2")), serial_);
    EXPECT_EQ(left_over(), 0u);
}

TEST_F(Chunks, KilledOnesAreRunAgain) {
    write("shot.pc2", "before");
    int killed = 0;
    for (int k = 0; k < 24; ++k) // whenever it strikes: before the plan, among the frames, at the end
        killed += run(chunk(std::to_string(1 + k % 3) + "/3"), "/dev/null", 0.004 * k, SIGKILL).code == -1;
    EXPECT_GT(killed, 3);
    if (!left_over()) return; // all of them came to their end
    for (const char* which : {"1/3", "2/3", "3/3"}) ok(chunk(which));
    EXPECT_EQ(bytes_of(path("shot.pc2")), serial_);
}

TEST_F(Chunks, JobsAreNotMixed) {
    ok(chunk("1/3"));
    fails(8, chunk("2/4"), {"shot.pc2.plan", "another job"});
    fails(8, {"restore", "moving.fil", "--frames", "-o", "shot.pc2", "--level", "1", "--chunk", "2/3"},
          {"another job"});
    for (const char* which : {"2/3", "3/3"}) ok(chunk(which));
    EXPECT_EQ(bytes_of(path("shot.pc2")), serial_);
    // Once it is whole, another one may begin.
    ok(chunk("1/2"));
    EXPECT_EQ(bytes_of(path("shot.pc2")), serial_);
    EXPECT_TRUE(json(chunk("2/2"))["is_whole"]);
    EXPECT_EQ(left_over(), 0u);
}

TEST_F(Chunks, MoreChunksThanFramesAndOtherInputs) {
    for (int k = 1; k <= 50; ++k) ok(chunk(std::to_string(k) + "/50"));
    EXPECT_EQ(bytes_of(path("shot.pc2")), serial_);
    for (const char* wrong : {"0/3", "4/3", "3", "a/b", "1/", "-1/3", "1/3x"}) fails(2, chunk(wrong), {"K/N"});
    fails(2, chunk("1/3", "frames/"), {".pc2"});
    fails(2, chunk("1/3", "shot.mdd"), {".pc2"});
    fails(2, {"restore", "moving.fil", "--frame", "1", "-o", "a.ply", "--chunk", "1/2"}, {"--chunk"});
    fails(6, chunk("1/3", "no/such/folder/shot.pc2"), {"cannot be written"});
}
