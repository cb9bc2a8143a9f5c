// filigree simulate, as a user runs it: scenes, their mistakes, outputs, stopping and going on.
#include "apps/program.h"
#include "cases.h"
#include "threads.h"

#include "filigree/file.h"
#include "filigree/io/model/model_file.h"
#include "filigree/physics/simulation.h"
#include "filigree/render.h"

using namespace filigree_test;
using namespace filigree;

namespace {

/// A small cube above the ground.
const std::string kDrop = "[simulation]\nframes = 6\n[[body]]\nname = \"cube\"\nshape = \"wavy-cube\"\nresolution = 8\n"
                          "particles = 200\ndriver = 60\nyoung_modulus = 6e4\ncentre = [0, 0.62, 0]\n"
                          "velocity = [0.5, -4, 0]\n[[obstacle]]\nshape = \"ground\"\n"
                          "[picture]\nsize = [64, 48]\npasses = 1\n";

class Simulate : public Program {
protected:
    void SetUp() override { write("drop.toml", kDrop); }

    static std::vector<std::string> words(const std::string& scene, const std::vector<std::string>& more) {
        std::vector<std::string> all = {"simulate", scene};
        all.insert(all.end(), more.begin(), more.end());
        return all;
    }
    /// What is said about a scene that must be refused.
    void refused(const std::string& scene, const std::vector<std::string>& needles, int code = 4) const {
        write("bad.toml", scene);
        const Ran ran = run({"simulate", "bad.toml", "-o", "x.fil"});
        SCOPED_TRACE(scene + "\n" + ran.err);
        EXPECT_EQ(ran.code, code);
        EXPECT_TRUE(ran.err.starts_with("filigree: bad.toml:"));
        EXPECT_EQ(std::count(ran.err.begin(), ran.err.end(), '\n'), 1);
        for (const std::string& needle : needles) EXPECT_NE(ran.err.find(needle), std::string::npos) << needle;
        EXPECT_FALSE(std::filesystem::exists(path("x.fil")));
    }
    PoseSequence poses(const std::string& name) const { return read_poses(path(name), kOneThread).value(); }
    bool has_opengl() const {
        ok({"make", "bar", "-o", "bar.ply", "--resolution", "2"});
        return run({"render", "bar.ply", "-o", "bar.png", "--size", "32x32", "--passes", "1"}).code != 5;
    }
};

const std::string kBody = "[[body]]\nshape = \"bar\"\n"; // two lines

} // namespace

/// A scan whose units nobody asked about: nine metres of soft rubber. It is told before the work, and the exit code
/// says what became of it.
TEST_F(Simulate, LeavesWithACodeOfItsOwnWhereTheMotionBrokeDown) {
    const std::string scene = "[simulation]\nframes = 12\n[[obstacle]]\nshape = \"ground\"\n"
                              "[[body]]\nname = \"koala\"\nshape = \"wavy-cube\"\nresolution = 8\nparticles = 64\n"
                              "driver = 60\nscale = 9.3\nmaterial = \"soft-rubber\"\nyoung_modulus = 1\n"
                              "centre = [0, 4.7, 0]\nvelocity = [0, -1000, 0]\n";
    write("koala.toml", scene);
    const Ran ran = run({"simulate", "koala.toml", "-o", "koala.fil"});
    EXPECT_NE(ran.err.find("cannot carry itself"), std::string::npos) << ran.err;
    EXPECT_EQ(ran.code, 10) << ran.err;
    EXPECT_NE(ran.err.find("koala.toml: the motion broke down"), std::string::npos) << ran.err;
    EXPECT_TRUE(std::filesystem::exists(path("koala.fil")));
    EXPECT_EQ(run({"simulate", "drop.toml", "-o", "drop.fil"}).code, 0);
}

TEST_F(Simulate, LeavesWithThatCodeWhereCellsWereInsideOutOrEnergyGrew) {
    const std::string cube = "[simulation]\nframes = 8\n[[body]]\nname = \"cube\"\nshape = \"wavy-cube\"\n"
                             "resolution = 8\namplitude = 0\nparticles = 200\ndriver = 60\n";
    write("sunk.toml", cube + "[[obstacle]]\nshape = \"ground\"\n");
    write("turned.toml",
          cube + "[[pin]]\nbox = { min = [-1, -1, -1], max = [1, -0.3, 1] }\n[[pin]]\nbox = { min = [-1, 0.3, -1], "
                 "max = [1, 1, 1] }\nmove = [{ time = 0, value = [0, 0, 0] }, { time = 0.1, value = [0, -1.5, 0] }]\n");
    for (const auto& [name, what] :
         {std::pair{"sunk", "energy came from nowhere"}, std::pair{"turned", "cells were inside out"}}) {
        const std::string scene = name + std::string(".toml"), model = name + std::string(".fil");
        const Ran ran = run({"simulate", scene, "-o", model});
        EXPECT_EQ(ran.code, 10) << ran.err;
        EXPECT_NE(ran.err.find("filigree: " + scene + ": "), std::string::npos) << ran.err;
        EXPECT_NE(ran.err.find(what), std::string::npos) << ran.err;
        EXPECT_TRUE(std::filesystem::exists(path(model)));
        // For every kind of output, a run that is resumed, and a sweep.
        EXPECT_EQ(run({"simulate", scene, "-o", "meshes/"}).code, 10);
        EXPECT_EQ(run({"simulate", scene, "-o", "out.glb", "-o", "out.pc2"}).code, 10);
        EXPECT_EQ(run({"simulate", scene, "--save", "state"}).code, 10);
        EXPECT_EQ(run({"simulate", scene, "--resume", "state", "-o", "again.fil"}).code, 10);
        const Ran sweep = run({"sweep", scene, "-o", "table.csv", "--set", "body.density=1000,1001"});
        EXPECT_EQ(sweep.code, 10) << sweep.err;
        EXPECT_NE(sweep.err.find("table.csv: 2 runs broke down (run 1, 2)"), std::string::npos) << sweep.err;
        const Json said = Json::parse(run({"simulate", scene, "-o", model, "--json"}).out);
        EXPECT_NE(said.at("doubt").get<std::string>().find(what), std::string::npos);
    }
    EXPECT_TRUE(json(words("drop.toml", {"--check"})).at("doubt").is_null());
}

