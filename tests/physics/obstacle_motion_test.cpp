#include "filigree/physics/contact/obstacle_motion.h"

#include <gtest/gtest.h>

#include <numbers>

namespace filigree {
namespace {

/// A particle at each place.
std::vector<BodyState> particles_at(const std::vector<Vec3f>& places) {
    std::vector<BodyState> bodies(1);
    bodies[0].positions = Vectors(places.size());
    for (std::size_t i = 0; i < places.size(); ++i) bodies[0].positions.set(i, places[i]);
    return bodies;
}

TEST(ObstacleWay, GoesAlongTheKeysAndBack) {
    World world;
    world.obstacles.resize(1);
    const std::vector<BodyState> bodies = particles_at({{0, 0, 0}});
    EXPECT_EQ(obstacle_way(world, bodies, 0, 1), 0);
    world.obstacles[0].motion.move = {{0, 1, 2}, {Vec3d::Zero(), Vec3d(0, 3, 0), Vec3d::Zero()}, Vec3d::Zero()};
    EXPECT_DOUBLE_EQ(obstacle_way(world, bodies, 0, 2), 6);
    EXPECT_DOUBLE_EQ(obstacle_way(world, bodies, 0.5, 1.25), 1.5 + 0.75);
    EXPECT_EQ(obstacle_way(world, bodies, 2, 5), 0);
    EXPECT_EQ(obstacle_way(world, bodies, -3, 0), 0);
    world.obstacles[0].motion.move = {{1, 1}, {Vec3d::Zero(), Vec3d(0, 3, 0)}, Vec3d::Zero()}; // a jump
    EXPECT_DOUBLE_EQ(obstacle_way(world, bodies, 0.9, 1), 3);
}

TEST(ObstacleWay, BoundsTheWayOfATurn) {
    World world;
    world.obstacles.resize(1);
    RigidMotion& motion = world.obstacles[0].motion;
    motion.centre = {1, 0, 0};
    motion.angle = {{0, 1}, {Vec3d::Zero(), Vec3d(0, 0, 2 * std::numbers::pi)}, Vec3d::Zero()}; // all around
    const double way = obstacle_way(world, particles_at({{3, 0, 0}, {1, 1, 0}}), 0, 1);
    EXPECT_NEAR(way, 2 * std::numbers::pi * 2, 1e-6);
}

TEST(ObstacleVelocity, IsThatOfTheKeysSegmentAndNoneWhereItJumps) {
    World world;
    world.obstacles.resize(1);
    RigidMotion& motion = world.obstacles[0].motion;
    const auto speed = [&](double time) { return ObstaclePoses(world, time).velocity(0, {0, 0, 0}).y(); };
    motion.move = {{1, 2, 2, 3}, {Vec3d::Zero(), Vec3d(0, 3, 0), Vec3d(0, 9, 0), Vec3d(0, 5, 0)}, Vec3d::Zero()};
    EXPECT_EQ(speed(0.5), 0);
    EXPECT_FLOAT_EQ(speed(1), 3); // from the first key on ...
    EXPECT_FLOAT_EQ(speed(1.00005), 3);
    EXPECT_FLOAT_EQ(speed(1.99999), 3);
    EXPECT_EQ(speed(2), 0); // the jump
    EXPECT_FLOAT_EQ(speed(2.00001), -4);
    EXPECT_FLOAT_EQ(speed(3), -4); // ... to the last
    EXPECT_EQ(speed(3.00001), 0);
    motion.move = {{1, 1}, {Vec3d::Zero(), Vec3d(0, 3, 0)}, Vec3d::Zero()};
    for (const double time : {0.99995, 1.0, 1.00005}) EXPECT_EQ(speed(time), 0);
}

TEST(ObstacleVelocity, OfATurnIsThatOfItsMatter) {
    World world;
    world.obstacles.resize(1);
    RigidMotion& motion = world.obstacles[0].motion;
    motion.centre = {1, 2, 0};
    motion.angle = {{0, 1}, {Vec3d(0.5, -1, 2), Vec3d(2, 1, -0.5)}, Vec3d::Zero()};
    motion.move = {{0, 1}, {Vec3d::Zero(), Vec3d(0, 0, 4)}, Vec3d::Zero()};
    const Vec3d own(3, 1, 2);
    for (const double time : {0.2, 0.5, 0.9}) {
        const Vec3d wanted = (motion.at(time + 1e-5) * own - motion.at(time - 1e-5) * own) / 2e-5;
        const Vec3f place = (motion.at(time) * own).cast<float>();
        EXPECT_LT((ObstaclePoses(world, time).velocity(0, place).cast<double>() - wanted).norm(), 1e-4) << time;
    }
    // A wheel that turns more than once between two keys.
    motion.angle = {{0, 1}, {Vec3d::Zero(), Vec3d(0, 0, 20)}, Vec3d::Zero()};
    motion.move = {};
    EXPECT_LT((ObstaclePoses(world, 0.7).velocity(0, {2, 2, 0}) - Vec3f(0, 20, 0)).norm(), 1e-4f);
}

} // namespace
} // namespace filigree
