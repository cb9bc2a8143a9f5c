// States saved and restored, threads, and what may run at the same time.
#include "filigree/physics/simulation.h"

#include "physics/simulation_scenes.h"
#include "physics/test_bodies.h"
#include "threads.h"

#include <thread>

namespace filigree {
namespace {

using namespace simulation_scenes;

class StateOfMaterial : public testing::TestWithParam<MaterialModel> {};
INSTANTIATE_TEST_SUITE_P(Simulation, StateOfMaterial, kModels, model_name);

TEST_P(StateOfMaterial, DescentIsTheSameForAnyThreads) {
    const auto body = box(12, 12, 12, 0.08, material(GetParam(), 1e7));
    const auto at_end = [&](unsigned threads) {
        World world = with_ground();
        Hand hand;
        hand.point = {0.96f, 0.48f, 0.48f};
        hand.target.constant = Vec3d(1.2, 0.6, 0.5);
        world.hands.push_back(hand);
        Simulation held = simulation(world, {actor(body)}, {.mode = StepMode::descent}, threads);
        run(held, 4, threads);
        return held.save();
    };
    const std::string bytes = at_end(1);
    for (int attempt = 0; attempt < 3; ++attempt) EXPECT_TRUE(bytes == at_end(2));
}

TEST_P(StateOfMaterial, SameBytesForAnyThreadsAndAfterARestore) {
    for (const StepMode mode : {StepMode::explicit_steps, StepMode::descent}) {
        Material plain = material(GetParam());
        if (GetParam() == MaterialModel::meshfree) plain.yield_stress = 2e3;
        const auto body = box(4, 4, 3, 0.15, plain);
        Actor falling = actor(body, {0, 0.05, 0});
        falling.spin = {1, 2, 3};
        const auto at_end = [&](unsigned threads) {
            Simulation one = simulation(with_ground(), {falling, actor(body, {0.2, 0.6, 0})}, {.mode = mode}, threads);
            run(one, 20, threads);
            return one.save();
        };
        const std::string bytes = at_end(1);
        EXPECT_TRUE(bytes == at_end(2)) << int(mode);
        Simulation first = simulation(with_ground(), {falling, actor(body, {0.2, 0.6, 0})}, {.mode = mode});
        run(first, 11);
        const std::string middle = first.save();
        Simulation second = simulation(with_ground(), {falling, actor(body, {0.2, 0.6, 0})}, {.mode = mode});
        ASSERT_TRUE(second.restore(middle).ok());
        run(second, 9);
        EXPECT_TRUE(bytes == second.save()) << int(mode);
    }
}

TEST(SimulationState, RefusesStatesThatAreDamagedOrOfOthers) {
    Simulation one = simulation(with_ground(), {actor(box(3, 3, 3, 0.1, material(MaterialModel::fem)))});
    run(one, 3);
    const std::string bytes = one.save();
    for (std::size_t length = 0; length < bytes.size(); length += 7)
        EXPECT_FALSE(one.restore(std::string_view(bytes).substr(0, length)).ok());
    for (std::size_t at = 0; at < bytes.size(); at += 97) {
        std::string flipped = bytes;
        flipped[at] = char(flipped[at] ^ 0x40);
        EXPECT_FALSE(one.restore(flipped).ok()) << at;
    }
    EXPECT_TRUE(one.restore(bytes).ok());
    Simulation other = simulation(with_ground(), {actor(box(3, 3, 2, 0.1, material(MaterialModel::fem)))});
    const Status refused = other.restore(bytes);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::mismatch);
}

TEST(SimulationState, DriversOfFlowedMatterGoOnTheSame) {
    Material clay = material(MaterialModel::meshfree, 2e5);
    clay.yield_stress = 2e3;
    const auto body = box(6, 6, 6, 0.1, clay);
    Actor thrown = actor(body, {0, 0.05, 0});
    thrown.velocity = {0, -4, 0};
    std::vector<Vec3f> driver;
    for (float x = -0.05f; x <= 0.66f; x += 0.1f)
        for (float y = -0.05f; y <= 0.66f; y += 0.1f) driver.emplace_back(x, y, 0.33f);
    const auto after = [&](Simulation& clays, int frames) {
        run(clays, frames);
        std::vector<Vec3f> points(driver.size());
        std::vector<Mat3f> gradients(driver.size());
        clays.attached(0, points, gradients, kOneThread);
        return std::pair(points, gradients);
    };
    const auto begin = [&] {
        Simulation clays = simulation(with_ground(), {thrown});
        clays.attach(0, driver, kOneThread);
        return clays;
    };
    Simulation whole = begin(), resumed = begin();
    after(whole, 12);
    const std::string middle = whole.save();
    ASSERT_TRUE(resumed.restore(middle).ok());
    const auto at_end = after(whole, 8);
    EXPECT_TRUE(at_end == after(resumed, 8));
    ASSERT_TRUE(whole.restore(middle).ok());
    EXPECT_TRUE(at_end == after(whole, 8));
}

TEST(SimulationState, CancelLeavesTheFrameUndone) {
    const RunContext context(1);
    Simulation one = simulation(with_ground(), {actor(box(3, 3, 3, 0.1, material(MaterialModel::fem)), {0, 0.5, 0})});
    run(one, 5);
    const std::string before = one.save();
    context.cancel();
    const Result<FrameReport> report = one.advance(context);
    ASSERT_FALSE(report.ok());
    EXPECT_EQ(report.error().code, ErrorCode::cancelled);
    EXPECT_TRUE(before == one.save());
}

TEST_P(StateOfMaterial, ConstFunctionsMayRunAtTheSameTime) {
    const auto body = box(8, 8, 8, 0.1, material(GetParam()));
    Simulation one = simulation(with_ground(), {actor(body, {0, 0.02, 0})});
    const std::size_t attachment = one.attach(0, std::vector<Vec3f>(50, Vec3f(0.3f, 0.3f, 0.3f)), RunContext(1));
    run(one, 5);
    const Simulation& still = one;
    const auto look = [&] {
        std::vector<Vec3f> points(50);
        still.attached(attachment, points, {}, RunContext(1));
        return std::pair(still.energy(RunContext(1)).elastic, points);
    };
    const auto expected = look();
    std::vector<std::thread> threads;
    std::array<int, 4> wrong = {};
    for (int& count : wrong)
        threads.emplace_back([&count, &look, &expected] {
            for (int k = 0; k < 50; ++k) count += look() != expected;
        });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(wrong, (std::array<int, 4>{}));
}

} // namespace
} // namespace filigree
