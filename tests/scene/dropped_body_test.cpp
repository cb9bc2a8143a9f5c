#include "scene/dropped_ball.h"
#include "threads.h"

#include "filigree/physics/material.h"
#include "filigree/physics/simulation.h"

#include <algorithm>
#include <numeric>

#include <gtest/gtest.h>

using namespace filigree_test;

namespace {

const Vec3d kUp = Vec3d::UnitY();

TEST(DroppedBody, StandsWhereTheMeshIsAboveTheGround) {
    DropOptions options = jelly();
    options.size = 0.5; // m
    options.drop = 0.25;
    const auto body = dropped(options);
    EXPECT_NEAR(body->scale, 0.25, 1e-3);
    EXPECT_TRUE(body->surroundings.has_ground);
    EXPECT_NEAR(body->surroundings.ground_level, -2, 0.02); // its lowest point is at -1, and 1 unit above the ground
    EXPECT_EQ(body->world.obstacles.size(), 1u);
    EXPECT_LT(body->world.gravity.y(), -9);
    const Box room = room_of(*body, kUp);
    EXPECT_NEAR(room.min.y(), -2, 0.02);
    EXPECT_NEAR(room.max.y(), 1, 0.02);
}

TEST(DroppedBody, EveryObstacleIsBelowAndDrawn) {
    for (const ObstacleChoice choice : {ObstacleChoice::ball, ObstacleChoice::step, ObstacleChoice::slope})
        for (const Vec3d& up : {Vec3d(Vec3d::UnitX()), Vec3d(Vec3d::UnitY()), Vec3d(Vec3d::UnitZ())}) {
            DropOptions options = jelly();
            options.obstacle = choice;
            options.drop = 0.1;
            const auto body = dropped(options, up);
            ASSERT_EQ(body->surroundings.obstacles.size(), 1u);
            EXPECT_EQ(check_mesh(body->surroundings.obstacles[0]), "");
            double highest = -1e9, below = 1e9;
            for (const Vec3f& p : body->surroundings.obstacles[0].positions) {
                highest = std::max(highest, p.cast<double>().dot(up));
                below = std::min(below, p.cast<double>().dot(up));
            }
            if (choice != ObstacleChoice::slope) {
                EXPECT_NEAR(highest, -1.2, 0.02); // 0.1 m is 0.2 units
            }
            EXPECT_NEAR(below, body->surroundings.ground_level, 0.02);
            const Vectors& rest = body->body->rest;
            for (std::size_t i = 0; i < rest.size(); ++i)
                for (const Obstacle& obstacle : body->world.obstacles)
                    EXPECT_GT(distance_to(obstacle, obstacle.motion.at(0), rest[i]).distance, -0.01);
        }
}

TEST(DroppedBody, HoldsParticlesNearPinnedVertices) {
    const auto model = ball_model();
    const auto body =
        make_dropped_body(model, nullptr, {}, jelly(), std::vector<Index>{0, 5}, kUp, kAllThreads).value();
    ASSERT_EQ(body->world.pins.size(), 1u);
    EXPECT_GE(body->world.pins[0].particles.size(), 2u);
    EXPECT_TRUE(dropped(jelly())->world.pins.empty());
}

TEST(DroppedBody, MeltsInAboutTheTimeAsked) {
    DropOptions options = jelly();
    options.material = std::ranges::find(named_materials(), "wax", &NamedMaterial::name)->material;
    options.drop = 0;
    options.melting_time = 1;
    options.air_temperature = options.material.melting_to + 60;
    const auto body = dropped(options);
    ASSERT_TRUE(can_melt(*body));
    ASSERT_TRUE(body->melting);
    Simulation simulation = Simulation::create(body->world, {Actor{body->body}}, {}, kAllThreads).value();
    const auto liquid = [&] {
        const std::vector<float> parts = simulation.matter(0).liquid;
        return std::accumulate(parts.begin(), parts.end(), 0.0) / double(parts.size());
    };
    for (int frame = 0; frame < 15; ++frame) ASSERT_TRUE(simulation.advance(kAllThreads));
    EXPECT_LT(liquid(), 0.3);
    for (int frame = 15; frame < 60; ++frame) ASSERT_TRUE(simulation.advance(kAllThreads));
    EXPECT_GT(liquid(), 0.6);
    EXPECT_LE(liquid(), 1.0);

    // A torch twice as large has eight times the matter to melt; one that takes twice as long half the power.
    const Torch small = {.size = 0.6, .seconds = 0.5}, large = {.size = 1.2, .seconds = 0.5, .cools = true};
    const Torch slow = {.size = 0.6, .seconds = 1};
    const Vec3d top(0, 1, 0);
    EXPECT_NEAR(torch_radius(*body, large), 2 * torch_radius(*body, small), 1e-9);
    const double power = torch_at(*body, top, small).power.at(0);
    EXPECT_GT(power, 0);
    EXPECT_NEAR(torch_at(*body, top, large).power.at(0), -8 * power, 1e-6 * power);
    EXPECT_NEAR(torch_at(*body, top, slow).power.at(0), 0.5 * power, 1e-6 * power);
    EXPECT_NEAR(torch_radius(*body, {.size = 1e-6}) * body->scale, 4 * body->body->spacing(), 1e-9);

    EXPECT_FALSE(can_melt(*dropped(jelly())));
    EXPECT_FALSE(dropped(jelly())->melting);
}

TEST(DroppedBody, RefusesWhatHasNoVolumeInWords) {
    Model flat = *ball_model();
    for (Vec3f& p : flat.mesh.positions) p.setZero();
    const auto body =
        make_dropped_body(std::make_shared<const Model>(flat), nullptr, {}, jelly(), {}, kUp, kAllThreads);
    ASSERT_FALSE(body.ok());
    EXPECT_EQ(body.error().code, ErrorCode::unsuitable);
}

} // namespace
