// filigree remesh: the quads, the report about them, and the chain through strip and restore.
#include "apps/program.h"

#include <algorithm>
#include <cmath>
#include <set>

using namespace filigree_test;

namespace {

/// A box of twelve triangles as OBJ; `first` is the number of its first vertex.
std::string box_of_triangles(double side, double x, int first) {
    std::ostringstream obj;
    for (int k = 0; k < 8; ++k)
        obj << "v " << x + side * (k & 1) << ' ' << side * (k >> 1 & 1) << ' ' << side * (k >> 2) << '\n';
    for (const auto& [a, b, c, d] : {std::array{0, 2, 3, 1},
                                     {4, 5, 7, 6},
                                     {0, 1, 5, 4},
                                     {2, 6, 7, 3},
                                     {0, 4, 6, 2},
                                     {1, 3, 7, 5}}) // counter-clockwise from outside
        for (const auto& [i, j, k] : {std::array{a, b, c}, {a, c, d}})
            obj << "f " << first + i << ' ' << first + j << ' ' << first + k << '\n';
    return obj.str();
}

std::vector<std::vector<double>> points_of(const std::string& obj) {
    std::vector<std::vector<double>> points;
    std::istringstream lines(obj);
    for (std::string line; std::getline(lines, line);)
        if (line.starts_with("v ")) {
            std::istringstream words(line.substr(2));
            auto& p = points.emplace_back(3);
            words >> p[0] >> p[1] >> p[2];
        }
    return points;
}

class Remesh : public Program {
protected:
    /// Closed, in triangles of any valence: what a simplification leaves of a wavy sphere.
    void make_scan() {
        ok({"make", "wavy-sphere", "-o", "sphere.ply", "--resolution", "32", "--frequency", "2", "--quiet"});
        ok({"strip", "sphere.ply", "-o", "sphere.fil", "--base", "2000", "--quiet"});
        ok({"level", "sphere.fil", "0", "-o", "scan.ply", "--quiet"});
    }
    Json remesh(const std::string& input, std::vector<std::string> options, const std::string& output = "quads.ply") {
        options.insert(options.begin(), {"remesh", input, "-o", output});
        return json(options);
    }
};

} // namespace

TEST_F(Remesh, ReportIsWhatTheOthersMeasure) {
    make_scan();
    const Json report = remesh("scan.ply", {"--quads", "3000", "--levels", "3"});
    const Json info = json({"info", "quads.ply"});
    EXPECT_EQ(report.at("quads"), info.at("faces"));
    EXPECT_EQ(info.at("quads"), info.at("faces"));
    EXPECT_EQ(report.at("vertices"), info.at("vertices"));
    EXPECT_EQ(report.at("patches").get<int>() * 64, report.at("quads").get<int>());
    EXPECT_EQ(report.at("levels"), 3);
    EXPECT_NEAR(report.at("quads").get<double>(), 3000, 300);
    EXPECT_EQ(info.at("closed"), true);
    EXPECT_EQ(info.at("oriented"), true);
    EXPECT_EQ(info.at("euler"), 2);
    EXPECT_EQ(report.at("topology").at("output").at("euler"), 2);
    EXPECT_EQ(report.at("topology").at("output").at("handles"), 0);
    EXPECT_EQ(report.at("topology").at("input").at("components"), 1);

    const Json quality = info.at("quad_quality");
    EXPECT_EQ(report.at("irregular_vertices"), quality.at("irregular_vertices"));
    EXPECT_NEAR(report.at("irregular_per_patch").get<double>() * report.at("patches").get<double>(),
                report.at("irregular_vertices").get<double>(), 1e-6);
    EXPECT_EQ(report.at("inverted"), 0);
    for (const char* key : {"min", "percentile_1", "mean"})
        EXPECT_NEAR(report.at("scaled_jacobian").at(key), quality.at("scaled_jacobian").at(key), 1e-3) << key;
    EXPECT_GT(quality.at("scaled_jacobian").at("min"), 0);

    const Json compared = json({"compare", "quads.ply", "scan.ply"});
    const double diagonal = report.at("diagonal_units");
    EXPECT_NEAR(diagonal, compared.at("diagonal_units").get<double>(), 1e-5 * diagonal);
    for (const auto& [way, of_compare] : {std::pair("to_input", "a_to_b"), std::pair("from_input", "b_to_a")}) {
        const Json said = report.at(way);
        const double rms = compared.at(std::string("rms_") + of_compare);
        EXPECT_NEAR(said.at("rms").get<double>(), rms, 0.3 * rms) << way; // other samples
        EXPECT_LE(said.at("max"),
                  report.at(way == std::string("to_input") ? "max_distance" : "max_distance_from_input"))
            << way;
        EXPECT_NEAR(said.at("max_units").get<double>(), said.at("max").get<double>() * diagonal, 1e-9 * diagonal);
        EXPECT_NEAR(said.at("rms_units").get<double>(), said.at("rms").get<double>() * diagonal, 1e-9 * diagonal);
    }
    EXPECT_EQ(report.at("wrapped"), false);
    EXPECT_GE(report.at("tries"), 1);
    EXPECT_EQ(report.at("clean").at("cut_edges"), 0);
    EXPECT_GT(report.at("seconds").at("remesh"), 0);
    EXPECT_FALSE(report.at("seconds").at("phases").empty());
    EXPECT_TRUE(report.at("retried").is_string());
    EXPECT_TRUE(report.at("warnings").is_array());
}

