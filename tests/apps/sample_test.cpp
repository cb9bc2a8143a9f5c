// filigree sample, as a user runs it.
#include "apps/program.h"
#include "cases.h"

#include <gtest/gtest.h>

#include <cmath>

using namespace filigree_test;

namespace {

class Sample : public Program {
protected:
    void make_cube() { ok({"make", "wavy-cube", "-o", "cube.obj", "--resolution", "16", "--quiet"}); }
    void make_open() {
        make_cube();
        ASSERT_EQ(run_shell("head -n -3 cube.obj > open.obj").code, 0);
    }
};

TEST_F(Sample, CountsAndMethodsAgree) {
    make_cube();
    const Json scan = json({"sample", "cube.obj", "-o", "scan.ply", "--count", "3000"});
    EXPECT_EQ(scan.at("method"), "scan");
    EXPECT_NEAR(scan.at("points").get<double>(), 3000, 150);
    const std::string spacing = scan.at("spacing_units").dump();
    const Json rays = json({"sample", "cube.obj", "-o", "rays.ply", "--spacing", spacing, "--method", "rays"});
    const Json winding = json({"sample", "cube.obj", "-o", "winding.ply", "--spacing", spacing, "--method", "winding"});
    EXPECT_EQ(bytes_of(path("scan.ply")), bytes_of(path("rays.ply")));
    EXPECT_EQ(bytes_of(path("scan.ply")), bytes_of(path("winding.ply")));
    EXPECT_EQ(rays.at("points"), scan.at("points"));
    EXPECT_EQ(winding.at("open_edges"), 0);
}

TEST_F(Sample, AnOpenMeshIsTakenByWindingNumbers) {
    make_open();
    const Json open = json({"sample", "open.obj", "-o", "points.ply", "--spacing", "0.1"});
    EXPECT_EQ(open.at("method"), "winding");
    EXPECT_GT(open.at("points").get<int>(), 500);
    EXPECT_EQ(open.at("open_edges"), 8);
    EXPECT_EQ(open.at("warnings"), Json::array()) << "no point of it is doubtful";
    EXPECT_NE(ok({"sample", "open.obj", "-o", "points.ply", "--spacing", "0.1"}).out.find("as 8 edges do not close"),
              std::string::npos);
    ASSERT_EQ(run_shell("head -n -512 cube.obj > gaping.obj").code, 0); // two of its six sides
    const Json gaping = json({"sample", "gaping.obj", "-o", "points.ply", "--spacing", "0.1"});
    EXPECT_EQ(gaping.at("warnings").size(), 1u);
    fails(7, {"sample", "open.obj", "-o", "x.ply", "--spacing", "0.1", "--method", "scan"}, {"open edges", "winding"});
}

/// A box of 2 x 2 x 2 with a smaller one inside it, all faces outwards: 7 are inside.
std::string hollow_box() {
    std::string text;
    for (const char* half : {"1", "0.5"})
        for (int corner = 0; corner < 8; ++corner) {
            text += "v";
            for (int axis = 0; axis < 3; ++axis) text += std::string(corner >> axis & 1 ? " " : " -") + half;
            text += "\n";
        }
    constexpr int kFaces[6][4] = {{1, 3, 4, 2}, {5, 6, 8, 7}, {1, 2, 6, 5}, {3, 7, 8, 4}, {1, 5, 7, 3}, {2, 4, 8, 6}};
    for (const int first : {0, 8})
        for (const auto& face : kFaces) {
            text += "f";
            for (const int corner : face) text += " " + std::to_string(first + corner);
            text += "\n";
        }
    return text;
}

TEST_F(Sample, EveryCommandHasOneInsideAndSaysWhatItTurned) {
    write("hollow.obj", hollow_box());
    const auto says_so = [](const Json& report) {
        ASSERT_EQ(report.at("warnings").size(), 1u);
        EXPECT_NE(report.at("warnings")[0].get<std::string>().find("counts as a hollow"), std::string::npos);
    };
    for (const char* method : {"auto", "scan", "rays", "winding"}) {
        const Json sample = json({"sample", "hollow.obj", "-o", "p.ply", "--spacing", "0.1", "--method", method});
        EXPECT_EQ(sample.at("points"), 7000);
        says_so(sample);
    }
    const Json info = json({"info", "hollow.obj"});
    EXPECT_NEAR(info.at("inside_volume").get<double>(), 7, 1e-9);
    EXPECT_NE(info.at("inside_said").get<std::string>().find("hollow"), std::string::npos);
    const Json fracture = json({"fracture", "hollow.obj", "-o", "f.obj", "--pieces", "5"});
    EXPECT_NEAR(fracture.at("volume").get<double>(), 7, 1e-4);
    EXPECT_EQ(fracture.at("open_edges"), 0);
    says_so(fracture);
    write("s.toml",
          "[simulation]\nframes = 1\n[[body]]\nmesh = \"hollow.obj\"\nmaterial = \"rubber\"\nspacing = 0.125\n"
          "[[obstacle]]\nshape = \"mesh\"\nmesh = \"hollow.obj\"\ncentre = [0, -5, 0]\n");
    const Json simulated = json({"simulate", "s.toml", "-o", "s.pc2"});
    EXPECT_NEAR(simulated.at("bodies")[0].at("volume_m3").get<double>(), 7, 0.07);
    const std::string warnings = simulated.at("warnings").dump();
    EXPECT_NE(warnings.find("body 'hollow'"), std::string::npos) << warnings;
    EXPECT_NE(warnings.find("obstacle 'hollow.obj'"), std::string::npos) << warnings;
}

TEST_F(Sample, ThePictureStandsAsTheFileDoes) {
    if (!all_cases()) GTEST_SKIP() << "as Remesh.PictureIsDrawn: scripts/check cases runs it";
    ok({"make", "wavy-cube", "-o", "cube.stl", "--resolution", "8", "--quiet"}); // says nothing; STL has z up
    const Ran ran = run({"sample", "cube.stl", "-o", "points.ply", "--count", "50", "--picture", "p.png", "--json"});
    if (ran.code == 5) GTEST_SKIP() << "no OpenGL";
    ASSERT_EQ(ran.code, 0) << ran.err;
    EXPECT_EQ(Json::parse(ran.out).at("up"), "z");
    EXPECT_TRUE(bytes_of(path("p.png")).starts_with("\x89PNG"));
}

TEST_F(Sample, PatternsAreSeeded) {
    make_cube();
    for (const char* pattern : {"jitter", "poisson"}) {
        const std::vector<std::string> base = {"sample", "cube.obj", "--spacing", "0.1", "--pattern", pattern, "-o"};
        const auto with = [&](const char* file, const char* seed) {
            std::vector<std::string> arguments = base;
            arguments.insert(arguments.end(), {file, "--seed", seed, "--quiet"});
            ok(arguments);
            return bytes_of(path(file));
        };
        EXPECT_EQ(with("a.ply", "1"), with("b.ply", "1"));
        EXPECT_NE(with("a.ply", "1"), with("c.ply", "2"));
    }
}

TEST_F(Sample, WrongArgumentsAreRefusedInASentence) {
    make_cube();
    fails(2, {"sample", "cube.obj", "-o", "x.ply"}, {"--spacing", "--count"});
    fails(2, {"sample", "cube.obj", "-o", "x.ply", "--spacing", "0"}, {"--spacing"});
    fails(2, {"sample", "cube.obj", "-o", "x.ply", "--spacing", "nan"}, {"--spacing"});
    fails(7, {"sample", "cube.obj", "-o", "x.ply", "--spacing", "1e-9"}, {"spacing"});
    fails(5, {"sample", "cube.obj", "-o", "x.ply", "--spacing", "0.1", "--picture", "x.jpg"}, {"x.jpg"});
    ok({"sample", "cube.obj", "-o", "points.ply", "--spacing", "0.2", "--quiet"});
    fails(7, {"sample", "points.ply", "-o", "x.ply", "--spacing", "0.2", "--quiet"}, {"no faces"});
    for (const std::string& name : files()) EXPECT_FALSE(name.starts_with("x.")) << name;
}

TEST_F(Sample, FrustumOfTheReport) {
    make_cube();
    const Json view = json({"sample", "cube.obj", "-o", "points.ply", "--frustum", "12", "12", "12"});
    EXPECT_EQ(view.at("method"), "rays");
    EXPECT_EQ(view.at("tested"), 1728);
    EXPECT_GT(view.at("points").get<int>(), 100);
    EXPECT_LT(view.at("points").get<int>(), 1000);
}

} // namespace