TEST_F(Simulate, SaysWhatIsMovedAsRigid) {
    write("crumb.toml", "[simulation]\nframes = 3\n[[body]]\nname = \"crumb\"\nshape = \"wavy-cube\"\nsize = 0.3\n"
                        "particles = 8\ncentre = [1, 0.3, 0]\n");
    const Ran ran = run({"simulate", "crumb.toml", "-o", "crumb.fil"});
    EXPECT_NE(ran.out.find("body 'crumb' is moved as a rigid body: it has only 1 cell"), std::string::npos) << ran.out;
    EXPECT_EQ(ran.err.find("warning"), std::string::npos) << ran.err;
}

TEST_F(Simulate, RepeatedBodiesHaveOneRow) {
    write("heap.toml", "[simulation]\nframes = 2\n[[body]]\nname = \"stone\"\nshape = \"wavy-cube\"\nsize = 0.2\n"
                       "resolution = 8\nmaterial = \"stone\"\nparticles = 27\nrepeat = { count = 5, step = [0.5, 0, 0] "
                       "}\n");
    const std::string said = ok({"simulate", "heap.toml", "-o", "heap.fil"}).out;
    EXPECT_NE(said.find("stone, 5 times"), std::string::npos) << said;
    EXPECT_EQ(said.find("stone.2,"), std::string::npos) << said;
    for (int k = 1; k <= 5; ++k) EXPECT_EQ(poses("heap_stone." + std::to_string(k) + ".fil").frames.size(), 3u);
    EXPECT_EQ(json(words("heap.toml", {"-o", "heap.fil"}))["bodies"].size(), 5u);
}

TEST_F(Simulate, ACubeFallsAndItsPosesPlay) {
    const Json json = this->json(words("drop.toml", {"-o", "drop.fil"}));
    EXPECT_EQ(json["frames"], 6);
    EXPECT_EQ(json["bodies"][0]["name"], "cube");
    EXPECT_NEAR(json["bodies"][0]["mass_kg"].get<double>(), 1060, 60); // rubber, a cube of 1 m with coarse waves
    EXPECT_GT(json["most_contacts"], 0);
    EXPECT_LT(json["energy_end"]["potential"], json["energy_start"]["potential"]);

    const PoseSequence all = poses("drop.fil");
    ASSERT_EQ(all.frames.size(), 7u); // with the start
    EXPECT_EQ(all.frames_per_second, 60);
    EXPECT_NEAR(bounds(all.frames[0].positions).centre().y(), 0.62, 1e-3);
    EXPECT_LT(bounds(all.frames[6].positions).centre().y(), 0.55);
    EXPECT_GT(bounds(all.frames[6].positions).min.y(), -0.1); // the ground holds it
    EXPECT_GT(bounds(all.frames[6].positions).centre().x(), 0.02);

    ok({"restore", "drop.fil", "--frame", "7", "-o", "last.ply"});
    EXPECT_EQ(read_mesh(path("last.ply"), kOneThread)->mesh.vertex_count(), 386u);
    if (has_opengl()) {
        EXPECT_EQ(this->json({"render", "drop.fil", "-o", "f_%d.png", "--size", "64x48", "--passes", "1"})["frames"],
                  7);
    }
}

TEST_F(Simulate, TheSameBytesForAnyNumberOfThreads) {
    ok(words("drop.toml", {"-o", "one.fil", "--threads", "1"}));
    ok(words("drop.toml", {"-o", "two.fil", "--threads", "2"}));
    EXPECT_EQ(bytes_of(path("one.fil")), bytes_of(path("two.fil")));
}

TEST_F(Simulate, StoppedAndResumedIsAsRunThrough) {
    ok(words("drop.toml", {"-o", "through.fil", "--save", "through.state"}));
    ok(words("drop.toml", {"--stop-at", "3", "--save", "half.state"}));
    EXPECT_FALSE(std::filesystem::exists(path("half.fil")));
    ok(words("drop.toml", {"--resume", "half.state", "-o", "resumed.fil"}));
    EXPECT_EQ(bytes_of(path("through.fil")), bytes_of(path("resumed.fil")));
    // A longer scene goes on from the end of a shorter one.
    write("longer.toml", "# a comment\n" + kDrop);
    ok(words("longer.toml", {"--frames", "8", "--resume", "through.state", "-o", "longer.fil"}));
    EXPECT_EQ(poses("longer.fil").frames.size(), 9u);

    fails(2, words("drop.toml", {"--resume", "through.state", "--stop-at", "2", "--save", "x"}), {"frame 6"});
    write("other.toml", kDrop + "[world]\ngravity = [0, -1, 0]\n");
    fails(8, words("other.toml", {"--resume", "half.state", "-o", "x.fil"}), {"half.state", "another scene"});
    std::string damaged = bytes_of(path("half.state"));
    damaged[damaged.size() / 2] = static_cast<char>(damaged[damaged.size() / 2] ^ 1);
    write("damaged.state", damaged);
    fails(4, words("drop.toml", {"--resume", "damaged.state", "-o", "x.fil"}), {"damaged.state", "damaged"});
    write("short.state", damaged.substr(0, 12));
    fails(4, words("drop.toml", {"--resume", "short.state", "-o", "x.fil"}), {"short.state"});
    fails(4, words("drop.toml", {"--resume", "drop.toml", "-o", "x.fil"}), {"drop.toml", "no saved state"});
    fails(6, words("drop.toml", {"--save", "nowhere/state"}), {"nowhere/state"});
    EXPECT_EQ(ok(words("drop.toml", {"--save", "quiet.state", "--quiet"})).out, "");
    fails(3, words("drop.toml", {"--resume", "none.state", "-o", "x.fil"}), {"none.state"});
}