TEST_F(Remesh, TextNamesWhatWasMeasured) {
    make_scan();
    const std::string text = ok({"remesh", "scan.ply", "-o", "quads.ply", "--quads", "2000"}).out;
    for (const char* title : {"quads", "patches", "irregular vertices", "scaled Jacobian", "quads to input",
                              "input to quads", "input, cleaned", "output", "seconds"})
        EXPECT_NE(text.find(title), std::string::npos) << title << "\n" << text;
    EXPECT_EQ(text.find("\ncleaned"), std::string::npos) << text; // nothing was changed
    EXPECT_EQ(ok({"remesh", "scan.ply", "-o", "quads.ply", "--quads", "2000", "--quiet"}).out, "");
}

TEST_F(Remesh, ReferenceCodeTakesTheQuadsBackToTheirBase) {
    make_scan();
    const Json report = remesh("scan.ply", {"--quads", "3000", "--levels", "3", "--base", "base.obj"}, "quads.obj");
    const Json stripped = json({"strip", "quads.obj", "-o", "quads.fil", "--code", "reference", "--levels", "3"});
    EXPECT_EQ(stripped.at("levels").size(), 3u);
    EXPECT_EQ(stripped.at("driver_faces"), report.at("patches"));
    ok({"level", "quads.fil", "3", "-o", "finest.obj", "--quiet"});
    EXPECT_TRUE(bytes_of(path("finest.obj")) == bytes_of(path("quads.obj")));

    // the driver is the base: the same points, in whatever order
    ok({"level", "quads.fil", "0", "-o", "driver.obj", "--quiet"});
    const auto base = points_of(bytes_of(path("base.obj"))), driver = points_of(bytes_of(path("driver.obj")));
    EXPECT_EQ(json({"info", "base.obj"}).at("quads"), report.at("patches"));
    EXPECT_EQ(std::set(base.begin(), base.end()), std::set(driver.begin(), driver.end()));
    EXPECT_EQ(base.size(), driver.size());

    ok({"restore", "quads.fil", "--pose", "driver.obj", "-o", "restored.obj", "--quiet"});
    EXPECT_LE(json({"compare", "restored.obj", "quads.obj"}).at("max"), 2e-7);
}

TEST_F(Remesh, SameBytesForAnyNumberOfThreads) {
    make_scan();
    ok({"remesh", "scan.ply", "-o", "one.ply", "--quads", "3000", "--threads", "1", "--quiet"});
    ok({"remesh", "scan.ply", "-o", "three.ply", "--quads", "3000", "--threads", "3", "--quiet"});
    EXPECT_TRUE(bytes_of(path("one.ply")) == bytes_of(path("three.ply")));
}

TEST_F(Remesh, SharpEdgesStayWhereTheyAreWanted) {
    write("box.obj", box_of_triangles(1, 0, 1));
    const Json sharp = remesh("box.obj", {"--quads", "1000"});
    EXPECT_EQ(sharp.at("feature_edges"), 12);
    EXPECT_LT(sharp.at("from_input").at("max"), 1e-3);
    EXPECT_EQ(remesh("box.obj", {"--quads", "1000", "--feature-angle", "120"}).at("feature_edges"), 0);
}

TEST_F(Remesh, SmallPartsGoOrStay) {
    write("two.obj", box_of_triangles(1, 0, 1) + box_of_triangles(0.005, 2, 9));
    const Json removed = remesh("two.obj", {"--quads", "1000"});
    EXPECT_EQ(removed.at("clean").at("removed_components"), 1);
    EXPECT_GT(removed.at("clean").at("removed_area"), 0);
    EXPECT_EQ(removed.at("topology").at("output").at("components"), 1);
    EXPECT_NE(ok({"remesh", "two.obj", "-o", "quads.ply", "--quads", "1000"}).out.find("1 small components removed"),
              std::string::npos);
    const Json kept = remesh("two.obj", {"--quads", "1000", "--small-parts", "keep"});
    EXPECT_EQ(kept.at("clean").at("removed_components"), 0);
    EXPECT_EQ(kept.at("topology").at("output").at("components"), 2);
}

TEST_F(Remesh, OpenMeshesStayOpenAndCarryTheirAttributes) {
    ok({"make", "wavy-plane", "-o", "plane.obj", "--resolution", "24", "--frequency", "1", "--quiet"});
    const Json report = remesh("plane.obj", {"--quads", "1500", "--wrap", "never"}, "quads.obj");
    EXPECT_EQ(report.at("topology").at("output").at("border_loops"), 1);
    const Json with = json({"info", "quads.obj"});
    EXPECT_EQ(with.at("closed"), false);
    EXPECT_NE(with.at("attributes").dump().find("uvs"), std::string::npos);
    remesh("plane.obj", {"--quads", "1500", "--no-attributes"}, "plain.obj");
    EXPECT_TRUE(json({"info", "plain.obj"}).at("attributes").empty());
}

