#include "document.h"

#include <gtest/gtest.h>

namespace filigree::studio {
namespace {

State with_bend(const Document& document, double degrees) {
    State next = document.state();
    next.warps.bend = degrees;
    return next;
}

TEST(Document, UndoAndRedoBringBackTheSameState) {
    Document document;
    const State start = document.state();
    document.change("Bend", with_bend(document, 30));
    const State bent = document.state();
    EXPECT_FALSE(start == bent);
    document.undo_stack().undo();
    EXPECT_TRUE(document.state() == start);
    document.undo_stack().redo();
    EXPECT_TRUE(document.state() == bent);
    EXPECT_EQ(document.undo_stack().undoText(), "Bend");
}

TEST(Document, TellsOncePerStep) {
    Document document;
    int told = 0;
    double before_bend = -1;
    QObject::connect(&document, &Document::changed, &document, [&](const State& before) {
        ++told;
        before_bend = before.warps.bend;
    });
    document.change("Bend", with_bend(document, 30));
    EXPECT_EQ(told, 1);
    EXPECT_EQ(before_bend, 0);
    document.undo_stack().undo();
    EXPECT_EQ(told, 2);
    EXPECT_EQ(before_bend, 30);
    document.undo_stack().redo();
    EXPECT_EQ(told, 3);
}

TEST(Document, StepsWithOneKeyBecomeOneUntilTheDragEnds) {
    Document document;
    for (int k = 1; k <= 5; ++k) document.change("Bend", with_bend(document, k), "bend");
    EXPECT_EQ(document.undo_stack().count(), 1);
    document.end_merge();
    document.change("Bend", with_bend(document, 9), "bend");
    EXPECT_EQ(document.undo_stack().count(), 2);
    document.change("Twist", document.state(), "twist");
    EXPECT_EQ(document.undo_stack().count(), 3);
    document.change("Bend", with_bend(document, 10));
    document.change("Bend", with_bend(document, 11));
    EXPECT_EQ(document.undo_stack().count(), 5);
    for (int k = 0; k < 4; ++k) document.undo_stack().undo();
    EXPECT_EQ(document.state().warps.bend, 5);
    document.change("Bend", with_bend(document, 6), "bend"); // after an undo another step, whatever the key
    document.undo_stack().undo();
    EXPECT_EQ(document.state().warps.bend, 5);
    document.undo_stack().undo();
    EXPECT_EQ(document.state().warps.bend, 0);
}

TEST(Document, AKeyTakenEarlierIsNotCutOffByTheEndOfTheDrag) {
    Document document;
    document.change("Driver", with_bend(document, 1), "driver");
    const std::string key = document.merge_key("driver");
    document.end_merge();
    document.change("Driver", with_bend(document, 2), key); // came late from the background
    EXPECT_EQ(document.undo_stack().count(), 1);
    EXPECT_EQ(document.merge_key(""), "");
}

TEST(Document, ReplacingClearsTheHistoryAndCountsAsSaved) {
    Document document;
    document.change("Bend", with_bend(document, 30));
    EXPECT_TRUE(document.is_modified());
    document.replace(with_bend(document, 1));
    EXPECT_FALSE(document.is_modified());
    EXPECT_FALSE(document.undo_stack().canUndo());
    EXPECT_EQ(document.state().warps.bend, 1);
}

TEST(Document, SavedStatesAreKnownAgain) {
    Document document;
    document.change("Bend", with_bend(document, 30));
    const std::uint64_t id = document.state_id();
    document.set_saved();
    document.change("Bend", with_bend(document, 31), "bend");
    EXPECT_TRUE(document.is_modified());
    EXPECT_NE(document.state_id(), id);
    document.undo_stack().undo();
    EXPECT_FALSE(document.is_modified());
    EXPECT_EQ(document.state_id(), id);
}

TEST(Document, StatesThatDifferInOneSettingAreNotTheSame) {
    Document document;
    std::vector<State> all = {document.state()};
    const auto differs = [&](const auto& edit) {
        document.edit("Edit", edit);
        for (const State& earlier : all) EXPECT_FALSE(earlier == document.state());
        all.push_back(document.state());
    };
    differs([](State& s) { s.warps.taper = 0.5; });
    differs([](State& s) { s.restore.level = 3; });
    differs([](State& s) { s.strip.base = 100; });
    differs([](State& s) { s.body.material.viscosity = 3; });
    differs([](State& s) { s.body.obstacle = ObstacleChoice::slope; });
    differs([](State& s) { s.body.gravity = false; });
    differs([](State& s) { s.shape = Shape{}; });
    differs([](State& s) { s.handles.push_back({.vertices = {1}, .targets = {Vec3f::Zero()}, .pinned = true}); });
    differs([](State& s) { s.handle_pose = std::make_shared<const Pose>(); });
    differs([](State& s) { s.recording = std::make_shared<const Recording>(); });
    const int steps = document.undo_stack().count();
    document.edit("Nothing", [](State& s) { s.warps.taper = 0.5; });
    EXPECT_EQ(document.undo_stack().count(), steps);
}

TEST(Recording, FollowsWithoutCopyingWhatItHas) {
    PoseSequence poses{24, {{.positions = {Vec3f(1, 2, 3)}, .gradients = {}}}};
    Recording first;
    first.follow(poses);
    poses.frames.push_back({.positions = {Vec3f(4, 5, 6)}, .gradients = {}});
    Recording longer = first;
    longer.follow(poses);
    ASSERT_EQ(longer.frames.size(), 2u);
    EXPECT_EQ(longer.frames[0], first.frames[0]); // the same pose, not an equal one
    const PoseSequence copy = longer.poses();
    EXPECT_EQ(copy.frames_per_second, 24);
    EXPECT_TRUE(copy.frames[1].positions == poses.frames[1].positions);
}

} // namespace
} // namespace filigree::studio
