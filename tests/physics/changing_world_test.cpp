// Bodies that come and go, and obstacles that are set, while a simulation runs.
#include "physics/simulation_scenes.h"
#include "physics/test_bodies.h"
#include "threads.h"

#include <numbers>

namespace filigree {
namespace {

using namespace simulation_scenes;

const std::vector<MaterialModel> kAllModels = {MaterialModel::fem, MaterialModel::springs, MaterialModel::meshfree,
                                               MaterialModel::rigid, MaterialModel::mpm};

std::shared_ptr<const Fracture> in_halves(std::shared_ptr<const Body> whole, double strength) {
    auto fracture = std::make_shared<Fracture>();
    const Partition partition{2, [](const Vec3d& point) { return Index(point.x() > 0.2); }};
    fracture->body = break_body(std::move(whole), partition, kOneThread).value();
    fracture->material.strength = strength;
    fracture->material.energy = 1;
    return fracture;
}

Actor breaking(const Vec3d& at, double strength = 1e3) {
    Actor made = actor(box(5, 3, 3, 0.1, material(MaterialModel::fem, 1e6)), at);
    made.fracture = in_halves(made.body, strength);
    return made;
}

std::string usage_of(const Status& status) {
    EXPECT_FALSE(status.ok());
    if (status.ok()) return "";
    EXPECT_EQ(status.error().code, ErrorCode::usage);
    return status.error().message;
}

std::size_t add(Simulation& simulation, const Actor& actor, unsigned threads = 1) {
    const Result<std::size_t> added = simulation.add_body(actor, RunContext(threads));
    EXPECT_TRUE(added.ok()) << (added ? "" : added.error().message);
    return added.ok() ? *added : 0;
}

TEST(AddBody, BeforeTheFirstFrameItIsAsInCreate) {
    const auto soft = box(3, 3, 3, 0.1, material(MaterialModel::fem, 3e4));
    for (const MaterialModel model : kAllModels) {
        Actor later = actor(box(3, 2, 3, 0.1, material(model, 3e4)), {0.1, 0.34, 0.05});
        later.velocity = {0.5, -1, 0};
        later.spin = {1, 2, 3};
        for (const bool breaks : {false, true}) {
            if (breaks && model != MaterialModel::fem) continue;
            if (breaks) later = breaking({0.1, 0.34, 0.05});
            Simulation whole = simulation(with_ground(), {actor(soft, {0, 0.01, 0}), later});
            for (const unsigned threads : {1u, 2u}) {
                Simulation grown = simulation(with_ground(), {actor(soft, {0, 0.01, 0})});
                EXPECT_EQ(add(grown, later, threads), 1u);
                EXPECT_TRUE(grown.save() == simulation(with_ground(), {actor(soft, {0, 0.01, 0}), later}).save());
                run(grown, 20, threads);
                if (threads == 1) run(whole, 20);
                EXPECT_TRUE(grown.save() == whole.save()) << int(model) << " " << threads;
            }
        }
    }
}

/// What automatic_rigid makes rigid is rigid as well when it comes later, and shares what belongs to its kind.
TEST(AddBody, IsMadeRigidByTheSameRules) {
    Simulation world = simulation(with_ground(), {actor(box(3, 3, 3, 0.1, material(MaterialModel::fem)))});
    const auto small = box(2, 1, 1, 0.1, material(MaterialModel::fem));
    const std::size_t first = add(world, actor(small, {1, 0.5, 0})), second = add(world, actor(small, {2, 0.5, 0}));
    EXPECT_EQ(world.why_rigid(first), "it has only 2 cells");
    EXPECT_EQ(world.body(first).material.model, MaterialModel::rigid);
    EXPECT_EQ(&world.body(first), &world.body(second));
    run(world, 30);
    EXPECT_GT(world.positions(second)[0].y(), -0.01f);
}

TEST(AddBody, WhileOthersBreakAndTheSameForAnyThreads) {
    const auto at_end = [&](unsigned threads) {
        Simulation world = simulation(with_ground(), {breaking({0, 0.6, 0})}, {}, threads);
        run(world, 30, threads);
        EXPECT_GT(world.fracture(0).parts, 1u);
        Actor stone = actor(box(2, 2, 2, 0.1, material(MaterialModel::rigid)), {0.1, 1, 0.05});
        EXPECT_EQ(add(world, stone, threads), 1u);
        EXPECT_EQ(add(world, breaking({0.1, 1.5, 0}), threads), 2u);
        run(world, 60, threads);
        EXPECT_GT(world.fracture(2).parts, 1u);
        EXPECT_EQ(world.fracture(1).parts, 0u);
        for (std::size_t body = 0; body < 3; ++body) {
            EXPECT_TRUE(all_finite(world.positions(body)));
            EXPECT_GT(centre_of_mass(world, body).y(), 0);
        }
        EXPECT_GT(centre_of_mass(world, 1).y(), 0.09); // it lies on something
        return world.save();
    };
    const std::string bytes = at_end(1);
    for (const unsigned threads : {2u, 8u}) EXPECT_TRUE(bytes == at_end(threads)) << threads;
}

TEST(AddBody, ChecksAsCreateDoes) {
    Simulation world = simulation(with_ground(), {actor(box(3, 3, 3, 0.1, material(MaterialModel::mpm)))});
    const std::string before = world.save();
    const auto refused = [&](const Actor& wrong) {
        const Result<std::size_t> added = world.add_body(wrong, kOneThread);
        EXPECT_FALSE(added.ok());
        EXPECT_TRUE(world.save() == before);
        return added.ok() ? "" : added.error().message;
    };
    EXPECT_EQ(refused(Actor{}), "actor.body is missing.");
    Actor nowhere = actor(box(3, 3, 3, 0.1, material(MaterialModel::fem)));
    nowhere.velocity.x() = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(refused(nowhere), "actor.velocity must be finite.");
    EXPECT_NE(refused(actor(box(3, 3, 3, 0.2, material(MaterialModel::mpm)))).find("make it of more particles"),
              std::string::npos);
    EXPECT_EQ(world.body_count(), 1u);
    RunContext cancelled(1);
    cancelled.cancel();
    const auto added = world.add_body(actor(box(3, 3, 3, 0.1, material(MaterialModel::fem))), cancelled);
    ASSERT_FALSE(added.ok());
    EXPECT_EQ(added.error().code, ErrorCode::cancelled);
    EXPECT_TRUE(world.save() == before);
}

/// A grid for the first body of mpm that comes, and for the next after all have gone.
TEST(AddBody, OfMpmMakesTheGridThatItNeeds) {
    const auto stone = box(2, 2, 2, 0.1, material(MaterialModel::rigid));
    Simulation world = simulation(with_ground(), {actor(stone, {3, 0.5, 0})});
    const std::size_t wax = add(world, actor(box(4, 4, 4, 0.05, material(MaterialModel::mpm)), {0, 0.3, 0}));
    run(world, 20);
    EXPECT_LT(centre_of_mass(world, wax).y(), 0.35);
    EXPECT_EQ(world.matter(wax).positions.size(), world.body(wax).particle_count());
    ASSERT_TRUE(world.remove_body(wax).ok());
    EXPECT_EQ(world.matter(wax).positions.size(), 0u);
    const Actor wide = actor(box(3, 3, 3, 0.2, material(MaterialModel::mpm)), {0, 0.3, 0});
    const std::size_t coarse = add(world, wide);
    run(world, 20);
    Simulation alone = simulation(with_ground(), {wide});
    run(alone, 20);
    const Vectors &here = world.positions(coarse), &there = alone.positions(0);
    for (std::size_t i = 0; i < there.size(); ++i) EXPECT_LT((here[i] - there[i]).norm(), 1e-4f);
}

TEST(RemoveBody, IsGoneFromAllSums) {
    for (const MaterialModel model : kAllModels) {
        const auto body = box(3, 3, 3, 0.1, material(model, 3e4));
        Actor thrown = actor(body, {0, 0.4, 0});
        thrown.velocity = {1, 0, 0};
        thrown.spin = {0, 3, 0};
        Actor other = actor(body, {2, 0.4, 0});
        other.velocity = {0, 0, 2};
        Simulation both = simulation(with_ground(), {thrown, other}), one = simulation(with_ground(), {other});
        run(both, 10);
        run(one, 10);
        ASSERT_TRUE(both.remove_body(0).ok());
        EXPECT_NEAR((both.momentum().linear - one.momentum().linear).norm(), 0, 1e-3) << int(model);
        EXPECT_NEAR(both.energy(kOneThread).total(), one.energy(kOneThread).total(), 1e-3) << int(model);
        EXPECT_FALSE(both.has_body(0));
        EXPECT_TRUE(both.has_body(1));
        EXPECT_EQ(both.body_count(), 2u);
        EXPECT_EQ(usage_of(both.check_body(0)), "Body 0 was removed.");
        EXPECT_EQ(usage_of(both.remove_body(0)), "Body 0 was removed.");
        EXPECT_EQ(usage_of(both.set_positions(0, Vectors(1))), "Body 0 was removed.");
        EXPECT_EQ(usage_of(both.set_forces(0, {})), "Body 0 was removed.");
        EXPECT_EQ(usage_of(both.set_hands({{.body = 0}}, kOneThread)), "Body 0 was removed.");
        EXPECT_EQ(usage_of(both.remove_body(2)), "There is no body 2; there are 2, counted from 0.");
        EXPECT_EQ(both.positions(0).size(), 0u);
        run(both, 30);
        EXPECT_GT(centre_of_mass(both, 1).y(), 0.1);
        EXPECT_EQ(add(both, thrown), 2u); // a number is given once
        run(both, 10);
        ASSERT_TRUE(both.remove_body(1).ok());
        ASSERT_TRUE(both.remove_body(2).ok());
        run(both, 2);
        EXPECT_EQ(both.momentum().linear.norm(), 0);
        EXPECT_EQ(both.energy(kOneThread).total(), 0);
    }
}

TEST(RemoveBody, WhatLayOnItWakesAndFalls) {
    const auto block = box(2, 2, 2, 0.1, material(MaterialModel::rigid));
    Simulation pile = simulation(with_ground(), {actor(block, {0, 0, 0}), actor(block, {0, 0.2, 0}),
                                                 actor(block, {0, 0.4, 0}), actor(block, {2, 0, 0})});
    run(pile, 120);
    for (std::size_t b = 0; b < 4; ++b) ASSERT_TRUE(pile.is_asleep(b)) << b;
    ASSERT_TRUE(pile.remove_body(0).ok());
    run(pile, 10);
    EXPECT_LT(centre_of_mass(pile, 1).y(), 0.25);
    EXPECT_TRUE(pile.is_asleep(3));
    run(pile, 200);
    EXPECT_NEAR(centre_of_mass(pile, 1).y(), 0.1, 0.01);
    EXPECT_NEAR(centre_of_mass(pile, 2).y(), 0.3, 0.01);
    EXPECT_TRUE(pile.is_asleep(2));
}

TEST(RemoveBody, EndsPinsHandsForcesAndAttachments) {
    for (const MaterialModel model : {MaterialModel::fem, MaterialModel::mpm}) {
        const auto body = box(3, 3, 3, 0.1, material(model, 3e4));
        World world = with_ground();
        world.pins = {{.body = 0, .particles = {0, 1}, .motion = {}}, {.body = 1, .particles = {2}, .motion = {}}};
        world.forces = {{0, {}, {{}, {}, Vec3d(0, 50, 0)}}, {1, {}, {{}, {}, Vec3d(0, 1, 0)}}};
        world.hands = {{.body = 1, .target = {{}, {}, Vec3d(1, 2, 1)}},
                       {.body = 0, .target = {{}, {}, Vec3d(3, 2, 1)}}};
        Simulation simulation = simulation_scenes::simulation(world, {actor(body, {0, 1, 0}), actor(body, {2, 1, 0})});
        Simulation alone = [&] {
            World of_one = world;
            of_one.pins.erase(of_one.pins.begin());
            of_one.forces.erase(of_one.forces.begin());
            of_one.hands.pop_back();
            of_one.pins[0].body = of_one.forces[0].body = of_one.hands[0].body = 0;
            return simulation_scenes::simulation(of_one, {actor(body, {2, 1, 0})});
        }();
        Vectors push(body->particle_count());
        push.set(3, {1, 0, 0});
        ASSERT_TRUE(simulation.set_forces(0, push).ok());
        const std::vector<Vec3f> points = {{0.1f, 0.1f, 0.1f}, {0.2f, 0.1f, 0.1f}};
        const std::size_t of_first = simulation.attach(0, points, kOneThread);
        const std::size_t of_second = simulation.attach(1, points, kOneThread);
        const std::size_t of_alone = alone.attach(0, points, kOneThread);
        ASSERT_TRUE(simulation.remove_body(0).ok());
        EXPECT_EQ(simulation.world().pins.size(), 1u);
        EXPECT_EQ(simulation.world().forces.size(), 1u);
        EXPECT_EQ(simulation.world().hands.size(), 1u);
        EXPECT_FALSE(simulation.has_attachment(of_first));
        EXPECT_TRUE(simulation.has_attachment(of_second));
        run(simulation, 15);
        run(alone, 15);
        std::vector<Vec3f> there(2), expected(2);
        simulation.attached(of_second, there, {}, kOneThread);
        alone.attached(of_alone, expected, {}, kOneThread);
        for (std::size_t k = 0; k < 2; ++k) EXPECT_LT((there[k] - expected[k]).norm(), 1e-4f) << int(model);
        // Another body in its place has none of it.
        EXPECT_EQ(add(simulation, actor(body, {0, 1, 0})), 2u);
        run(simulation, 20);
        EXPECT_NEAR(centre_of_mass(simulation, 2).x(), 0.15, 0.01);
        EXPECT_LT(centre_of_mass(simulation, 2).y(), 0.8);
    }
}

TEST(RemoveBody, TakesItsPiecesAlong) {
    const auto stone = box(2, 2, 2, 0.1, material(MaterialModel::rigid));
    Simulation world = simulation(with_ground(), {actor(stone, {3, 0, 0}), breaking({0, 0.6, 0})});
    run(world, 30);
    ASSERT_GT(world.fracture(1).parts, 1u);
    ASSERT_TRUE(world.remove_body(1).ok());
    EXPECT_EQ(world.fracture(1).parts, 0u);
    EXPECT_LT(world.momentum().linear.norm(), 1e-2);
    const std::string small = world.save();
    for (int round = 0; round < 5; ++round) { // slots are used again
        const std::size_t number = add(world, breaking({0, 0.6, 0}));
        EXPECT_EQ(number, std::size_t(2 + round));
        run(world, 25);
        EXPECT_GT(world.fracture(number).parts, 1u);
        ASSERT_TRUE(world.remove_body(number).ok());
    }
    EXPECT_LT(world.save().size(), small.size() + 64);
}

TEST(ChangingWorld, StatesGoOnOnlyWithTheSameBodies) {
    const auto body = box(3, 3, 3, 0.1, material(MaterialModel::fem, 3e4));
    const auto begin = [&] { return simulation(with_ground(), {actor(body), actor(body, {1, 0.2, 0})}); };
    const auto change = [&](Simulation& world) {
        run(world, 3);
        ASSERT_TRUE(world.remove_body(0).ok());
        EXPECT_EQ(add(world, actor(box(2, 3, 2, 0.1, material(MaterialModel::rigid)), {1, 1, 0})), 2u);
    };
    Simulation one = begin();
    const std::string at_first = one.save();
    change(one);
    const std::string changed = one.save();
    const Status refused = one.restore(at_first);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::mismatch);
    EXPECT_NE(refused.error().message.find("some were added or removed"), std::string::npos) << refused.error().message;
    EXPECT_TRUE(one.save() == changed);
    run(one, 40);
    // Where the same bodies came and went it goes on with the same bytes.
    Simulation other = begin();
    EXPECT_FALSE(other.restore(changed).ok());
    change(other);
    ASSERT_TRUE(other.restore(changed).ok());
    run(other, 40);
    EXPECT_TRUE(one.save() == other.save());
}

TEST(ChangingWorld, ACancelledFrameIsUndone) {
    Simulation world = simulation(with_ground(), {breaking({0, 0.6, 0})});
    run(world, 30);
    add(world, actor(box(3, 3, 3, 0.1, material(MaterialModel::meshfree, 3e4)), {0, 1, 0}));
    add(world, actor(box(3, 3, 3, 0.1, material(MaterialModel::mpm, 3e4)), {2, 1, 0}));
    run(world, 10);
    const std::string before = world.save();
    const std::vector<ContactEvent> events = world.contact_events();
    RunContext cancelled(1);
    cancelled.cancel();
    EXPECT_FALSE(world.advance(cancelled).ok());
    EXPECT_TRUE(world.save() == before);
    EXPECT_EQ(world.contact_events().size(), events.size());
    run(world, 5);
}

Eigen::Isometry3d pose(const Vec3d& move, double degrees = 0, const Vec3d& axis = Vec3d::UnitZ()) {
    return Eigen::Translation3d(move) * Eigen::AngleAxisd(degrees * std::numbers::pi / 180, axis);
}

World with_table(double friction = 1) {
    World world;
    Obstacle table;
    table.shape = Cuboid{{0, -0.05, 0}, {4, 0.1, 4}};
    table.friction = friction;
    table.restitution = 0;
    world.obstacles.push_back(table);
    return world;
}

class Carried : public testing::TestWithParam<MaterialModel> {};
INSTANTIATE_TEST_SUITE_P(SetObstacle, Carried,
                         testing::Values(MaterialModel::rigid, MaterialModel::fem, MaterialModel::mpm));

/// A table that is set once carries what lies on it; so does one that is set anew in each frame, and one that is moved.
TEST_P(Carried, WhatLiesOnItGoesAlong) {
    for (const char* way : {"once", "each", "move"}) {
        Simulation world = simulation(with_table(), {actor(box(3, 2, 3, 0.1, material(GetParam(), 1e5)))});
        run(world, 30);
        const Vec3d start = centre_of_mass(world);
        const Vec3d velocity(0.6, 0, 0);
        double most_deep = 0;
        for (int frame = 0; frame < 60; ++frame) {
            if (way == std::string("once") ? frame == 0 : way == std::string("each")) {
                ASSERT_TRUE(world.set_obstacle(0, pose(frame / 60.0 * velocity), velocity).ok());
            } else if (way == std::string("move")) {
                ASSERT_TRUE(world.move_obstacle(0, pose((frame + 1) / 60.0 * velocity)).ok());
            }
            most_deep = std::max(most_deep, run(world, 1).deepest_contact);
        }
        EXPECT_LT((world.obstacle_pose(0).translation() - velocity).norm(), 1e-9);
        EXPECT_NEAR(centre_of_mass(world).x() - start.x(), 0.6, 0.06) << way;
        EXPECT_NEAR(centre_of_mass(world).y(), start.y(), 0.02) << way;
        EXPECT_LT(most_deep, 0.03) << way;
    }
}

/// Along a circle, by poses and velocities that a program works out: what lies between two frames is smooth.
TEST(SetObstacle, ACurvedWayIsNoBlow) {
    Simulation world = simulation(with_table(), {actor(box(3, 2, 3, 0.1, material(MaterialModel::rigid)))});
    run(world, 30);
    const double start = centre_of_mass(world).y(), radius = 0.3, pace = 2;
    double most = 0;
    for (int frame = 0; frame < 120; ++frame) {
        const double angle = pace * frame / 60;
        const Vec3d at(radius * std::sin(angle), radius * (1 - std::cos(angle)), 0);
        ASSERT_TRUE(world.set_obstacle(0, pose(at), radius * pace * Vec3d(std::cos(angle), std::sin(angle), 0)).ok());
        run(world, 1);
        const double table = radius * (1 - std::cos(pace * (frame + 1) / 60));
        most = std::max(most, std::abs(centre_of_mass(world).y() - start - table));
    }
    EXPECT_LT(most, 0.01);
}

TEST(SetObstacle, ASpinThrows) {
    Simulation world = simulation(with_table(), {actor(box(2, 2, 2, 0.1, material(MaterialModel::rigid)), {1, 0, 0})});
    run(world, 10);
    ASSERT_TRUE(world.set_obstacle(0, pose(Vec3d::Zero()), Vec3d::Zero(), {0, 0, 2}).ok());
    run(world, 10);
    // Its contact moves at spin times the distance: 2 rad/s at 1.1 m.
    EXPECT_GT(world.momentum().linear.y() / world.body(0).material.density / 0.008, 1.5);
    const Mat3d turned = Eigen::AngleAxisd(2 * 10 / 60.0, Vec3d::UnitZ()).toRotationMatrix();
    EXPECT_LT((world.obstacle_pose(0).linear() - turned).norm(), 1e-9);
    // About its own middle, which stays.
    EXPECT_LT((world.obstacle_pose(0) * Vec3d(0, -0.05, 0) - Vec3d(0, -0.05, 0)).norm(), 1e-9);
}

/// A table that jumps away leaves what lay on it; one that comes back from below through it takes nothing along.
TEST(SetObstacle, AJumpIsNoBlow) {
    for (const MaterialModel model : kAllModels) {
        Simulation world = simulation(with_table(), {actor(box(3, 2, 3, 0.1, material(model, 1e5)))});
        run(world, 40);
        ASSERT_TRUE(world.set_obstacle(0, pose({0, -2, 0})).ok());
        run(world, 12);
        const double fell = 0.5 * 9.81 * 0.2 * 0.2;
        EXPECT_NEAR(centre_of_mass(world).y(), 0.1 - fell, 0.03) << int(model);
        const double speed = world.momentum().linear.norm();
        ASSERT_TRUE(world.set_obstacle(0, pose({0, 2, 0})).ok()); // past the body
        run(world, 2);
        EXPECT_NEAR(world.momentum().linear.norm() / speed, 14.0 / 12, 0.05) << int(model);
    }
}

/// By less than a cell, by whole cells, and by more than half of the body.
TEST(SetObstacle, AJumpIntoABodyMovesItAndThrowsNothing) {
    for (const MaterialModel model : {MaterialModel::rigid, MaterialModel::fem, MaterialModel::springs})
        for (const double deep : {0.05, 0.1, 0.15}) {
            World world = free_space();
            world.obstacles.push_back({.shape = Cuboid{{-5, 0, 0}, {0.4, 2, 2}}, .motion = {}});
            Simulation scene = simulation(world, {actor(box(4, 4, 4, 0.1, material(model, 1e6)))});
            run(scene, 2);
            const double before = centre_of_mass(scene).x();
            ASSERT_TRUE(scene.set_obstacle(0, pose({4.8 + deep, 0, 0})).ok());
            run(scene, 30);
            EXPECT_NEAR(centre_of_mass(scene).x(), before + deep, 0.01) << int(model) << ' ' << deep;
            EXPECT_LT(scene.energy(RunContext(1)).total(), 1e-3) << int(model) << ' ' << deep;
        }
}

TEST(SetObstacle, WakesWhatItTouches) {
    World world = with_table();
    world.obstacles.push_back({.shape = Ball{{-1, 0.1, 0}, 0.1}, .motion = {}});
    const auto block = box(2, 2, 2, 0.1, material(MaterialModel::rigid));
    for (const bool jumps : {true, false}) {
        Simulation one = simulation(world, {actor(block), actor(block, {1.5, 0, 0})});
        run(one, 90);
        ASSERT_TRUE(one.is_asleep(0) && one.is_asleep(1));
        if (jumps) {
            ASSERT_TRUE(one.set_obstacle(1, pose({0.93, 0, 0})).ok()); // a little into the first
            run(one, 1);
            EXPECT_FALSE(one.is_asleep(0));
            EXPECT_TRUE(one.is_asleep(1));
        } else {
            ASSERT_TRUE(one.set_obstacle(1, pose(Vec3d::Zero()), {2, 0, 0}).ok());
        }
        run(one, 40);
        EXPECT_GT(centre_of_mass(one, 0).x(), jumps ? 0.11 : 0.2) << jumps;
        EXPECT_LT(centre_of_mass(one, 0).x(), jumps ? 0.5 : 2) << jumps;
    }
}

TEST(SetObstacle, IsSavedAndRestored) {
    const auto body = box(3, 2, 3, 0.1, material(MaterialModel::fem, 1e5));
    Simulation one = simulation(with_table(), {actor(body)});
    const std::string at_first = one.save();
    run(one, 10);
    ASSERT_TRUE(one.set_obstacle(0, pose({0, 0.001, 0}, 3), {0.1, 0.3, 0}, {0, 0, 0.5}).ok());
    run(one, 7);
    const std::string middle = one.save();
    run(one, 10);
    Simulation other = simulation(with_table(), {actor(body)});
    ASSERT_TRUE(other.restore(middle).ok());
    run(other, 10);
    EXPECT_TRUE(one.save() == other.save());
    ASSERT_TRUE(one.restore(at_first).ok());
    EXPECT_TRUE(one.save() == at_first);
    EXPECT_TRUE(one.obstacle_pose(0).isApprox(Eigen::Isometry3d::Identity()));
}

TEST(SetObstacle, ChecksWhatItIsGiven) {
    Simulation world = simulation(with_table(), {actor(box(2, 2, 2, 0.1, material(MaterialModel::rigid)))});
    EXPECT_EQ(usage_of(world.set_obstacle(1, pose(Vec3d::Zero()))),
              "There is no obstacle 1; there are 1, counted from 0.");
    Eigen::Isometry3d wide = Eigen::Isometry3d::Identity();
    wide.linear() *= 2;
    EXPECT_EQ(usage_of(world.set_obstacle(0, wide)), "pose must be a turn and a shift.");
    EXPECT_EQ(usage_of(world.move_obstacle(0, wide)), "pose must be a turn and a shift.");
    const double nothing = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(usage_of(world.set_obstacle(0, pose(Vec3d::Zero()), {nothing, 0, 0})), "velocity must be finite.");
    EXPECT_EQ(usage_of(world.set_obstacle(0, pose(Vec3d::Zero()), {0, 0, 0}, {nothing, 0, 0})), "spin must be finite.");
}

TEST(Sleep, CanBeSwitched) {
    const auto block = box(2, 2, 2, 0.1, material(MaterialModel::rigid));
    Simulation world = simulation(with_ground(), {actor(block), actor(block, {1, 0, 0})});
    ASSERT_TRUE(world.set_may_sleep(1, false).ok());
    run(world, 90);
    EXPECT_TRUE(world.is_asleep(0));
    EXPECT_FALSE(world.is_asleep(1));
    ASSERT_TRUE(world.wake(0).ok());
    EXPECT_FALSE(world.is_asleep(0));
    run(world, 10);
    EXPECT_FALSE(world.is_asleep(0));
    ASSERT_TRUE(world.set_may_sleep(1, true).ok());
    run(world, 60);
    EXPECT_TRUE(world.is_asleep(0) && world.is_asleep(1));
    ASSERT_TRUE(world.set_may_sleep(0, false).ok());
    EXPECT_FALSE(world.is_asleep(0));
    EXPECT_EQ(usage_of(world.wake(5)), "There is no body 5; there are 2, counted from 0.");
    ASSERT_TRUE(world.remove_body(0).ok());
    EXPECT_EQ(usage_of(world.set_may_sleep(0, true)), "Body 0 was removed.");
    EXPECT_FALSE(world.is_asleep(0));
}

} // namespace
} // namespace filigree