TEST_F(Simulate, WhenCancelledTheStateIsSavedAndNothingElse) {
    write("long.toml", "[simulation]\nframes = 100000\n" + kDrop.substr(kDrop.find("[[body]]")));
    Ran ran = run(words("long.toml", {"-o", "long.fil", "--save", "long.state"}), "/dev/null", 1.0);
    EXPECT_EQ(ran.code, 130) << ran.err;
    EXPECT_NE(ran.err.find("--resume long.state"), std::string::npos) << ran.err;
    EXPECT_FALSE(std::filesystem::exists(path("long.fil")));
    ASSERT_TRUE(std::filesystem::exists(path("long.state")));
    ran = run(words("long.toml", {"-o", "long.fil"}), "/dev/null", 0.5);
    EXPECT_EQ(ran.code, 130);
    EXPECT_FALSE(std::filesystem::exists(path("long.fil")));
    // The state is whole: it goes on.
    const Ran more = run(words("long.toml", {"--resume", "long.state", "--frames", "1", "--save", "more.state"}));
    EXPECT_EQ(more.code, 2);
    EXPECT_NE(more.err.find("already"), std::string::npos) << more.err;
}

TEST_F(Simulate, CheckComparesWithEveryVertexAttached) {
    const Json json = this->json(words("drop.toml", {"--check"}));
    const Json& check = json["bodies"][0]["check"];
    EXPECT_GT(check["rms_mean"], 0);
    EXPECT_LE(check["rms_mean"], check["rms_worst"]);
    EXPECT_LE(check["rms_worst"], check["max_worst"]);
    EXPECT_LT(check["rms_worst"], 0.02);
    EXPECT_GT(json["direct_ratio"], 0);
}

TEST_F(Simulate, OneRunWritesSeveralOutputs) {
    const bool films = has_opengl();
    std::vector<std::string> outputs = {"-o", "a.fil", "-o", "meshes/"};
    if (films) outputs.insert(outputs.end(), {"-o", "f_%02d.png"});
    ok(words("drop.toml", outputs));
    EXPECT_TRUE(std::filesystem::exists(path("meshes/cube_0001.ply")));
    EXPECT_TRUE(std::filesystem::exists(path("meshes/cube_0007.ply")));
    EXPECT_FALSE(std::filesystem::exists(path("meshes/cube_0008.ply")));
    ok({"restore", "a.fil", "--frame", "5", "-o", "fifth.ply"});
    EXPECT_EQ(bytes_of(path("fifth.ply")), bytes_of(path("meshes/cube_0005.ply")));
    if (films) {
        const Picture first = read_picture(path("f_01.png")).value(), last = read_picture(path("f_07.png")).value();
        EXPECT_EQ(first.width, 64u);
        EXPECT_GT(picture_distance(first, last), 1);
    }
    fails(2, words("drop.toml", {"-o", "a.fil", "-o", "a.fil"}), {"a.fil"});
    fails(5, words("drop.toml", {"-o", "a.ply"}), {"a.ply", ".fil", ".mp4"});
    fails(6, words("drop.toml", {"-o", "nowhere/a.fil"}), {"nowhere"});
    fails(2, words("drop.toml", {}), {"-o"});
    fails(2, words("drop.toml", {"--stop-at", "3", "-o", "x.fil"}), {"--save"});
}

