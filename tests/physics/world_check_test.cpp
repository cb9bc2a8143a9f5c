#include "filigree/physics/simulation.h"

#include "filigree/physics/body/make_cells.h"
#include <gtest/gtest.h>

#include <cmath>

namespace filigree {
namespace {

const double kNoNumber = std::nan("");

std::vector<Actor> one_body() {
    Actor actor;
    actor.body = std::make_shared<Body>(make_body(box_cells(2, 2, 2, 0.1), Material()));
    return {actor};
}

/// A world with one of everything, and nothing wrong.
World full_world() {
    World world;
    world.obstacles.resize(2);
    world.obstacles[1].shape = Ball{};
    world.pins.emplace_back().particles = {0, 26};
    world.forces.emplace_back().particles = {1};
    world.hands.resize(1);
    return world;
}

std::string complaint(const World& world, const std::vector<Actor>& actors) {
    const Status status = check_world(world, actors);
    if (status.ok()) return "";
    EXPECT_EQ(status.error().code, ErrorCode::usage);
    EXPECT_FALSE(Simulation::create(world, actors, {}, RunContext(1)).ok());
    return status.error().message;
}

TEST(CheckWorld, TakesASoundWorld) {
    World world = full_world();
    world.obstacles[1].motion.move = {
        {0, 1, 1, 2}, {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 0, 0}}, Vec3d::Zero()}; // with a jump
    EXPECT_EQ(complaint(world, one_body()), "");
}

TEST(CheckWorld, SaysWhichThingAndWhichField) {
    struct Case {
        const char* place;
        void (*spoil)(World&);
    };
    const Case cases[] = {
        {"world.gravity", [](World& w) { w.gravity.y() = kNoNumber; }},
        {"world.air_density", [](World& w) { w.air_density = -1; }},
        {"world.wind.times",
         [](World& w) {
             w.wind = {{1, 0}, {Vec3d::Zero(), Vec3d::Zero()}, Vec3d::Zero()};
         }},
        {"world.body_friction", [](World& w) { w.body_friction = -0.1; }},
        {"world.body_restitution", [](World& w) { w.body_restitution = 1.1; }},
        {"world.body_pairs[0]",
         [](World& w) {
             w.body_pairs.push_back({0, 99, {}});
         }},
        {"world.body_pairs[0].contact.friction",
         [](World& w) {
             w.body_pairs.push_back({0, 0, {.friction = -1}});
         }},
        {"world.obstacles[0].shape.normal",
         [](World& w) {
             w.obstacles[0].shape = HalfSpace{{0, 0, 0}, {0, 0, 0}};
         }},
        {"world.obstacles[1].shape.radius",
         [](World& w) {
             w.obstacles[1].shape = Ball{{0, 0, 0}, 0};
         }},
        {"world.obstacles[1].shape.size",
         [](World& w) {
             w.obstacles[1].shape = Cuboid{{0, 0, 0}, {1, 0, 1}};
         }},
        {"world.obstacles[1].shape.field", [](World& w) { w.obstacles[1].shape = MeshObstacle{}; }},
        {"world.obstacles[1].friction", [](World& w) { w.obstacles[1].friction = -0.5; }},
        {"world.obstacles[1].restitution", [](World& w) { w.obstacles[1].restitution = kNoNumber; }},
        {"world.obstacles[1].stiffness", [](World& w) { w.obstacles[1].stiffness = 0; }},
        {"world.obstacles[1].motion.move.times",
         [](World& w) {
             w.obstacles[1].motion.move = {{0, 2, 1}, std::vector<Vec3d>(3, Vec3d::Zero()), Vec3d::Zero()};
         }},
        {"world.obstacles[1].motion.angle.values", [](World& w) { w.obstacles[1].motion.angle.times = {0}; }},
        {"world.pins[0].body", [](World& w) { w.pins[0].body = 1; }},
        {"world.pins[0].particles", [](World& w) { w.pins[0].particles = {27}; }},
        {"world.pins[0].motion.move.times",
         [](World& w) {
             w.pins[0].motion.move = {{1, 0}, std::vector<Vec3d>(2, Vec3d::Zero()), Vec3d::Zero()};
         }},
        {"world.forces[0].particles", [](World& w) { w.forces[0].particles = {27}; }},
        {"world.forces[0].force.constant", [](World& w) { w.forces[0].force.constant.x() = kNoNumber; }},
        {"world.hands[0].body", [](World& w) { w.hands[0].body = 7; }},
        {"world.hands[0].point", [](World& w) { w.hands[0].point.x() = std::nanf(""); }},
        {"world.hands[0].stiffness", [](World& w) { w.hands[0].stiffness = -1; }},
        {"world.hands[0].target.constant", [](World& w) { w.hands[0].target.constant.x() = kNoNumber; }},
    };
    for (const Case& wrong : cases) {
        World world = full_world();
        wrong.spoil(world);
        EXPECT_EQ(complaint(world, one_body()).substr(0, std::string(wrong.place).size() + 1),
                  std::string(wrong.place) + " ");
    }
}

TEST(CheckWorld, LooksAtTheActors) {
    EXPECT_NE(complaint({}, {}).find("actors"), std::string::npos);
    std::vector<Actor> actors = one_body();
    actors.emplace_back();
    EXPECT_NE(complaint({}, actors).find("actors[1].body"), std::string::npos);
    actors = one_body();
    actors[0].velocity.x() = kNoNumber;
    EXPECT_NE(complaint({}, actors).find("actors[0].velocity"), std::string::npos);
    actors = one_body();
    actors[0].placement.linear() *= 2;
    EXPECT_NE(complaint({}, actors).find("actors[0].placement"), std::string::npos);
}

} // namespace
} // namespace filigree
