#include "filigree/scene/body_motion.h"

#include "scene/dropped_ball.h"
#include "threads.h"

#include <gtest/gtest.h>

using namespace filigree_test;

namespace {

float lowest(std::span<const Vec3f> positions) {
    float y = 1e9f;
    for (const Vec3f& p : positions) y = std::min(y, p.y());
    return y;
}

TEST(BodyMotion, FallsFreelyAndGoesBackToItsStart) {
    const auto body = dropped(jelly());
    BodyMotion motion = BodyMotion::create(body, kAllThreads).value();
    const Moment start = start_of(*body);
    EXPECT_EQ(motion.look({}).pose.positions.size(), start.pose.positions.size());
    for (int frame = 0; frame < 6; ++frame) ASSERT_TRUE(motion.advance(kAllThreads).ok());
    const Moment fallen = motion.look({.full = true});
    EXPECT_EQ(fallen.frame, 6u);
    const double time = 0.1; // in model units: the ball of 1 m is 2 units
    EXPECT_NEAR(lowest(start.pose.positions) - lowest(fallen.pose.positions), 2 * 0.5 * 9.81 * time * time, 5e-3);
    ASSERT_EQ(fallen.full.size(), body->model->mesh.vertex_count());
    EXPECT_NEAR(lowest(fallen.full), lowest(fallen.pose.positions), 0.05);
    EXPECT_EQ(fallen.particles.size(), body->body->particle_count());
    ASSERT_TRUE(motion.rewind(kAllThreads));
    EXPECT_EQ(motion.look({}).frame, 0u);
    ASSERT_TRUE(motion.advance(kAllThreads).ok());
    EXPECT_LT(lowest(start.pose.positions) - lowest(motion.look({}).pose.positions), 0.02f);
}

TEST(BodyMotion, FollowsAHandAndIsFreeAfterARewind) {
    DropOptions options = jelly();
    options.gravity = false;
    const auto body = dropped(options);
    BodyMotion motion = BodyMotion::create(body, kAllThreads).value();
    Hand hand;
    hand.point = float(body->scale) * body->model->mesh.positions[0];
    hand.target.constant = hand.point.cast<double>() + Vec3d(0, 1, 0);
    ASSERT_TRUE(motion.set_hands({hand}, kAllThreads));
    for (int frame = 0; frame < 10; ++frame) ASSERT_TRUE(motion.advance(kAllThreads).ok());
    const float rest = lowest(start_of(*body).pose.positions);
    EXPECT_GT(lowest(motion.look({}).pose.positions), rest + 0.05f);
    ASSERT_TRUE(motion.rewind(kAllThreads));
    for (int frame = 0; frame < 10; ++frame) ASSERT_TRUE(motion.advance(kAllThreads).ok());
    EXPECT_NEAR(lowest(motion.look({}).pose.positions), rest, 0.01f);
}

} // namespace