TEST_F(Simulate, NothingGoesOverWhatIsReadOrOverAnotherOutput) {
    ok({"make", "bar", "-o", "bar.ply", "--resolution", "4"});
    ok({"strip", "bar.ply", "-o", "bar.fil", "--base", "40"});
    const auto refuses = [&](const std::string& scene, const std::vector<std::string>& more) {
        const std::string model = bytes_of(path("bar.fil")), toml = bytes_of(path(scene));
        fails(2, words(scene, more), {"would be overwritten"});
        EXPECT_EQ(bytes_of(path("bar.fil")), model);
        EXPECT_EQ(bytes_of(path(scene)), toml);
    };
    write("model.toml", "[[body]]\nname = \"b\"\nmesh = \"bar.fil\"\nparticles = 100\n[simulation]\nframes = 1\n");
    refuses("model.toml", {"-o", "bar.fil"});
    refuses("model.toml", {"-o", "./bar.fil"});
    refuses("model.toml", {"--save", "bar.fil"});
    refuses("model.toml", {"--save", "model.toml"});
    refuses("model.toml", {"-o", "x.fil", "--save", "x.fil"});
    refuses("model.toml", {"-o", "x.fil", "-o", "./x.fil"});
    refuses("model.toml", {"-o", "meshes/", "-o", "./meshes/"});
    refuses("model.toml", {"-o", "./", "--save", "b_0001.ply"});
    refuses("model.toml", {"-o", "f_%02d.png", "--save", "f_01.png"});
    std::filesystem::create_symlink("bar.fil", path("link.fil"));
    refuses("model.toml", {"-o", "link.fil"});
    write("obstacle.toml", kDrop + "[[obstacle]]\nshape = \"mesh\"\nmesh = \"cube_0001.ply\"\n[[body]]\nshape = "
                                   "\"bar\"\nname = \"two\"\n[[body]]\nmesh = \"bar.fil\"\nname = \"three\"\n");
    ok({"make", "bar", "-o", "cube_0001.ply"});
    refuses("obstacle.toml", {"-o", "."});
    refuses("obstacle.toml", {"-o", "cube_0001.fil", "--save", "cube_0001.ply"});
    refuses("obstacle.toml", {"-o", "x.fil", "--save", "x_two.fil"});
    EXPECT_FALSE(std::filesystem::exists(path("x.fil")));
    // A state that is gone on from may be renewed.
    ok(words("model.toml", {"--save", "a.state"}));
    ok(words("model.toml", {"--resume", "a.state", "--save", "a.state", "--frames", "2"}));
}

TEST_F(Simulate, WarnsOfMotionThatIsNotToBeTrusted) {
    const auto warnings = [&](const std::string& scene, const std::vector<std::string>& more) {
        write("warned.toml", scene);
        std::vector<std::string> all = words("warned.toml", more);
        all.emplace_back("--json");
        return Json::parse(run(all).out)["warnings"].dump();
    };
    EXPECT_EQ(warnings(kDrop, {"--check"}), "[]");
    const std::string bounce = kDrop + "[[obstacle]]\nshape = \"ball\"\ncentre = [9, 9, 9]\n";
    EXPECT_EQ(warnings(bounce, {"--check", "--frames", "90"}), "[]");
    // It starts deep inside the ground, which throws it out.
    const std::string inside = "[[obstacle]]\nshape = \"ground\"\npoint = [0, 0.5, 0]\n";
    EXPECT_NE(warnings(kDrop + inside, {"--check", "--frames", "30"}).find("energy grew"), std::string::npos);
    const std::string pinned =
        "[[pin]]\nball = { centre = [0, 1, 0], radius = 0.2 }\nmove = [{ time = 0, value = [0, 0, "
        "0] }, { time = 9, value = [0, 1, 0] }]\n";
    EXPECT_EQ(warnings(kDrop + inside + pinned, {"--check"}).find("energy grew"), std::string::npos);

    write("shot.toml", "[[body]]\nshape = \"bar\"\nresolution = 4\nparticles = 200\nyoung_modulus = 1e3\n"
                       "velocity = [0, -300, 0]\ncentre = [0, 1, 0]\n[[obstacle]]\nshape = \"ground\"\n");
    const Ran ran = run(words("shot.toml", {"--check", "--frames", "3", "--json"}));
    EXPECT_EQ(ran.code, 10) << ran.err;
    const std::string shot = Json::parse(ran.out)["warnings"].dump();
    EXPECT_NE(shot.find("motions of particles were not finite or had to be limited"), std::string::npos) << shot;
    EXPECT_NE(shot.find("inside out at the end"), std::string::npos) << shot;
    const std::string apart = kDrop + "[[body]]\nshape = \"bar\"\nparticles = 100\nresolution = 4\ncentre = [";
    EXPECT_EQ(warnings(apart + "500, 3, 0]\n", {"--check", "--frames", "1"}), "[]");
    EXPECT_NE(warnings(apart + "1e5, 3, 0]\n", {"--check", "--frames", "1"}).find("body 'bar'"), std::string::npos);
}

TEST_F(Simulate, SeveralBodiesAreFilesOfTheirOwn) {
    write("two.toml", kDrop +
                          "[[body]]\nshape = \"bar\"\nresolution = 4\nlength = 2\nsize = 0.3\nparticles = 100\n"
                          "centre = [0, 4.6, 0]\nmaterial = \"lattice\"\n[[pin]]\nbody = \"bar\"\nvertices = [0]\n"
                          "[[force]]\nbody = \"cube\"\nnewtons = [{ time = 0, value = [0, 0, 0] }, { time = 0.1, "
                          "value = [1e3, 0, 0] }]\n[[hand]]\nbody = \"cube\"\npoint = [0, 2, 0]\ntarget = [0, 2, 0]\n");
    ok(words("two.toml", {"-o", "two.fil", "--frames", "3"}));
    EXPECT_EQ(poses("two_cube.fil").frames.size(), 4u);
    EXPECT_EQ(poses("two_bar.fil").frames.size(), 4u);
    EXPECT_FALSE(std::filesystem::exists(path("two.fil")));
}

TEST_F(Simulate, AModelIsABodyAndScaleMakesMetres) {
    ok({"make", "wavy-cube", "-o", "cube.ply", "--resolution", "8", "--size", "100"});
    ok({"strip", "cube.ply", "-o", "cube.fil", "--base", "80"});
    write("model.toml", "[[body]]\nmesh = \"cube.fil\"\nscale = 0.01\nparticles = 200\ncentre = [0, 3, 0]\n"
                        "rotate = { axis = [0, 0, 1], degrees = 90 }\n[simulation]\nframes = 2\n");
    ok(words("model.toml", {"-o", "moved.fil"}));
    const PoseSequence moved = poses("moved.fil");
    EXPECT_EQ(moved.frames[0].positions.size(), 80u);
    EXPECT_NEAR(moved.frames[0].gradients[0].determinant(), 1e-6, 1e-8);
    ok({"restore", "moved.fil", "--frame", "1", "-o", "start.ply"});
    const Box box = world_bounds(read_mesh(path("start.ply"), kOneThread)->mesh);
    EXPECT_NEAR(box.centre().y(), 3, 1e-3);
    EXPECT_NEAR(box.size().x(), 1.06, 0.03);
}

