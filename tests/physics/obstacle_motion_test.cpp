#include "filigree/physics/obstacle_motion.h"

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

} // namespace
} // namespace filigree
