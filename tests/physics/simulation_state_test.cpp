// States saved and restored, threads, and what may run at the same time.
#include "filigree/core/random.h"
#include "filigree/physics/simulation.h"

#include "physics/simulation_scenes.h"
#include "physics/test_bodies.h"
#include "threads.h"

#include <array>
#include <cstring>
#include <thread>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace filigree {
namespace {

using namespace simulation_scenes;

class StateOfMaterial : public testing::TestWithParam<MaterialModel> {};
INSTANTIATE_TEST_SUITE_P(Simulation, StateOfMaterial, kModels, model_name);

TEST_P(StateOfMaterial, SameBytesForAnyThreadsAndAfterARestore) {
    Material plain = material(GetParam());
    if (GetParam() == MaterialModel::meshfree) plain.yield_stress = 2e3;
    const auto body = box(4, 4, 3, 0.15, plain);
    Actor falling = actor(body, {0, 0.05, 0});
    falling.spin = {1, 2, 3};
    const auto at_end = [&](unsigned threads) {
        Simulation one = simulation(with_ground(), {falling, actor(body, {0.2, 0.6, 0})},
                                    {.mode = StepMode::explicit_steps}, threads);
        run(one, 20, threads);
        return one.save();
    };
    const std::string bytes = at_end(1);
    EXPECT_TRUE(bytes == at_end(2));
    Simulation first =
        simulation(with_ground(), {falling, actor(body, {0.2, 0.6, 0})}, {.mode = StepMode::explicit_steps});
    run(first, 11);
    const std::string middle = first.save();
    Simulation second =
        simulation(with_ground(), {falling, actor(body, {0.2, 0.6, 0})}, {.mode = StepMode::explicit_steps});
    ASSERT_TRUE(second.restore(middle).ok());
    run(second, 9);
    EXPECT_TRUE(bytes == second.save());
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

TEST(SimulationState, RefusesStatesOfOtherOptionsAndWorlds) {
    const auto body = box(4, 4, 4, 0.1, material(MaterialModel::fem));
    const auto begin = [&](const World& world, const StepOptions& options) {
        return simulation(world, {actor(body, {0, 0.01, 0}), actor(body, {0.1, 0.5, 0})}, options);
    };
    Simulation saved = begin(with_ground(), {});
    run(saved, 12);
    const std::string bytes = saved.save();
    const auto refuses = [&](Simulation other, const char* what) {
        const std::string before = other.save();
        const Status refused = other.restore(bytes);
        ASSERT_FALSE(refused.ok()) << what;
        EXPECT_EQ(refused.error().code, ErrorCode::mismatch);
        EXPECT_NE(refused.error().message.find(what), std::string::npos) << refused.error().message;
        EXPECT_TRUE(other.save() == before);
        run(other, 3);
    };
    refuses(begin(with_ground(), {.contacts_within_bodies = false}), "options");
    refuses(begin(with_ground(), {.contacts_between_bodies = false}), "options");
    refuses(begin(with_ground(), {.automatic_rigid = false}), "options");
    refuses(begin(with_ground(), {.frames_per_second = 30}), "options");
    refuses(begin(free_space(), {}), "world");
    World slippery = with_ground();
    slippery.obstacles[0].friction = 0;
    refuses(begin(slippery, {}), "world");
    World held = with_ground();
    held.pins.push_back({.body = 0, .particles = {0}, .motion = {}});
    refuses(begin(held, {}), "world");
    refuses(simulation(with_ground(), {actor(body), actor(box(4, 4, 4, 0.1, material(MaterialModel::fem, 2e5)))}),
            "bodies");

    // What may be set while it runs is no part of it.
    World windless = with_ground();
    windless.hands.push_back({.body = 0, .target = {{}, {}, Vec3d(1, 1, 1)}});
    windless.air_heat_transfer = 10;
    Simulation same = begin(windless, {});
    EXPECT_TRUE(same.restore(bytes).ok());
}

/// Bytes with a checksum that is right for them.
std::string with_checksum(std::string bytes) {
    const std::size_t length = bytes.size() - sizeof(std::uint64_t);
    const std::uint64_t sum = XXH3_64bits(bytes.data(), length);
    std::memcpy(bytes.data() + length, &sum, sizeof sum);
    return bytes;
}

/// States that somebody made up are refused, or gone on from: nothing crashes.
TEST(SimulationState, HostileStatesDoNoHarm) {
    const std::vector<MaterialModel> models = {MaterialModel::fem, MaterialModel::meshfree, MaterialModel::rigid,
                                               MaterialModel::mpm, MaterialModel::springs};
    for (const MaterialModel model : models) {
        Material matter = material(model);
        if (model == MaterialModel::fem || model == MaterialModel::meshfree) matter.yield_stress = 2e3;
        const auto body = box(3, 3, 3, 0.1, matter);
        Simulation one = simulation(with_ground(), {actor(body, {0, 0.001, 0}), actor(body, {0.05, 0.302, 0.02})});
        one.attach(0, std::vector<Vec3f>{{0.1f, 0.2f, 0.1f}}, kOneThread);
        run(one, 12);
        const std::string bytes = one.save();
        constexpr std::size_t kFixed = 4 * sizeof(std::uint64_t); // the magic and what it was made for
        for (std::uint64_t attempt = 0; attempt < 80; ++attempt) {
            const auto roll = [&](std::uint64_t n) { return random_unit(attempt + 1, n); };
            std::string hostile = bytes;
            for (std::uint64_t change = 0; change < 1 + attempt % 5; ++change) {
                const std::size_t words = (bytes.size() - kFixed) / 4 - 2;
                const std::size_t at = kFixed + 4 * std::size_t(roll(3 * change) * double(words));
                constexpr std::array<std::uint32_t, 8> kWords = {0,          1,          0xffffffff, 0x7fc00000,
                                                                 0x7f800000, 0x7e967699, 0xfe967699, 0x00000007};
                std::uint32_t word = kWords[std::size_t(roll(3 * change + 1) * 8) % 8];
                if (roll(3 * change + 2) < 0.3) word = std::uint32_t(roll(3 * change + 1) * 4294967295.0);
                std::memcpy(hostile.data() + at, &word, sizeof word);
            }
            if (!one.restore(with_checksum(hostile)).ok()) continue;
            for (int frame = 0; frame < 2; ++frame) ASSERT_TRUE(one.advance(kOneThread).ok());
            for (std::size_t b = 0; b < 2; ++b)
                ASSERT_TRUE(all_finite(one.positions(b))) << int(model) << " " << attempt;
        }
        ASSERT_TRUE(one.restore(bytes).ok());
    }
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