TEST_F(Simulate, ObstaclesPinsAndWindAct) {
    const std::string bar = "shape = \"bar\"\nresolution = 4\nlength = 2\nsize = 0.4\nparticles = 150\ndriver = 60\n"
                            "young_modulus = 2e4\n";
    ok({"make", "bar", "-o", "shelf.ply", "--resolution", "8", "--length", "2"});
    const std::string shelf = "[[obstacle]]\nshape = \"mesh\"\nmesh = \"shelf.ply\"\ncentre = [0, -0.7, 0]\n";
    const auto last_box = [&](const std::string& name, const std::string& scene) {
        write(name + ".toml", "[simulation]\nduration = 0.5\n" + scene);
        ok(words(name + ".toml", {"-o", name + ".fil"}));
        return bounds(poses(name + ".fil").frames.back().positions);
    };
    const Box alone = last_box("alone", "[[body]]\n" + bar);
    EXPECT_LT(alone.centre().y(), -1); // half a second of falling
    EXPECT_NEAR(last_box("shelf", "[[body]]\n" + bar + shelf).min.y(), -0.2, 0.08);
    const Box blown = last_box("blown", "[world]\nwind = [20, 0, 0]\n[[body]]\n" + bar + "density = 20\n");
    EXPECT_GT(blown.centre().x(), 0.2);
    // All of it held, moved and turned; the pivot is its middle.
    const Box held =
        last_box("held", "[[body]]\n" + bar +
                             "[[pin]]\nbox = { min = [-1, -1, -1], max = [1, 1, 1] }\nmove = [{ time = 0, "
                             "value = [0, 0, 0] }, { time = 0.2, value = [0, 1, 0] }]\nturn = [{ time = 0, "
                             "value = [0, 0, 0] }, { time = 0.4, value = [0, 0, 90] }]\n");
    EXPECT_NEAR(held.centre().y(), 1, 1e-3);
    EXPECT_NEAR(held.size().y(), 0.8, 1e-3);
    EXPECT_NEAR(held.size().x(), 0.4, 1e-3);
    const Box pulled = last_box("pulled", "[world]\ngravity = [0, 0, 0]\n[[body]]\n" + bar +
                                              "[[hand]]\npoint = [1, 0, 0]\ntarget = [0.9, 0, 0]\n");
    EXPECT_GT(pulled.max.x(), 0.5);
    const Box pushed = last_box("pushed", "[world]\ngravity = [0, 0, 0]\n[[body]]\n" + bar +
                                              "damping = 0\n[[force]]\nnewtons = [0, 0, 140.8]\n");
    const double mass = json(words("pushed.toml", {"--check"}))["bodies"][0]["mass_kg"];
    EXPECT_NEAR(mass, 140.8, 18); // a coarse lattice is a little heavier than the bar
    EXPECT_NEAR(pushed.centre().z(), 0.125 * 140.8 / mass, 0.003);
}

TEST_F(Simulate, FarFromTheOriginItMovesAsNearIt) {
    // The same scene at the origin and at `at`, with everything that has a place.
    const auto scene = [](const std::string& x) {
        const auto point = [&](const std::string& y) { return "[" + x + ", " + y + ", 0]"; };
        return "[simulation]\nframes = 20\n[[body]]\nname = \"cube\"\nshape = \"wavy-cube\"\nresolution = 8\n"
               "particles = 200\ndriver = 60\nyoung_modulus = 5e4\nvelocity = [0, -3, 0]\ncentre = " +
               point("0.62") +
               "\n[[obstacle]]\nshape = \"ground\"\n[[obstacle]]\nshape = \"ball\"\nradius = 0.3\ncentre = " +
               point("0") +
               "\n[[obstacle]]\nshape = \"mesh\"\nmesh = \"shelf.ply\"\nscale = 0.2\ncentre = " + point("-0.1") +
               "\n[[pin]]\nball = { centre = " + point("1.1") + ", radius = 0.3 }\npivot = " + point("1") +
               "\nturn = [{ time = 0, value = [0, 0, 0] }, { time = 0.3, value = [0, 20, 0] }]\n" +
               "[[hand]]\npoint = " + point("0") + "\ntarget = " + point("-0.2") + "\n[picture]\nsize = [64, 48]\n" +
               "passes = 1\neye = [" + x + ", 2, 5]\ntarget = " + point("0.5") + "\n";
    };
    ok({"make", "bar", "-o", "shelf.ply", "--resolution", "4"});
    write("near.toml", scene("0"));
    write("far.toml", scene("131072"));
    const bool films = has_opengl();
    const auto outputs = [&](const std::string& name) {
        std::vector<std::string> all = {"-o", name + ".fil", "-o", name + "/"};
        if (films) all.insert(all.end(), {"-o", name + "_%02d.png"});
        return all;
    };
    ok(words("near.toml", outputs("near")));
    ok(words("far.toml", outputs("far")));
    for (const std::string name : {"near", "far"}) ok({"restore", name + ".fil", "--frame", "21", "-o", name + ".ply"});
    const Vec3d offset(131072, 0, 0);
    for (const std::string file : {".ply", "/cube_0021.ply"}) {
        const Mesh near = read_mesh(path("near" + file), kOneThread)->mesh,
                   far = read_mesh(path("far" + file), kOneThread)->mesh;
        ASSERT_EQ(near.vertex_count(), far.vertex_count());
        for (std::size_t v = 0; v < near.vertex_count(); ++v)
            ASSERT_LT((near.world_position(v) + offset - far.world_position(v)).norm(), 1e-3) << file << " " << v;
    }
    if (films) {
        const Picture a = read_picture(path("near_21.png")).value(), b = read_picture(path("far_21.png")).value();
        EXPECT_LT(picture_distance(a, b), 0.5);
    }
}

