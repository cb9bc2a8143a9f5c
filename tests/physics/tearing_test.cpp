// Bodies that yield, and then break.
#include "filigree/core/random.h"
#include "filigree/physics/simulation.h"
#include "test_bodies.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace filigree {
namespace {

Material soft_clay() {
    Material material = undamped(0.3);
    material.damping = 5;
    material.yield_stress = 1e4;
    material.creep_time = 0.02;
    return material;
}

std::shared_ptr<Fracture> tearing(std::shared_ptr<const Body> whole, std::vector<Vec3d> seeds, double opening) {
    const auto count = Index(seeds.size());
    Partition partition{count, [seeds = std::move(seeds)](const Vec3d& point) {
                            Index nearest = 0;
                            for (Index s = 1; s < seeds.size(); ++s)
                                if ((seeds[s] - point).squaredNorm() < (seeds[nearest] - point).squaredNorm())
                                    nearest = s;
                            return nearest;
                        }};
    auto fracture = std::make_shared<Fracture>();
    fracture->body =
        break_body(std::move(whole), std::move(partition), kTwoThreads).value();
    fracture->material.strength = 1e5; // not reached
    fracture->material.energy = 5;
    fracture->material.plastic_opening = opening;
    return fracture;
}

std::vector<Vec3d> seeds_in(double reach) {
    std::vector<Vec3d> seeds;
    for (std::uint64_t s = 0; s < 8; ++s)
        seeds.push_back(reach * Vec3d(2 * random_unit(3, 3 * s) - 1, 2 * random_unit(3, 3 * s + 1) - 1,
                                      2 * random_unit(3, 3 * s + 2) - 1));
    return seeds;
}

/// Mean distance of two layers of a bar's corners.
double layer_distance(const Body& body, const Vectors& x, double from, double to) {
    double sum[2] = {0, 0}, count[2] = {0, 0};
    for (std::size_t i = 0; i < x.size(); ++i)
        for (int side = 0; side < 2; ++side)
            if (std::abs(double(body.rest[i].x()) - (side ? to : from)) < 1e-4) {
                sum[side] += double(x[i].x());
                ++count[side];
            }
    return sum[1] / count[1] - sum[0] / count[0];
}

TEST(Tearing, ABarStretchesAndTearsAtItsPlasticOpening) {
    for (const double opening : {0.02, 0.05}) {
        for (const double spacing : {0.1, 0.05}) {
            const auto n = std::size_t(std::lround(1.2 / spacing)), across = n / 4;
            Material material = soft_clay();
            material.creep_time = 0.005;
            const auto bar = block(n, across, across, spacing, material);
            const auto fracture = tearing(bar, {{-0.2 + spacing / 2, 0, 0}, {0.2 + spacing / 2, 0, 0}}, opening);
            World world;
            world.gravity = Vec3d::Zero();
            for (const double side : {-1.0, 1.0}) {
                Pin pin;
                for (std::size_t i = 0; i < bar->rest.size(); ++i)
                    if (std::abs(double(bar->rest[i].x()) - side * 0.6) < 1e-4) pin.particles.push_back(Index(i));
                pin.motion.move.times = {0, 100};
                pin.motion.move.values = {Vec3d::Zero(), {side * 10, 0, 0}};
                world.pins.push_back(pin);
            }
            Simulation simulation =
                Simulation::create(world, {{.body = bar, .fracture = fracture}},
                                   {.frames_per_second = 200, .contacts_within_bodies = false}, kTwoThreads)
                    .value();
            double opened = 0, time = 0, pulled = 0;
            while (simulation.fracture(0).broken_area == 0 && time < 8) {
                opened = layer_distance(*bar, simulation.positions(0), 0, spacing) - spacing; // the crack's layer
                pulled = 2 * std::sqrt(1e6 * simulation.energy(kTwoThreads).elastic / (1.2 * 0.09) / 2);
                ASSERT_TRUE(simulation.advance(kTwoThreads).ok());
                time = simulation.time();
            }
            EXPECT_NEAR(opened, opening + 0.01 * spacing, 0.05 * opening); // and what is elastic
            EXPECT_NEAR(pulled, 1e4, 2e3);
            while (simulation.fracture(0).parts == 1 && time < 10) {
                ASSERT_TRUE(simulation.advance(kTwoThreads).ok());
                time = simulation.time();
            }
            EXPECT_EQ(simulation.fracture(0).parts, 2u);
        }
    }
}

TEST(Tearing, MomentumIsKept) {
    Material material = soft_clay();
    material.damping = 0;
    const auto body = block(10, 3, 3, 0.1, material);
    Vectors velocities(body->rest.size());
    for (std::size_t i = 0; i < body->rest.size(); ++i) {
        const Vec3f& p = body->rest[i];
        velocities.set(i, {12 * p.x() + 1, -0.6f * p.x() + 0.3f, 0.4f * p.y()});
    }
    World world;
    world.gravity = Vec3d::Zero();
    Simulation simulation =
        Simulation::create(world, {{.body = body, .fracture = tearing(body, {{-0.1, 0, 0}, {0.12, 0.03, 0}}, 0.02)}},
                           {.frames_per_second = 100,
                            .mode = StepMode::explicit_steps,
                            .contacts_between_bodies = false,
                            .contacts_within_bodies = false},
                           kTwoThreads)
            .value();
    ASSERT_TRUE(simulation.set_velocities(0, velocities).ok());
    const Momentum before = simulation.momentum();
    const double start = simulation.energy(kTwoThreads).total();
    for (int frame = 0; frame < 40; ++frame) ASSERT_TRUE(simulation.advance(kTwoThreads).ok());
    EXPECT_EQ(simulation.fracture(0).parts, 2u);
    const Momentum after = simulation.momentum();
    const double size = before.linear.norm();
    EXPECT_LT((after.linear - before.linear).norm(), 1e-6 * size);
    EXPECT_LT((after.angular - before.angular).norm(), 1e-5 * size * 0.5);
    EXPECT_LT(simulation.energy(kTwoThreads).total(), start);
}

World tearing_ground() {
    World world;
    Obstacle ground;
    ground.shape = HalfSpace{{0, -0.6, 0}, {0, 1, 0}};
    world.obstacles.push_back(ground);
    return world;
}

Simulation thrown_clay(double opening, bool breaks = true) {
    const auto body = block(6, 6, 6, 0.05, soft_clay());
    Actor actor{.body = body, .velocity = {0, -9, 0}, .spin = {1, 0, 2}};
    if (breaks) actor.fracture = tearing(body, seeds_in(0.15), opening);
    actor.placement.rotate(Eigen::AngleAxisd(0.5, Vec3d(1, 0, 1).normalized()));
    return Simulation::create(tearing_ground(), {actor}, {.frames_per_second = 60, .mode = StepMode::explicit_steps},
                              kTwoThreads)
        .value();
}

TEST(Tearing, WhatIsNeverReachedChangesNothing) {
    Simulation with = thrown_clay(1), without = thrown_clay(1, false);
    for (int frame = 0; frame < 20; ++frame) {
        ASSERT_TRUE(with.advance(kTwoThreads).ok());
        ASSERT_TRUE(without.advance(kTwoThreads).ok());
    }
    EXPECT_EQ(with.positions(0).x, without.positions(0).x);
    EXPECT_EQ(with.positions(0).y, without.positions(0).y);
    EXPECT_EQ(with.positions(0).z, without.positions(0).z);
}

TEST(Tearing, SavedInTheMiddleAndOnOtherThreads) {
    Simulation first = thrown_clay(0.004);
    std::string middle;
    for (int frame = 0; frame < 24; ++frame) {
        ASSERT_TRUE(first.advance(kTwoThreads).ok());
        if (first.fracture(0).broken_area > 0 && middle.empty()) middle = first.save();
    }
    ASSERT_FALSE(middle.empty());
    Simulation second = thrown_clay(0.004), third = thrown_clay(0.004);
    ASSERT_TRUE(second.restore(middle).ok());
    EXPECT_EQ(second.save(), middle);
    while (second.frame() < first.frame()) ASSERT_TRUE(second.advance(RunContext(1)).ok());
    EXPECT_EQ(second.save(), first.save());
    while (third.frame() < first.frame()) ASSERT_TRUE(third.advance(RunContext(1)).ok());
    EXPECT_EQ(third.save(), first.save());
}

} // namespace
} // namespace filigree
