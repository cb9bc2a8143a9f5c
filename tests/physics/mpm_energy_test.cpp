// Energy of matter of mpm that hits something never grows, and what is not finite is mended.
#include "filigree/physics/body/make_cells.h"
#include "filigree/physics/material.h"
#include "filigree/physics/simulation.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <limits>

namespace filigree::mpm_energy_test {
namespace {

std::vector<NamedMaterial> presets() {
    std::vector<NamedMaterial> found;
    for (const NamedMaterial& named : named_materials())
        if (named.material.model == MaterialModel::mpm) found.push_back(named);
    return found;
}

std::shared_ptr<const Body> cube(const Material& material, std::size_t side) {
    const double spacing = 0.2 / double(side);
    return std::make_shared<const Body>(bare_body(box_cells(side, side, side, spacing), material));
}

} // namespace

class MpmDrops : public testing::TestWithParam<std::size_t> {};

TEST_P(MpmDrops, EnergyDoesNotGrowInAHit) {
    Material material = presets()[GetParam()].material;
    material.damping = 0;
    for (const bool hot : {false, true})
        for (const double speed : {1.0, 10.0, 60.0})
            for (const bool plate : {false, true}) {
                if (hot) material.temperature = material.melting_to + 10;
                World world;
                Obstacle& ground = world.obstacles.emplace_back();
                if (plate)
                    ground.shape = Cuboid{{0, -0.0005, 0}, {20, 0.001, 20}};
                else
                    ground.shape = HalfSpace{};
                Actor actor{cube(material, 8)};
                actor.placement.translation() = Vec3d(0, 0.05, 0);
                actor.placement.linear() = Eigen::AngleAxisd(0.4, Vec3d(1, 2, 3).normalized()).toRotationMatrix();
                actor.placement.translation() = Vec3d(0, 0.15, 0);
                actor.velocity = {0, -speed, 0};
                Simulation simulation = Simulation::create(world, {actor}, {}, kAllThreads).value();
                const double start = simulation.energy(kAllThreads).total();
                for (int f = 0; f < 15; ++f) {
                    simulation.advance(kAllThreads).value();
                    EXPECT_LT(simulation.energy(kAllThreads).total(), 1.01 * start) << hot << speed << plate << f;
                }
            }
}

INSTANTIATE_TEST_SUITE_P(Presets, MpmDrops, testing::Range(std::size_t{0}, presets().size()),
                         [](const auto& preset) { return std::string(presets()[preset.param].name); });

/// Two bodies of mpm that meet at any speed do not go through each other.
TEST(MpmMeets, BodiesDoNotPassEachOther) {
    Material material = presets()[0].material;
    material.temperature = 290;
    for (const double speed : {2.0, 20.0, 100.0}) {
        World world;
        world.gravity.setZero();
        const auto body = cube(material, 8);
        Actor left{body}, right{body};
        right.placement.translation() = Vec3d(0.25, 0, 0);
        left.velocity = {speed, 0, 0};
        right.velocity = {-speed, 0, 0};
        Simulation simulation = Simulation::create(world, {left, right}, {}, kAllThreads).value();
        const double start = simulation.energy(kAllThreads).total();
        for (int f = 0; f < 15; ++f) simulation.advance(kAllThreads).value();
        const auto mean = [&](std::size_t which) {
            double sum = 0;
            const Vectors& positions = simulation.positions(which);
            for (std::size_t i = 0; i < positions.size(); ++i) sum += double(positions[i].x());
            return sum / double(positions.size());
        };
        EXPECT_GT(mean(1) - mean(0), 0.05) << speed;
        EXPECT_LT(simulation.energy(kAllThreads).total(), 1.01 * start) << speed;
    }
}

/// Values that are not finite: the particle returns to where it was at rest beside the others, and the rest goes on.
TEST(MpmMeets, WhatIsNotFiniteReturnsToItsPlace) {
    World world;
    world.gravity.setZero();
    Actor actor{cube(presets()[0].material, 6)};
    actor.placement.translation() = Vec3d(5, 7, 0);
    Simulation simulation = Simulation::create(world, {actor}, {}, kAllThreads).value();
    const Vectors start = simulation.positions(0);
    for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        Vectors positions = start;
        positions.set(3, Vec3f(bad, 0, bad));
        ASSERT_TRUE(simulation.set_positions(0, positions).ok());
        EXPECT_GE(simulation.advance(kAllThreads).value().clamped_particles, 1u);
        for (std::size_t i = 0; i < start.size(); ++i)
            EXPECT_LT((simulation.positions(0)[i] - start[i]).norm(), 0.02f) << i;
    }
}

} // namespace filigree::mpm_energy_test