TEST_F(Simulate, UnknownKeysGetLineAndSuggestion) {
    refused(kBody + "youngs_modulus = 1e5\n",
            {"bad.toml:3: unknown key 'youngs_modulus' in [[body]]; did you mean 'young_modulus'?"});
    refused(kBody + "[simulation]\nframe = 3\n", {"bad.toml:4: unknown key 'frame' in [simulation]", "'frames'"});
    refused(kBody + "colour = \"#ffffff\"\n", {"bad.toml:3:", "'color'"});
    refused(kBody + "restitution = 1\n", {"bad.toml:3:", "'restitution' in [[body]]; it belongs to [[obstacle]]."});
    refused(kBody + "dens = 1\n", {"bad.toml:3:", "'density'?"});
    refused(kBody + "quaternion = 1\n", {"bad.toml:3: unknown key 'quaternion'", "docs/scenes.md"});
    refused(kBody + "[[bodies]]\n", {"bad.toml:3: unknown table 'bodies'; did you mean [[body]]?"});
    refused("[body]\nshape = \"bar\"\n", {"bad.toml:1:", "[[body]]"});
    refused(kBody + "[[world]]\n", {"bad.toml:3:", "[world]"});
}

TEST_F(Simulate, WrongTypesAndRangesAreNamed) {
    refused(kBody + "density = \"heavy\"\n", {"bad.toml:3:", "'density'", "number", "\"heavy\""});
    refused(kBody + "[simulation]\nduration = 20000\n", {"bad.toml:4:", "1200000 frames", "1000000", "duration"});
    refused(kBody + "[simulation]\nframes_per_second = 9\n", {"bad.toml:4:", "10 to 10000", "9"});
    refused(kBody + "density = -1\n", {"bad.toml:3:", "1e-09 to", "-1"});
    refused(kBody + "poisson_ratio = 0.5\n", {"bad.toml:3:", "0 to 0.49"});
    refused(kBody + "particles = 1.5\n", {"bad.toml:3:", "whole number"});
    refused(kBody + "centre = [1, 2]\n", {"bad.toml:3:", "three numbers", "and is [1, 2]"});
    refused(kBody + "centre = [1, 2, nan]\n", {"bad.toml:3:", "three numbers"});
    refused(kBody + "color = \"red\"\n", {"bad.toml:3:", "#rrggbb"});
    refused(kBody + "material = \"ruber\"\n", {"bad.toml:3:", "'rubber'?"});
    refused(kBody + "model = \"springs\"\nyield_stress = 1e3\n", {"bad.toml:", "fem", "meshfree"});
    refused(kBody + "rotate = { axis = [0, 0, 0], degrees = 3 }\n", {"bad.toml:3:", "rotate.axis", "and is [0, 0, 0]"});
    refused(kBody + "rotate = { axis = [0, 0, 1] }\n", {"bad.toml:3:", "axis and degrees", "a table with axis."});
    refused(kBody + "rotate = {}\n", {"bad.toml:3:", "axis and degrees", "an empty table."});
    refused(kBody + "centre = []\n", {"bad.toml:3:", "three numbers", "an empty list."});
    refused(kBody + "centre = [1, 2, 3, 4, 5]\n", {"bad.toml:3:", "three numbers", "a list of 5."});
    refused(kBody + "amplitude = 11\n", {"bad.toml:3:", "'amplitude'", "0 to 10"});
    refused("[world]\nair_temperature = 0\n" + kBody, {"bad.toml:2:", "above 0"});
    refused(kBody + "name = \"a/b\"\n", {"bad.toml:3:", "letters"});
    refused(kBody + "mesh = \"a.ply\"\n", {"bad.toml:1:", "one of mesh and shape"});
    refused("[[body]]\n", {"bad.toml:1:", "one of mesh and shape"});
    refused("[[body]]\nshape = \"blob\"\n", {"bad.toml:2:", "wavy-cube"});
    refused("[[body]]\nmesh = \"none.ply\"\n", {"bad.toml:2:", "none.ply"}, 3);
    refused("[[body]]\nmesh = \"bad.toml\"\n", {"bad.toml:1:"}, 5);
    refused(kBody + "[[obstacle]]\nshape = \"ball\"\nsize = [1, 1, 1]\n", {"bad.toml:5:", "'size'", "box", "ball"});
    refused(kBody + "[[obstacle]]\nshape = \"mesh\"\n", {"bad.toml:3:", "mesh"});
    refused(kBody + "[[obstacle]]\nshape = \"box\"\nmove = [{ time = 1, value = [0, 0, 0] }, { time = 0.5, value = [1, "
                    "0, 0] }]\n",
            {"bad.toml:5:", "ascend"});
    refused(kBody + "[[obstacle]]\nshape = \"box\"\nmove = [{ time = 1 }]\n", {"bad.toml:5:", "time", "value"});
    refused(kBody + "[[pin]]\nbody = \"baa\"\n", {"bad.toml:4:", "'baa'", "bar"});
    refused(kBody + "[[pin]]\nbox = { min = [9, 9, 9], max = [10, 10, 10] }\n", {"bad.toml:3:", "no particle"});
    refused(kBody + "[[pin]]\nvertices = [1000000]\n", {"bad.toml:3:", "1000000"});
    refused(kBody + "material = \"stone\"\n[[pin]]\n", {"bad.toml:4:", "rigid", "obstacle"});
    refused(kBody + "[[pair]]\nfirst = \"bar\"\n", {"bad.toml:3:", "second"});
    refused(kBody + "[[pair]]\nfirst = \"bar\"\nsecond = \"wax\"\n", {"bad.toml:5:", "'wax'"});
    refused(kBody + "[[pair]]\nfirst = \"bar\"\nsecond = \"bar\"\nfriction = -1\n", {"bad.toml:6:", "friction"});
    refused(kBody + "[[hand]]\ntarget = [0, 0, 0]\n", {"bad.toml:3:", "point and vertex"});
    refused(kBody + "[simulation]\nframes = 1\nduration = 2\n", {"bad.toml:5:", "frames and duration"});
    refused(kBody + "[simulation]\nmode = \"fast\"\n", {"bad.toml:4:", "auto, explicit"});
}

