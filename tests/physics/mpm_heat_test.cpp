// Heat that is given to bodies of mpm is heat that they gain, however slowly it comes.
#include "filigree/physics/body/make_cells.h"
#include "filigree/physics/simulation.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <cmath>

namespace filigree::mpm_heat_test {
namespace {

constexpr double kSpacing = 0.2 / 7, kSide = 7 * kSpacing, kMass = 900 * kSide * kSide * kSide;

Material wax(double latent_heat = 0) {
    Material material;
    material.model = MaterialModel::mpm;
    material.density = 900;
    material.young_modulus = 1e6;
    material.poisson_ratio = 0.3;
    material.melting_from = 330;
    material.melting_to = 335;
    material.temperature = 290;
    material.specific_heat = 2000;
    material.latent_heat = latent_heat;
    material.conductivity = 1e-7;
    return material;
}

/// A cube of 343 particles, 0.2 m wide.
Simulation cube(World world, const Material& material = wax()) {
    world.gravity.setZero();
    const auto body = std::make_shared<const Body>(make_body(box_cells(7, 7, 7, kSpacing), material));
    return Simulation::create(std::move(world), {{body}}, {}, kAllThreads).value();
}

double gained_in(Simulation& simulation, int frames) {
    const double before = simulation.heat();
    for (int f = 0; f < frames; ++f) simulation.advance(kAllThreads).value();
    return simulation.heat() - before;
}

HeatSource source(double watts, double radius = 1) {
    HeatSource source;
    source.ball = {Vec3d::Constant(kSide / 2), radius};
    source.power.constant = watts;
    return source;
}

} // namespace

class PowerOfASource : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(MpmHeat, PowerOfASource, testing::Values(1.0, 10.0, 200.0, 300.0, 1e3, 1e4, 1e5, -50.0));

TEST_P(PowerOfASource, IsGained) {
    World world;
    world.heat_sources = {source(GetParam())};
    Simulation simulation = cube(world);
    EXPECT_NEAR(gained_in(simulation, 60) / GetParam(), 1, 0.01);
}

TEST_P(PowerOfASource, IsGainedWhileItMelts) {
    World world;
    world.heat_sources = {source(GetParam())};
    Material melting = wax(1e5);
    melting.temperature = 332;
    Simulation simulation = cube(world, melting);
    EXPECT_NEAR(gained_in(simulation, 60) / GetParam(), 1, 0.01);
}

TEST_P(PowerOfASource, IsGainedWhenItIsSetWhileTheSceneRuns) {
    Material plain = wax();
    plain.melting_from = plain.melting_to = Material{}.melting_from; // it neither melts nor conducts
    plain.conductivity = 0;
    Simulation simulation = cube({}, plain);
    gained_in(simulation, 2);
    ASSERT_TRUE(simulation.set_heat_sources({source(GetParam())}).ok());
    EXPECT_NEAR(gained_in(simulation, 60) / GetParam(), 1, 0.01);
}

TEST(MpmHeat, ASourceBetweenParticlesWarmsThoseAroundIt) {
    World world;
    world.heat_sources = {source(10, 1e-4)};
    world.heat_sources[0].ball.centre += Vec3d::Constant(kSpacing / 2);
    Simulation simulation = cube(world);
    EXPECT_NEAR(gained_in(simulation, 60) / 10, 1, 0.01);
    world.heat_sources[0].ball.centre = {1, 1, 1}; // away from all matter
    Simulation cold = cube(world);
    EXPECT_NEAR(gained_in(cold, 60), 0, 0.01);
}

TEST(MpmHeat, PowerThatRisesIsGainedWhole) {
    World world;
    world.heat_sources = {source(0)};
    world.heat_sources[0].power = {{0, 1}, {0, 40}, 0};
    Simulation simulation = cube(world);
    EXPECT_NEAR(gained_in(simulation, 60), 20, 0.2);
}

/// All that goes over a surface is as much as its transfer, whether that is still air's (10) or a storm's.
TEST(MpmHeat, AirWarmsByItsTransfer) {
    for (const double transfer : {0.1, 1.0, 10.0, 100.0}) {
        World world;
        world.air_heat_transfer = transfer;
        world.air_temperature.constant = 300;
        Simulation simulation = cube(world);
        const double area = gained_in(simulation, 60) / (transfer * 10);
        EXPECT_NEAR(area, 6 * kSide * kSide, 0.01 * 6 * kSide * kSide) << transfer;
    }
}

TEST(MpmHeat, ObstaclesWarmByTheirTransfer) {
    for (const double transfer : {0.1, 1.0, 10.0, 100.0, 500.0}) {
        World world;
        Obstacle plate;
        plate.shape = HalfSpace{};
        plate.temperature.constant = 300;
        plate.heat_transfer = transfer;
        world.obstacles = {plate};
        Simulation simulation = cube(world);
        const double area = gained_in(simulation, 60) / (transfer * 10);
        EXPECT_NEAR(area, kSide * kSide, 0.01 * kSide * kSide) << transfer;
    }
}

TEST(MpmHeat, MatterThatWarmsItselfGainsByItsPace) {
    const auto gained = [](double pace) {
        Material warming = wax();
        warming.heating = 1e-3; // K/s, of the surface
        World world;
        world.heat_pace = pace;
        Simulation simulation = cube(world, warming);
        return gained_in(simulation, 60) / (pace * 1e-3 * 2000 * kMass);
    };
    const double usual = gained(1);
    EXPECT_GT(usual, 0.2);
    EXPECT_LT(usual, 0.8);
    for (const double pace : {0.01, 100.0}) EXPECT_NEAR(gained(pace), usual, 0.01 * usual) << pace;
}

} // namespace filigree::mpm_heat_test