TEST_F(Remesh, WrapClosesWhatIsOpen) {
    ok({"make", "wavy-plane", "-o", "plane.obj", "--resolution", "16", "--quiet"});
    const Json report = remesh("plane.obj", {"--quads", "4000", "--wrap", "always", "--max-distance", "0.2"});
    EXPECT_EQ(report.at("wrapped"), true);
    EXPECT_EQ(report.at("max_distance"), 0.2);
    EXPECT_EQ(json({"info", "quads.ply"}).at("closed"), true);
}

TEST_F(Remesh, PictureIsDrawn) {
    ok({"make", "wavy-cube", "-o", "cube.stl", "--resolution", "8", "--quiet"}); // says nothing; STL has z up
    const Ran ran = run({"remesh", "cube.stl", "-o", "quads.ply", "--quads", "600", "--picture", "quads.png", "--view",
                         "front", "--json"});
    if (ran.code == 5) GTEST_SKIP() << "no OpenGL";
    ASSERT_EQ(ran.code, 0) << ran.err;
    EXPECT_EQ(Json::parse(ran.out).at("up"), "z");
    EXPECT_TRUE(bytes_of(path("quads.png")).starts_with("\x89PNG"));
}

TEST_F(Remesh, TriangleFormatsAreWarnedOf) {
    write("box.obj", box_of_triangles(1, 0, 1));
    const Json report = remesh("box.obj", {"--quads", "600"}, "quads.stl");
    EXPECT_NE(report.at("warnings").dump().find("triangles"), std::string::npos);
    EXPECT_EQ(json({"info", "quads.stl"}).at("triangles").get<int>(), 2 * report.at("quads").get<int>());
}

TEST_F(Remesh, StandardOutputTakesTheQuads) {
    write("box.obj", box_of_triangles(1, 0, 1));
    const Ran ran = run({"remesh", "-", "-o", "-", "--quads", "600"}, path("box.obj"));
    EXPECT_EQ(ran.code, 0) << ran.err;
    EXPECT_TRUE(ran.out.starts_with("ply\n"));
    EXPECT_NE(ran.err.find("patches"), std::string::npos);
}

TEST_F(Remesh, BadArgumentsAreRefusedAndNothingIsWritten) {
    write("box.obj", box_of_triangles(1, 0, 1));
    write("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
    write("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n");
    const auto with = [](const std::vector<std::string>& options) {
        std::vector<std::string> arguments = {"remesh", "box.obj", "-o", "x.ply"};
        arguments.insert(arguments.end(), options.begin(), options.end());
        return arguments;
    };
    fails(2, with({"--levels", "0"}), {"--levels"});
    fails(2, with({"--levels", "9"}), {"--levels"});
    fails(2, with({"--quads", "0"}), {"--quads"});
    fails(2, with({"--quads", "-5"}), {"--quads"});
    fails(2, with({"--feature-angle", "181"}), {"--feature-angle"});
    fails(2, with({"--small-parts", "some"}), {"keep", "remove"});
    fails(2, with({"--wrap", "often"}), {"auto", "always", "never"});
    fails(2, with({"--max-distance", "0"}), {"--max-distance"});
    fails(2, with({"--base", "x.ply"}), {"--base"});
    fails(5, with({"--base", "x.xyz"}), {"x.xyz"});
    fails(5, with({"--picture", "x.jpg"}), {"x.jpg"});
    fails(6, with({"--picture", "nowhere/x.png"}), {"nowhere"});
    fails(3, {"remesh", "missing.obj", "-o", "x.ply"}, {"missing.obj"});
    fails(5, {"remesh", "box.obj", "-o", "x.xyz"}, {"x.xyz"});
    fails(7, {"remesh", "points.obj", "-o", "x.ply", "--quiet"}, {});
    fails(7, {"remesh", "flat.obj", "-o", "x.ply", "--quiet"}, {});
    for (const std::string& name : files()) EXPECT_FALSE(name.starts_with("x.")) << name;
}

TEST_F(Remesh, LimitThatCannotBeKeptIsARefusalWithItsReason) {
    make_scan();
    const std::vector<std::string> command = {"remesh", "scan.ply",       "-o",   "x.ply",  "--quads", "500", "--wrap",
                                              "never",  "--max-distance", "1e-9", "--quiet"};
    fails(7, command, {"of the diagonal from the mesh", "1e-09"});
    EXPECT_FALSE(std::filesystem::exists(path("x.ply")));
}

TEST_F(Remesh, CancelLeavesNothing) {
    ok({"make", "wavy-cube", "-o", "cube.ply", "--resolution", "300", "--quiet"});
    const Ran ran = run({"remesh", "cube.ply", "-o", "x.ply", "--quads", "400000"}, "/dev/null", 0.4);
    if (ran.code == 0) GTEST_SKIP() << "too quick to cancel";
    EXPECT_EQ(ran.code, 130);
    EXPECT_FALSE(std::filesystem::exists(path("x.ply")));
}