TEST_F(Simulate, WhatIsNoSceneIsRefused) {
    refused("", {"no [[body]]"});
    refused("[simulation]\nframes = 3\n", {"no [[body]]"});
    refused("[[body]\n", {"bad.toml:1:"});
    refused(kBody + "shape = \"bar\"\n", {"bad.toml:3:"}); // twice
    refused(std::string("\0\xff\xfe", 3), {"bad.toml:1:"});
    fails(3, {"simulate", "none.toml", "-o", "x.fil"}, {"none.toml"});
    fails(2, {"simulate"}, {"SCENE.toml"});
    EXPECT_FALSE(std::filesystem::exists(path("x.fil")));
}

TEST_F(Simulate, TheManualShowsEveryKey) {
    std::istringstream keys(ok({"simulate", "--keys"}).out);
    const std::string manual = bytes_of(FILIGREE_ROOT "/docs/scenes.md");
    std::size_t lines = 0;
    for (std::string line; std::getline(keys, line); ++lines)
        EXPECT_NE(manual.find(line + "\n"), std::string::npos) << "docs/scenes.md lacks: " << line;
    EXPECT_GT(lines, 90u);
}

TEST_F(Simulate, KeysThatDoNothingForAModelAreRefused) {
    for (const std::string key :
         {"temperature", "melting_from", "melting_to", "viscosity", "heating", "conductivity"}) {
        const std::string needle = "'" + key + "' in [[body]] is for model = \"mpm\", and this body's is \"";
        refused(kBody + key + " = 1\n", {"bad.toml:3: " + needle + "fem\"."});
        refused(kBody + "material = \"lattice\"\n" + key + " = 1\n", {"bad.toml:4: " + needle + "springs\"."});
        refused(kBody + "material = \"clay\"\n" + key + " = 1\n", {"bad.toml:4: " + needle + "meshfree\"."});
        refused(kBody + "material = \"wax\"\nmodel = \"fem\"\n" + key + " = 1\n", {"bad.toml:5: " + needle});
    }
    refused(kBody + "material = \"lattice\"\nyield_stress = 1\n", {"bad.toml:4:", "'yield_stress'", "is \"springs\""});
    refused(kBody + "material = \"wax\"\ncreep_time = 1\n", {"bad.toml:4:", "'creep_time'", "is \"mpm\""});
    refused(kBody + "[[fracture]]\nplastic_opening = 0.1\n", {"bad.toml:4:", "'plastic_opening'", "yield_stress"});
    for (const std::string key : {"specific_heat", "latent_heat"})
        refused(kBody + "material = \"clay\"\n" + key + " = 1\n", {"bad.toml:4:", "'" + key + "'", "\"mpm\""});
    refused(kBody + "bending = 0.1\n", {"bad.toml:3:", "'bending'", "\"springs\"", "\"fem\""});
    refused(kBody + "material = \"clay\"\nbending = 0.1\n", {"bad.toml:4:", "'bending'", "\"meshfree\""});
    refused(kBody + "material = \"lattice\"\npoisson_ratio = 0.25\n",
            {"bad.toml:4:", "'poisson_ratio'", "\"fem\", \"meshfree\" or \"mpm\"", "is \"springs\""});
    for (const std::string key : {"young_modulus", "poisson_ratio", "internal_damping"})
        refused(kBody + "material = \"stone\"\n" + key + " = 0.1\n", {"bad.toml:4:", "'" + key + "'", "is \"rigid\""});
    // What a material brings along is left out without a word.
    write("fem.toml", kBody + "resolution = 4\nparticles = 100\nmaterial = \"wax\"\nmodel = \"fem\"\n");
    ok(words("fem.toml", {"--frames", "1", "--check"}));
    write("clay.toml", kBody +
                           "resolution = 4\nparticles = 100\nmaterial = \"clay\"\nmodel = \"fem\"\nyield_stress = 5e3\n"
                           "creep_time = 0.01\n[[fracture]]\npieces = 3\nplastic_opening = 0.1\n");
    ok(words("clay.toml", {"--frames", "1", "--check"}));
}

