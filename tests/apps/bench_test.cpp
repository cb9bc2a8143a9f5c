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
    for (const char* name : {"forces.plain", "forces.of_plain", "forces.of_150", "sweep.of_150", "cube.frame",
                             "cube.substeps", "fem.substep", "springs.substep", "meshfree.substep",
                             "growth.150.substep", "growth.150.a_particle", "fall.frame", "fall.elastic",
                             "fall.coupling", "fall.restore", "fall.rate", "fall.direct", "fall.direct_of_restored"})
        EXPECT_GT(figures["simulate." + std::string(name)], 0) << name;
    EXPECT_LT(figures.at("simulate.cube.error"), 5e-4);
    EXPECT_LT(figures.at("simulate.fall.rms"), 2e-3);
    EXPECT_NEAR(figures.at("simulate.fall.particles"), 150, 50);
    EXPECT_NEAR(figures.at("simulate.fall.rate"), 1000 / figures.at("simulate.fall.frame"), 1);
}

TEST_F(Bench, RefusesWhatItCannotMeasure) {
    fails(2, {"bench", "simulate", "--particles", "1"}, {"--particles"});
    fails(2, {"bench", "swim"}, {"simulate"});
}

} // namespace
