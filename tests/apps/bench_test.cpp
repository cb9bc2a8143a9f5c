// filigree bench, on cases so small that only its sense can be tested.
#include "apps/program.h"

#include <cmath>
#include <map>

using namespace filigree_test;

namespace {

class Bench : public Program {};

TEST_F(Bench, SimulateMeasuresBodies) {
    ok({"make", "wavy-cube", "-o", "cube.ply", "--resolution", "8", "--quiet"});
    const Json said =
        json({"bench", "simulate", "--mesh", "cube.ply", "--base", "60", "--particles", "150", "--threads", "1"});
    EXPECT_EQ(said.at("threads"), 1);
    std::map<std::string, double> figures;
    for (const Json& figure : said.at("results")) {
        const std::string name = figure.at("name");
        EXPECT_TRUE(figures.emplace(name, figure.at("value").get<double>()).second) << name;
        EXPECT_TRUE(std::isfinite(figures.at(name)) && figures.at(name) >= 0) << name;
        EXPECT_FALSE(figure.at("unit").get<std::string>().empty()) << name;
    }
    for (const char* name :
         {"forces.plain", "forces.of_plain", "forces.of_150", "cube.frame", "cube.substeps", "fem.substep",
          "springs.substep", "meshfree.substep", "growth.150.substep", "growth.150.a_particle", "fall.frame",
          "fall.elastic", "fall.coupling", "fall.restore", "fall.rate", "fall.direct", "fall.direct_of_restored"})
        EXPECT_GT(figures["simulate." + std::string(name)], 0) << name;
    EXPECT_LT(figures.at("simulate.cube.error"), 5e-4);
    EXPECT_LT(figures.at("simulate.fall.rms"), 2e-3);
    EXPECT_NEAR(figures.at("simulate.fall.particles"), 150, 50);
    EXPECT_NEAR(figures.at("simulate.fall.rate"), 1000 / figures.at("simulate.fall.frame"), 1);
}

TEST_F(Bench, EstimateJudgesRandomPoses) {
    ok({"make", "wavy-sphere", "-o", "sphere.ply", "--resolution", "24", "--quiet"});
    const Json said = json({"bench", "estimate", "--mesh", "sphere.ply", "--poses", "60"});
    EXPECT_EQ(said.at("meshes").size(), 1u);
    std::map<std::string, double> figures;
    for (const Json& figure : said.at("results")) figures[figure.at("name")] = figure.at("value");
    for (const char* source : {"estimate.positions", "estimate.gradients"}) {
        EXPECT_EQ(figures.at(std::string(source) + ".poses"), 60);
        EXPECT_GE(figures.at(std::string(source) + ".within_2"), 90);
    }
    double poses = 0;
    for (const Json& row : said.at("estimate_by_kind")) poses += row.at("poses").get<double>();
    EXPECT_EQ(poses, 120);
    EXPECT_EQ(said.at("estimate_worst").size(), 16u);
    const Json again = json({"bench", "estimate", "--mesh", "sphere.ply", "--poses", "60", "--threads", "2"});
    EXPECT_EQ(said.at("results"), again.at("results")); // seeded
}

TEST_F(Bench, DriversGoThroughAFolder) {
    std::filesystem::create_directories(path("meshes/more"));
    ok({"make", "wavy-sphere", "-o", "meshes/sphere.ply", "--resolution", "24", "--quiet"});
    ok({"make", "torus", "-o", "meshes/more/torus.obj", "--resolution", "20", "--quiet"});
    write("meshes/broken.obj", "v 1 2\n");
    write("meshes/notes.txt", "no mesh");
    const Json said = json({"bench", "drivers", "--mesh", "meshes"});
    EXPECT_EQ(said.at("meshes").size(), 2u);
    EXPECT_NE(said.at("warnings").dump().find("broken.obj"), std::string::npos);
    EXPECT_EQ(said.at("drivers").size(), 3u); // 250 and 1,000; 250
    for (const Json& row : said.at("drivers")) EXPECT_EQ(row.at("rises"), "");
    std::filesystem::create_directories(path("empty"));
    fails(2, {"bench", "drivers", "--mesh", "empty"}, {"no meshes"});
}

TEST_F(Bench, GoalsAreReached) {
    ok({"make", "torus", "-o", "torus.ply", "--resolution", "16", "--quiet"});
    const Json said = json({"bench", "goals", "--mesh", "torus.ply"});
    EXPECT_EQ(said.at("goals").size(), 4u);
    for (const Json& row : said.at("goals")) EXPECT_EQ(row.at("reached"), "yes") << row.dump();
}

TEST_F(Bench, RefusesWhatItCannotMeasure) {
    fails(2, {"bench", "simulate", "--particles", "1"}, {"--particles"});
    fails(2, {"bench", "swim"}, {"simulate"});
}

} // namespace