TEST_F(Simulate, IceMeltsAndSaysWhatItPassesThrough) {
    write("ice.toml", "[world]\nair_temperature = [{ time = 0, value = 300 }, { time = 1, value = 400 }]\n"
                      "air_heat_transfer = 1e5\n[[body]]\nshape = \"wavy-cube\"\nresolution = 8\nparticles = 200\n"
                      "material = \"ice\"\n[[body]]\nshape = \"bar\"\nresolution = 4\nparticles = 100\n"
                      "centre = [5, 0, 0]\n[[heat]]\nradius = 1\npower = 1e3\n"
                      "[picture]\nsize = [64, 48]\npasses = 1\n");
    const Ran ran = run(words("ice.toml", {"--frames", "3", "-o", "ice.fil", "-o", "ice.mp4", "-o", "ice.usda", "-o",
                                           "ice.glb", "-o", path("ice/"), "--json"}));
    ASSERT_EQ(ran.code, 0) << ran.err;
    // Both bodies are one surface, closed in every frame; the start is their meshes.
    for (const std::string number : {"0001", "0004"}) {
        const std::string info = ok({"info", path("ice/wavy-cube_" + number + ".ply")}).out;
        EXPECT_EQ(info.find("closed                 no"), std::string::npos) << info;
        EXPECT_EQ(info.find("manifold               no"), std::string::npos) << info;
    }
    const std::string usd = bytes_of(path("ice_wavy-cube.usda")); // the bar is of rubber, and a file of its own
    for (const char* word : {"faceVertexCounts.timeSamples", "velocities.timeSamples", "primvars:origin.timeSamples"})
        EXPECT_NE(usd.find(word), std::string::npos) << word;
    EXPECT_NE(bytes_of(path("ice_wavy-cube.glb")).find("\"STEP\""), std::string::npos);
    EXPECT_NE(bytes_of(path("ice_bar.glb")).find("\"skins\""), std::string::npos);
    const std::string bar = bytes_of(path("ice_bar.usda"));
    EXPECT_EQ(bar.find("velocities"), std::string::npos);
    for (const std::string& text : {usd, bar}) EXPECT_NE(text.find("metersPerUnit = 1\n"), std::string::npos);
    EXPECT_NE(ran.out.find("pass through bodies of other models"), std::string::npos) << ran.out;
    refused(kBody + "material = \"ice\"\nlatent_heat = -1\n", {"bad.toml:4:", "latent_heat"});
    refused("[world]\nair_temperature = [{ time = 1, value = 3 }, { time = 1, value = 4 }]\n" + kBody,
            {"bad.toml:2:", "must ascend"});
}

TEST_F(Simulate, TheManualsDefaultsAreTheLibrarys) {
    const std::string manual = ok({"simulate", "--keys"}).out;
    // The fourth cell of a key's row in a table.
    const auto unset = [&](const std::string& table, const std::string& key) {
        const std::size_t row = manual.find("| `" + key + "` |", manual.find("`" + table + "`\n"));
        std::istringstream line(manual.substr(row, manual.find('\n', row) - row));
        std::string cell;
        for (int i = 0; i < 5; ++i) std::getline(line, cell, '|');
        return std::strtod(cell.c_str(), nullptr);
    };
    const StepOptions step;
    EXPECT_EQ(unset("[simulation]", "frames_per_second"), step.frames_per_second);
    EXPECT_EQ(unset("[simulation]", "most_substeps"), step.most_substeps);
    EXPECT_EQ(unset("[world]", "body_friction"), World{}.body_friction);
    EXPECT_EQ(unset("[world]", "body_restitution"), World{}.body_restitution);
    EXPECT_EQ(unset("[[body]]", "particles"), BodyOptions{}.cells.count);
    EXPECT_EQ(unset("[[obstacle]]", "friction"), Obstacle{}.friction);
    EXPECT_EQ(unset("[[obstacle]]", "restitution"), Obstacle{}.restitution);
    EXPECT_EQ(unset("[[obstacle]]", "stiffness"), Obstacle{}.stiffness);
}

TEST_F(Simulate, TheExamplesRun) {
    std::vector<std::string> names = {"bounce", "bar_sag", "press", "melt", "collide",
                                      "wall",   "slope",   "fold",  "heap", "shatter"};
    if (all_cases()) names.push_back("glass");
    for (const std::string& name : names) {
        SCOPED_TRACE(name);
        const std::string scene = FILIGREE_ROOT "/examples/scenes/" + name + ".toml";
        const Json json = this->json({"simulate", scene, "--frames", "2", "-o", "out.fil"});
        EXPECT_EQ(json["frames"], 2);
        EXPECT_EQ(json["clamped_particles"], 0);
        EXPECT_GT(json["least_volume_ratio"], 0.5);
        EXPECT_EQ(json["warnings"], Json::array());
    }
    std::vector<std::string> brought = {"koala_drop", "koala_sit", "creature"}; // meshes that a user has to bring
    if (all_cases()) brought.push_back("dragon_pull");
    for (const std::string& name : brought) {
        const std::string scene = FILIGREE_ROOT "/examples/scenes/" + name + ".toml";
        const Ran ran = run({"simulate", scene, "--frames", "1", "-o", "out.fil"});
        EXPECT_TRUE(ran.code == 0 || ran.code == 3) << ran.err;
        if (ran.code == 3) {
            EXPECT_NE(ran.err.find("there is no file"), std::string::npos) << ran.err;
        }
    }
}
