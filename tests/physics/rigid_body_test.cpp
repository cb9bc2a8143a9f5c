#include "filigree/physics/rigid/rigid_body.h"
#include "physics/test_bodies.h"
#include "threads.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace filigree::rigid_body_test {
namespace {

Material stone(double damping = 0) {
    Material material;
    material.model = MaterialModel::rigid;
    material.density = 2600;
    material.damping = damping;
    return material;
}

Actor put(std::shared_ptr<const Body> body, const Vec3d& at) {
    Actor actor{.body = std::move(body)};
    actor.placement.translation() = at;
    return actor;
}

Simulation begin(World world, std::vector<Actor> actors) {
    return Simulation::create(std::move(world), std::move(actors), {}, kOneThread).value();
}

double most_stretch(const Simulation& simulation, std::size_t body) {
    const Vectors &rest = simulation.body(body).rest, &now = simulation.positions(body);
    double most = 0;
    for (std::size_t i = 1; i < rest.size(); ++i) {
        const double before = double((rest[i] - rest[0]).norm());
        most = std::max(most, std::abs(double((now[i] - now[0]).norm()) / before - 1));
    }
    return most;
}

// Euler: about the middle axis a body tumbles, and keeps its energy and angular momentum all the while.
TEST(RigidBody, TumblesAndKeepsEnergyAndMomentum) {
    World world;
    world.gravity.setZero();
    Actor actor = put(block(6, 4, 2, 0.05, stone()), Vec3d::Zero());
    actor.spin = Vec3d(0.01, 6, 0.01);
    Simulation tumbling = begin(world, {actor});
    const double energy = tumbling.energy(kOneThread).total();
    const Vec3d angular = tumbling.momentum().angular;
    double most_turned = 0;
    for (int frame = 0; frame < 600; ++frame) {
        ASSERT_TRUE(tumbling.advance(kOneThread).ok());
        const Vec3f axis = tumbling.positions(0)[tumbling.positions(0).size() - 1] - tumbling.positions(0)[0];
        most_turned = std::max(most_turned, -double(axis.normalized().y()));
    }
    EXPECT_NEAR(tumbling.energy(kOneThread).total() / energy, 1, 5e-3);
    EXPECT_LT((tumbling.momentum().angular - angular).norm() / angular.norm(), 1e-4);
    EXPECT_LT(most_stretch(tumbling, 0), 1e-5);
    EXPECT_GT(most_turned, 0.3) << "it turns over";
}

TEST(RigidBody, FallsFreely) {
    Simulation falling = begin({}, {put(block(2, 2, 2, 0.1, stone()), Vec3d(0, 1, 0))});
    for (int frame = 0; frame < 30; ++frame) ASSERT_TRUE(falling.advance(kOneThread).ok());
    EXPECT_NEAR(centre_of_mass(falling, 0).y(), 1 - 0.5 * 9.81 * 0.25, 2e-5);
}

TEST(RigidBody, SlidesByCoulombAndHoldsBelowItsAngle) {
    for (const double degrees : {20.0, 26.0, 30.0, 40.0}) {
        const double angle = degrees * std::numbers::pi / 180;
        const Vec3d normal(-std::sin(angle), std::cos(angle), 0), down(-std::cos(angle), -std::sin(angle), 0);
        World world;
        world.obstacles.emplace_back().shape = HalfSpace{Vec3d::Zero(), normal};
        Actor actor = put(block(4, 4, 4, 0.05, stone()), 0.1001 * normal);
        actor.placement.rotate(Eigen::AngleAxisd(angle, Vec3d::UnitZ()));
        actor.velocity = degrees > 20 ? Vec3d(2 * down) : Vec3d::Zero();
        Simulation sliding = begin(world, {actor});
        std::vector<double> way;
        for (int frame = 0; frame < 60; ++frame) {
            ASSERT_TRUE(sliding.advance(kOneThread).ok());
            way.push_back(centre_of_mass(sliding, 0).dot(down));
        }
        if (degrees < 26) {
            EXPECT_LT(std::abs(way[59] - way[29]), 5e-6);
            continue;
        }
        const double acceleration = ((way[35] - way[30]) - (way[9] - way[4])) * 12 / (26.0 / 60);
        EXPECT_NEAR((9.81 * std::sin(angle) - acceleration) / (9.81 * std::cos(angle)), 0.5, 0.01) << degrees;
    }
}

TEST(RigidBody, AStackOfFiveSleepsAndWakesWhenItIsHit) {
    World world;
    world.obstacles.emplace_back().shape = HalfSpace{};
    const auto cube = block(3, 3, 3, 0.1, stone(0.1));
    std::vector<Actor> actors;
    for (int i = 0; i < 5; ++i) actors.push_back(put(cube, Vec3d(0, 0.15 + 0.3 * i, 0)));
    actors.push_back(put(block(3, 3, 3, 0.1, stone()), Vec3d(-12, 1.4, 0))); // arrives after 2 s
    actors.back().velocity = Vec3d(6, 9.81, 0);
    Simulation stack = begin(world, actors);
    for (int frame = 0; frame < 90; ++frame) ASSERT_TRUE(stack.advance(kOneThread).ok());
    const Vec3d before = centre_of_mass(stack, 4);
    EXPECT_NEAR(before.y(), 1.35, 1e-3) << "five sink in by less than a millimetre in all";
    for (int frame = 0; frame < 15; ++frame) ASSERT_TRUE(stack.advance(kOneThread).ok());
    EXPECT_EQ((centre_of_mass(stack, 4) - before).norm(), 0) << "it sleeps";
    for (int frame = 0; frame < 60; ++frame) ASSERT_TRUE(stack.advance(kOneThread).ok());
    EXPECT_GT((centre_of_mass(stack, 4) - before).norm(), 0.05) << "it is hit";
}

TEST(RigidBody, SleepersThatAHandWakesFeelTheGroundAndGoOnTheSameAfterARestore) {
    World world;
    world.obstacles.emplace_back().shape = HalfSpace{};
    const auto cube = block(3, 3, 3, 0.1, stone(0.1));
    std::vector<Actor> actors = {put(cube, Vec3d(0, 0.15, 0)), put(cube, Vec3d(0, 0.45, 0)), put(cube, Vec3d(2, 15, 0)),
                                 put(cube, Vec3d(2.1, 30, 0))}; // two still fall
    Simulation stack = begin(world, actors);
    for (int frame = 0; frame < 100; ++frame) ASSERT_TRUE(stack.advance(kOneThread).ok());
    const Vec3d before = centre_of_mass(stack, 1);
    for (int frame = 0; frame < 5; ++frame) ASSERT_TRUE(stack.advance(kOneThread).ok());
    ASSERT_EQ((centre_of_mass(stack, 1) - before).norm(), 0) << "it sleeps";
    const auto push_both = [](Simulation& of) { // as lightly as nothing, but it wakes them
        for (const std::size_t body : {0u, 1u}) {
            Vectors push(of.body(body).particle_count());
            push.set(0, Vec3f(1e-3f, 0, 0));
            ASSERT_TRUE(of.set_forces(body, push).ok());
        }
    };
    push_both(stack);
    ASSERT_TRUE(stack.advance(kOneThread).ok()); // wakes them in its end
    Simulation other = begin(world, actors);
    push_both(other);
    ASSERT_TRUE(other.restore(stack.save()).ok());
    for (int frame = 0; frame < 30; ++frame) {
        const FrameReport report = stack.advance(kOneThread).value();
        ASSERT_TRUE(other.advance(kOneThread).ok());
        EXPECT_TRUE(stack.save() == other.save()) << frame;
        EXPECT_LT((centre_of_mass(stack, 1) - before).norm(), 1e-4) << frame;
        EXPECT_LT(report.deepest_in_matter, 1e-3) << frame;
    }
}

/// What nothing holds goes on, however slowly.
TEST(RigidBody, WhatFloatsDoesNotSleep) {
    World slight;
    slight.gravity = {0, -0.005, 0};
    Simulation falls = begin(slight, {put(block(2, 2, 2, 0.1, stone()), Vec3d(0, 0, 0))});
    World none;
    none.gravity.setZero();
    Actor drifting = put(block(2, 2, 2, 0.1, stone()), Vec3d(0, 0, 0));
    drifting.velocity = {0.004, 0, 0};
    Actor beside = put(block(2, 2, 2, 0.1, stone()), Vec3d(0.2, 0, 0)); // touching it, as slow
    beside.velocity = drifting.velocity;
    Simulation drifts = begin(none, {drifting, beside});
    const Vec3d momentum = drifts.momentum().linear;
    for (int frame = 0; frame < 180; ++frame) {
        ASSERT_TRUE(falls.advance(kOneThread).ok());
        ASSERT_TRUE(drifts.advance(kOneThread).ok());
    }
    EXPECT_NEAR(centre_of_mass(falls).y(), -0.5 * 0.005 * 9, 2e-4);
    EXPECT_LT((drifts.momentum().linear - momentum).norm(), 1e-5 * momentum.norm());
}

/// A stone that comes slowly to one that sleeps on ice pushes it on, as one that is awake.
TEST(RigidBody, ASleeperIsNoWallForWhatComesToIt) {
    for (const double speed : {0.008, 0.015, 0.03, 0.3}) {
        const auto momentum_after = [&](bool may_sleep) {
            World ice;
            ice.obstacles.emplace_back().shape = HalfSpace{};
            ice.obstacles.back().friction = 0;
            ice.body_friction = 0;
            const auto cube = block(3, 3, 3, 0.1, stone(0));
            Actor rests = put(cube, Vec3d(0, 0.15, 0)), comes = put(cube, Vec3d(0.32 + 1.5 * speed, 0.15, 0));
            rests.may_sleep = may_sleep;
            comes.may_sleep = false; // else a slow one stops by itself
            Simulation both = begin(ice, {rests, comes});
            for (int frame = 0; frame < 60; ++frame) EXPECT_TRUE(both.advance(kOneThread).ok());
            Vectors velocities = both.velocities(1);
            for (std::size_t i = 0; i < velocities.size(); ++i) velocities.set(i, Vec3f(float(-speed), 0, 0));
            EXPECT_TRUE(both.set_velocities(1, velocities).ok());
            const double before = both.momentum().linear.x();
            for (int frame = 0; frame < int(60 * (3 + 0.05 / speed)); ++frame)
                EXPECT_TRUE(both.advance(kOneThread).ok());
            return both.momentum().linear.x() / before;
        };
        const double awake = momentum_after(false);
        EXPECT_NEAR(momentum_after(true), awake, 0.02) << speed;
        EXPECT_NEAR(awake, 1, 0.02) << speed;
    }
}

TEST(RigidBody, ASleeperFallsWhenWhatHeldItIsTakenAway) {
    World world;
    world.obstacles.emplace_back().shape = HalfSpace{};
    const auto cube = block(3, 3, 3, 0.1, stone(0.1));
    Simulation stack = begin(world, {put(cube, Vec3d(0, 0.15, 0)), put(cube, Vec3d(0, 0.45, 0))});
    for (int frame = 0; frame < 90; ++frame) ASSERT_TRUE(stack.advance(kOneThread).ok());
    const Vec3d before = centre_of_mass(stack, 1);
    for (int frame = 0; frame < 5; ++frame) ASSERT_TRUE(stack.advance(kOneThread).ok());
    ASSERT_EQ((centre_of_mass(stack, 1) - before).norm(), 0) << "it sleeps";
    Vectors away = stack.positions(0);
    for (std::size_t i = 0; i < away.size(); ++i) away.set(i, away[i] + Vec3f(5, 0, 0));
    ASSERT_TRUE(stack.set_positions(0, away).ok());
    for (int frame = 0; frame < 60; ++frame) ASSERT_TRUE(stack.advance(kOneThread).ok());
    EXPECT_NEAR(centre_of_mass(stack, 1).y(), 0.15, 0.01);
}

TEST(RigidBody, OneThatMayNotSleepStaysAwakeAndLetsOthersSleep) {
    World world;
    world.obstacles.emplace_back().shape = HalfSpace{};
    const auto cube = block(3, 3, 3, 0.1, stone(0.1));
    std::vector<Actor> actors = {put(cube, Vec3d(0, 0.1499, 0)), put(cube, Vec3d(1, 0.1499, 0))};
    actors[1].may_sleep = false;
    Simulation rests = begin(world, actors);
    for (int frame = 0; frame < 120; ++frame) ASSERT_TRUE(rests.advance(kOneThread).ok());
    const auto is_still = [&](std::size_t body) {
        double most = 0;
        for (std::size_t i = 0; i < 8; ++i) most = std::max(most, double(rests.velocities(body)[i].norm()));
        return most == 0;
    };
    EXPECT_TRUE(is_still(0));
    EXPECT_FALSE(is_still(1));
}

/// Meshfree particles lie in the middle of their cells: the surface is half a spacing outside of their box.
TEST(RigidBody, MeshfreeBodiesLieOnRigidAndElasticOnes) {
    World world;
    world.obstacles.emplace_back().shape = HalfSpace{};
    Material soft;
    soft.model = MaterialModel::meshfree;
    soft.young_modulus = 1e6;
    soft.damping = 1;
    Material rubber = soft;
    rubber.model = MaterialModel::fem;
    struct Case {
        std::shared_ptr<const Body> below;
        double spacing;
    };
    for (const auto& [below, spacing] :
         {Case{block(8, 2, 8, 0.05, stone(0.1)), 0.05}, Case{block(8, 2, 8, 0.05, rubber), 0.05},
          Case{block(40, 4, 40, 0.01, stone(0.1)), 0.05}}) {
        const auto cube = block(4, 4, 4, spacing, soft);
        const double top = double(below->spacing()) * (below->cells.cells.size() == 128 ? 2 : 4);
        Simulation lying =
            begin(world, {put(below, Vec3d(0, 0.5 * top, 0)), put(cube, Vec3d(0, top + 2 * spacing, 0))});
        for (int frame = 0; frame < 150; ++frame) ASSERT_TRUE(lying.advance(kOneThread).ok());
        double lowest = 1e9, highest = -1e9, deepest = 0;
        for (int frame = 0; frame < 30; ++frame) {
            deepest = std::max(deepest, lying.advance(kOneThread).value().deepest_in_matter);
            lowest = std::min(lowest, centre_of_mass(lying, 1).y());
            highest = std::max(highest, centre_of_mass(lying, 1).y());
        }
        EXPECT_LT(highest - lowest, 1e-4);
        EXPECT_LT(deepest, 0.1 * spacing);
        EXPECT_NEAR(highest, top + 2 * spacing, 0.3 * spacing);
    }
}

TEST(RigidBody, SoftAndRigidBodiesMeet) {
    Material soft;
    soft.young_modulus = 2e5;
    soft.damping = 0;
    World world;
    world.gravity.setZero();
    std::vector<Actor> actors = {put(block(4, 4, 4, 0.1, soft), Vec3d(-0.4, 0, 0)),
                                 put(block(3, 3, 3, 0.1, stone()), Vec3d(0.4, 0.1, 0))};
    actors[1].velocity = Vec3d(-3, 0, 0);
    Simulation meeting = begin(world, actors);
    const Momentum momentum = meeting.momentum();
    const double energy = meeting.energy(kOneThread).total();
    double nearest = 1;
    for (int frame = 0; frame < 40; ++frame) {
        ASSERT_TRUE(meeting.advance(kOneThread).ok());
        nearest = std::min(nearest, centre_of_mass(meeting, 1).x() - centre_of_mass(meeting, 0).x());
        EXPECT_LT(meeting.energy(kOneThread).total(), 1.01 * energy);
    }
    EXPECT_GT(nearest, 0.1);
    EXPECT_LT((meeting.momentum().linear - momentum.linear).norm(), 1e-5 * momentum.linear.norm());
    EXPECT_LT((meeting.momentum().angular - momentum.angular).norm(), 1e-4 * momentum.angular.norm());
    EXPECT_LT(most_stretch(meeting, 1), 1e-5);
}

TEST(RigidBody, AHeapComesToRestAndGoesOnTheSameAfterARestore) {
    World world;
    world.body_friction = 0.5;
    world.body_restitution = 0.3;
    world.obstacles.emplace_back().shape = HalfSpace{};
    const std::array kinds = {block(3, 3, 3, 0.025, stone(0.1)), block(5, 2, 3, 0.025, stone(0.1))};
    std::vector<Actor> actors;
    for (int i = 0; i < 24; ++i) {
        actors.push_back(put(kinds[std::size_t(i % 2)], Vec3d(0.1 * (i % 2) + 0.01 * (i % 5), 0.1 + 0.12 * (i / 4),
                                                              0.1 * (i / 2 % 2) + 0.01 * (i % 3))));
        actors.back().placement.rotate(Eigen::AngleAxisd(0.4 * i, Vec3d(1, i % 3, i % 5).normalized()));
    }
    Simulation heap = begin(world, actors);
    for (int frame = 0; frame < 60; ++frame) {
        const FrameReport report = heap.advance(kOneThread).value();
        EXPECT_LT(report.deepest_contact, 0.02);
    }
    Simulation other = begin(world, actors);
    ASSERT_TRUE(other.restore(heap.save()).ok());
    const RunContext two_threads(2);
    for (int frame = 0; frame < 240; ++frame) {
        ASSERT_TRUE(heap.advance(kOneThread).ok());
        if (frame < 60) {
            ASSERT_TRUE(other.advance(two_threads).ok());
        }
        if (frame == 59) {
            EXPECT_TRUE(heap.save() == other.save());
        }
    }
    EXPECT_LT(heap.energy(kOneThread).kinetic, 1e-4);
    for (std::size_t b = 0; b < actors.size(); ++b) EXPECT_GT(centre_of_mass(heap, b).y(), 0.02) << b;
}

TEST(RigidBody, ADamagedPoseIsRefused) {
    Simulation resting = begin({}, {put(block(2, 2, 2, 0.1, stone()), Vec3d(0.25, 0.5, 0.75))});
    std::string bytes = resting.save();
    const double x = 0.25; // the pose's centre, a double; the particles are floats
    const std::size_t at = bytes.find(std::string(reinterpret_cast<const char*>(&x), sizeof x));
    ASSERT_NE(at, std::string::npos);
    const double wrong = std::numeric_limits<double>::quiet_NaN();
    bytes.replace(at, sizeof wrong, std::string(reinterpret_cast<const char*>(&wrong), sizeof wrong));
    const std::string before = resting.save();
    const Status restored = resting.restore(bytes);
    ASSERT_FALSE(restored.ok());
    EXPECT_EQ(restored.error().code, ErrorCode::bad_file);
    EXPECT_TRUE(resting.save() == before);
}

TEST(RigidBody, CannotBePinned) {
    World world;
    world.pins.push_back({.body = 0, .particles = {0}, .motion = {}});
    const auto made = Simulation::create(world, {put(block(2, 2, 2, 0.1, stone()), Vec3d::Zero())}, {}, kOneThread);
    ASSERT_FALSE(made.ok());
    EXPECT_NE(made.error().message.find("rigid"), std::string::npos);
}

Material rubber(double young_modulus = 1e5) {
    Material material;
    material.young_modulus = young_modulus;
    return material;
}

Simulation begin_with(const std::vector<Actor>& actors, const StepOptions& options, World world = {}) {
    return Simulation::create(std::move(world), actors, options, kOneThread).value();
}

TEST(AutomaticRigid, FewCellsAreRigid) {
    const auto crumb = block(3, 1, 2, 0.05, rubber()), cube = block(2, 2, 2, 0.05, rubber());
    World world;
    world.obstacles.emplace_back().shape = HalfSpace{};
    world.obstacles[0].restitution = world.body_restitution = 0;
    const std::vector<Actor> actors = {put(crumb, {0, 0.03, 0}), put(cube, {0.3, 0.1, 0}), put(crumb, {0, 0.09, 0})};
    Simulation falling = begin_with(actors, {}, world);
    EXPECT_EQ(falling.why_rigid(0), "it has only 6 cells");
    EXPECT_EQ(falling.why_rigid(1), "");
    EXPECT_EQ(&falling.body(0), &falling.body(2)) << "those of one kind share theirs";
    for (int frame = 0; frame < 120; ++frame) ASSERT_TRUE(falling.advance(kOneThread).ok());
    EXPECT_LT(most_stretch(falling, 0), 1e-5);
    EXPECT_GT(most_stretch(falling, 1), 1e-4);
    EXPECT_NEAR(centre_of_mass(falling, 0).y(), 0.025, 2e-3);
    EXPECT_NEAR(centre_of_mass(falling, 2).y(), 0.075, 4e-3) << "one lies on the other";
}

TEST(AutomaticRigid, IsSwitchedOffAndSparesWhatIsPinnedOrFlows) {
    const auto crumb = block(3, 2, 1, 0.05, rubber());
    EXPECT_EQ(begin_with({put(crumb, {0, 0, 0})}, {.automatic_rigid = false}).why_rigid(0), "");
    World world;
    world.pins.emplace_back().particles = {0};
    EXPECT_EQ(begin_with({put(crumb, {0, 0, 0})}, {}, world).why_rigid(0), "");
    Material clay = rubber();
    clay.model = MaterialModel::meshfree;
    EXPECT_EQ(begin_with({put(block(2, 2, 1, 0.05, clay), {0, 0, 0})}, {}).why_rigid(0), "");
}

TEST(AutomaticRigid, WhatIsFarTooStiffIsRigidAndTheRestStaysExplicit) {
    const std::vector<Actor> actors = {put(block(4, 4, 4, 0.02, rubber(1e11)), {0, 0.06, 0}),
                                       put(block(4, 4, 4, 0.02, rubber(1e5)), {0, 0.16, 0})};
    World world;
    world.obstacles.emplace_back().shape = HalfSpace{};
    for (const bool automatic : {true, false}) {
        Simulation falling = begin_with(actors, {.automatic_rigid = automatic}, world);
        EXPECT_EQ(falling.why_rigid(0).starts_with("elastic, it would need "), automatic);
        EXPECT_EQ(falling.why_rigid(1), "");
        EXPECT_EQ(falling.advance(kOneThread).value().substeps < 1000, automatic);
    }
    EXPECT_EQ(begin_with(actors, {.mode = StepMode::explicit_steps}, world).why_rigid(0), "");
}

} // namespace
} // namespace filigree::rigid_body_test
