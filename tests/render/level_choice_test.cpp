#include "filigree/render/level_choice.h"

#include <algorithm>
#include <array>
#include <vector>

#include <gtest/gtest.h>

using namespace filigree;

namespace {

/// Four levels; each has a quarter of the triangles of the next, and is four times as far off.
const std::array<LevelFacts, 4> kLevels = {{
    {.triangles = 10'000, .vertices = 5'000, .deviation = 0.16},
    {.triangles = 40'000, .vertices = 20'000, .deviation = 0.04},
    {.triangles = 160'000, .vertices = 80'000, .deviation = 0.01},
    {.triangles = 640'000, .vertices = 320'000, .deviation = 0.0},
}};

TEST(LevelBySize, IsTheCoarsestWhoseErrorIsNotSeen) {
    EXPECT_EQ(level_by_size(kLevels, 3, 3, 1.0), 0u);
    EXPECT_EQ(level_by_size(kLevels, 3, 3, 10.0), 1u);
    EXPECT_EQ(level_by_size(kLevels, 3, 3, 50.0), 2u);
    EXPECT_EQ(level_by_size(kLevels, 3, 3, 1e6), 3u);
}

TEST(LevelBySize, NeverGoesBeyondTheDocumentsLevel) {
    EXPECT_EQ(level_by_size(kLevels, 1, 1, 1e6), 1u);
    EXPECT_EQ(level_by_size(kLevels, 0, 0, 1e6), 0u);
    EXPECT_EQ(level_by_size(kLevels, 1, 3, 1e6), 1u) << "the level drawn is not there any more";
}

TEST(LevelBySize, LevelsThatAreNotMeasuredAreNotChosen) {
    std::vector<LevelFacts> levels(kLevels.begin(), kLevels.end());
    levels[0].deviation.reset();
    EXPECT_EQ(level_by_size(levels, 3, 3, 1.0), 1u);
    for (LevelFacts& level : levels) level.deviation.reset();
    EXPECT_EQ(level_by_size(levels, 3, 3, 1.0), 3u);
}

TEST(LevelBySize, FallsAndRisesWithTheDistance) {
    unsigned now = 3;
    std::vector<unsigned> away, near;
    for (double pixels = 200; pixels > 1; pixels *= 0.9) away.push_back(now = level_by_size(kLevels, 3, now, pixels));
    EXPECT_TRUE(std::is_sorted(away.rbegin(), away.rend()));
    EXPECT_EQ(away.front(), 3u);
    EXPECT_EQ(away.back(), 0u);
    for (double pixels = 1; pixels < 400; pixels *= 1.1) near.push_back(now = level_by_size(kLevels, 3, now, pixels));
    EXPECT_TRUE(std::is_sorted(near.begin(), near.end()));
    EXPECT_EQ(near.back(), 3u);
}

TEST(LevelBySize, TremblingChangesNothing) {
    for (const double pixels : {5.0, 20.0, 80.0}) { // where one level's error is just not seen
        unsigned now = level_by_size(kLevels, 3, 3, pixels);
        for (int i = 0; i < 20; ++i) {
            const unsigned before = now;
            now = level_by_size(kLevels, 3, now, pixels * (i % 2 ? 0.97 : 1.03));
            if (i > 0) {
                EXPECT_EQ(now, before) << pixels;
            }
        }
    }
}

TEST(LevelToKeepUp, IsTheFinestThatFits) {
    DrawingCost cost;
    EXPECT_EQ(level_to_keep_up(kLevels, 3, 3, cost, false, 30), 3u) << "nothing is known yet";
    for (int i = 0; i < 10; ++i) cost.learn_drawing(200, 640'000);
    EXPECT_LT(level_to_keep_up(kLevels, 3, 3, cost, false, 30), 3u);
    EXPECT_GT(level_to_keep_up(kLevels, 3, 3, cost, false, 80), 0u);
    EXPECT_EQ(level_to_keep_up(kLevels, 3, 3, cost, false, 300), 3u);
    EXPECT_EQ(level_to_keep_up(kLevels, 1, 1, cost, false, 300), 1u);
    EXPECT_EQ(level_to_keep_up(kLevels, 3, 3, cost, false, 1e-3), 0u) << "something must be drawn";
}

TEST(LevelToKeepUp, RestoringCountsWhileThePoseChanges) {
    DrawingCost cost;
    cost.learn_drawing(25, 640'000);
    cost.learn_restoring(60, 320'000);
    EXPECT_EQ(level_to_keep_up(kLevels, 3, 3, cost, false, 30), 3u);
    EXPECT_LT(level_to_keep_up(kLevels, 3, 3, cost, true, 30), 3u);
}

TEST(LevelToKeepUp, StaysWhileItNearlyFits) {
    DrawingCost cost;
    cost.learn_drawing(40, 640'000);
    EXPECT_EQ(level_to_keep_up(kLevels, 3, 3, cost, false, 30), 3u);
    EXPECT_EQ(level_to_keep_up(kLevels, 3, 2, cost, false, 30), 2u);
}

TEST(LevelChange, MeltsFromOneToTheOther) {
    LevelChange change;
    change.set(3);
    EXPECT_FALSE(change.from());
    change.start(3, 0.0);
    EXPECT_FALSE(change.advance(0.1)) << "already there";
    change.start(2, 1.0);
    double last = -1;
    for (double t = 1.0; t < 1.0 + LevelChange::kSeconds; t += 0.05) {
        EXPECT_TRUE(change.advance(t));
        EXPECT_EQ(change.from(), 3u);
        EXPECT_GT(change.part(), last);
        EXPECT_LT(change.part() - last, 0.2 + (last < 0)) << "steps too large to be called melting";
        last = change.part();
    }
    EXPECT_FALSE(change.advance(1.01 + LevelChange::kSeconds));
    EXPECT_FALSE(change.from());
    EXPECT_EQ(change.to(), 2u);
    EXPECT_EQ(change.part(), 1.0);
}

TEST(LevelChange, MeltsWhereAPictureTakesLongerThanTheChangeToo) {
    LevelChange change;
    change.set(3);
    change.start(2, 0.0);
    EXPECT_TRUE(change.advance(10));
    EXPECT_EQ(change.part(), LevelChange::kMostStep);
    EXPECT_FALSE(change.advance(20));
}

TEST(LevelChange, TurnsBackWhereItIs) {
    LevelChange change;
    change.set(3);
    change.start(2, 0.0);
    change.advance(0.25 * LevelChange::kSeconds);
    change.start(3, 0.25 * LevelChange::kSeconds);
    EXPECT_EQ(change.from(), 2u);
    EXPECT_NEAR(change.part(), 0.75, 1e-9);
    EXPECT_FALSE(change.advance(0.6 * LevelChange::kSeconds));
    EXPECT_EQ(change.to(), 3u);
}

} // namespace
