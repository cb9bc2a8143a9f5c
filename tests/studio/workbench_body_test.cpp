// Bodies: playing, recording, pulling, and what cannot be one.
#include "workbench_fixture.h"

#include "studio/materials.h"

#include "filigree/io/system/file.h"

#include <QSignalSpy>
#include <QTest>

#include <algorithm>

namespace filigree::studio {
namespace {

TEST_F(WorkbenchTest, PlayingMakesTheBodyAndPausingRecordsIt) {
    make_small_shape();
    const State start = state();
    QSignalSpy mode(&bench, &Workbench::mode_changed);
    bench.play(); // makes it first
    EXPECT_TRUE(QTest::qWaitFor([&] { return bench.is_playing(); }));
    EXPECT_EQ(bench.mode(), Mode::body);
    EXPECT_EQ(mode.count(), 1);
    bench.playback().wait_for_frames(5);
    bench.pause();
    EXPECT_FALSE(bench.is_playing());
    ASSERT_TRUE(state().recording);
    const std::size_t count = state().recording->frames.size();
    EXPECT_GE(count, 6u);
    EXPECT_EQ(bench.frame_count(), count);
    EXPECT_EQ(bench.frame(), count - 1);
    EXPECT_EQ(undo_stack().undoText(), QString("Simulate %1 frames").arg(count - 1));
    EXPECT_TRUE(bench.pose()->positions == state().recording->frames.back()->positions);
    bench.set_mode(Mode::deform);
    EXPECT_EQ(bench.pose(), nullptr);
    bench.set_mode(Mode::body);
    EXPECT_NE(bench.pose(), nullptr);
    const State recorded = state();
    undo_stack().undo();
    EXPECT_TRUE(state() == start);
    EXPECT_EQ(bench.frame_count(), 0u);
    EXPECT_EQ(bench.mode(), Mode::deform);
    undo_stack().redo();
    EXPECT_TRUE(state() == recorded);
    EXPECT_EQ(bench.frame_count(), count);
}

TEST_F(WorkbenchTest, PlayingFromAnEarlierFrameReplaysThenGoesOn) {
    make_small_shape();
    simulate(5);
    const std::size_t count = bench.frame_count();
    bench.go_to_frame(1);
    EXPECT_EQ(bench.frame(), 1u);
    EXPECT_TRUE(bench.pose()->positions == state().recording->frames[1]->positions);
    bench.play();
    EXPECT_TRUE(bench.is_playing());
    EXPECT_EQ(bench.frame_count(), count); // still replaying
    EXPECT_TRUE(QTest::qWaitFor([&] { return bench.frame_count() > count + 2; }));
    bench.pause();
    EXPECT_EQ(bench.frame(), bench.frame_count() - 1);
    bench.go_to_frame(9999);
    EXPECT_EQ(bench.frame(), bench.frame_count() - 1);
}

TEST_F(WorkbenchTest, StepsAndResets) {
    make_small_shape();
    bench.step();
    bench.wait_until_idle();
    bench.playback().wait_for_frames(0);
    bench.step();
    bench.playback().wait_for_frames(0);
    EXPECT_EQ(bench.frame_count(), 3u);
    EXPECT_EQ(undo_stack().count(), 1);
    bench.reset();
    EXPECT_EQ(bench.frame(), 0u);
    EXPECT_EQ(bench.frame_count(), 1u);
    EXPECT_EQ(state().recording, nullptr);
    EXPECT_EQ(undo_stack().undoText(), "Reset the body");
    undo_stack().undo();
    EXPECT_EQ(bench.frame_count(), 3u);
}

TEST_F(WorkbenchTest, AStepSharesTheFramesBeforeIt) {
    make_small_shape();
    simulate(3);
    const auto before = state().recording;
    bench.step();
    bench.playback().wait_for_frames(0);
    bench.play();
    bench.playback().wait_for_frames(2);
    bench.pause();
    const auto after = state().recording;
    ASSERT_GT(after->frames.size(), before->frames.size() + 1);
    EXPECT_TRUE(std::equal(before->frames.begin(), before->frames.end(), after->frames.begin()))
        << "the poses themselves, not copies of them";
}

TEST_F(WorkbenchTest, BodySettingsMakeTheBodyAgain) {
    make_small_shape();
    simulate(3);
    BodySettings body = state().body;
    body.preset = "jelly";
    body.material = material_named("jelly");
    bench.set_body(body);
    bench.wait_until_idle();
    EXPECT_EQ(undo_stack().undoText(), "Material: jelly");
    ASSERT_TRUE(bench.playback().has_body());
    EXPECT_EQ(bench.playback().made()->body->material.young_modulus, body.material.young_modulus);
    EXPECT_EQ(bench.frame_count(), 1u);
    undo_stack().undo();
    EXPECT_EQ(bench.frame_count(), state().recording->frames.size());
    EXPECT_FALSE(bench.playback().has_body());
}

TEST_F(WorkbenchTest, ADriverTooCoarseForTheBodyIsToldAndFitted) {
    make_small_shape();
    bench.set_strip({.base = 20});
    bench.wait_until_idle();
    EXPECT_EQ(bench.body_warning(), "") << "there is no body";
    notes.clear();
    bench.make_body();
    bench.wait_until_idle();
    const std::string warning = bench.body_warning().toStdString();
    EXPECT_NE(warning.find("a driver of about"), std::string::npos) << warning;
    EXPECT_EQ(warning.find("max_edge"), std::string::npos) << "that is for the command line: " << warning;
    EXPECT_EQ(notes, std::vector{warning});
    EXPECT_EQ(offers.back(), "body.fit_driver");

    QSignalSpy withdrawn(&bench, &Workbench::withdrawn);
    bench.fit_driver();
    bench.wait_until_idle();
    ASSERT_EQ(withdrawn.count(), 1);
    EXPECT_EQ(withdrawn[0][0].toString().toStdString(), warning) << "it is not so any more";
    EXPECT_TRUE(bench.playback().has_body());
    EXPECT_EQ(bench.mode(), Mode::body);
    EXPECT_EQ(bench.body_warning(), "");
    EXPECT_GT(state().model->driver().vertices.size(), 20u);
    bench.fit_driver();
    bench.set_strip({.base = 20}); // takes its place: no body was asked for with this driver
    bench.wait_until_idle();
    EXPECT_FALSE(bench.playback().has_body());
    EXPECT_TRUE(errors.empty());
}

TEST_F(WorkbenchTest, WhatCannotBeABodyIsTold) {
    ASSERT_TRUE(write_file(path("point.obj"), "v 1 2 3\n").ok());
    bench.open(path("point.obj"));
    bench.wait_until_idle();
    EXPECT_EQ(state().model->mesh.vertex_count(), 1u);
    bench.play();
    bench.wait_until_idle();
    EXPECT_EQ(errors.size(), 1u);
    EXPECT_FALSE(bench.is_playing());
    EXPECT_EQ(bench.mode(), Mode::deform);
}

TEST_F(WorkbenchTest, TheMousePullsTheBody) {
    make_small_shape();
    BodySettings body = state().body;
    body.gravity = body.ground = false;
    bench.set_body(body);
    bench.make_body();
    bench.wait_until_idle();
    pull_top({0, 1, 0});
    EXPECT_TRUE(bench.is_pulling());
    EXPECT_TRUE(bench.is_playing());
    bench.playback().wait_for_frames(10);
    bench.end_pull();
    EXPECT_FALSE(bench.playback().is_grabbed());
    bench.pause();
    float highest = -1;
    for (const Vec3f& p : bench.pose()->positions) highest = std::max(highest, p.y());
    EXPECT_GT(highest, 0.6f);
}

TEST_F(WorkbenchTest, TheErrorOfABodyIsMeasuredAgainstItsOwnVertices) {
    make_small_shape();
    simulate(8);
    bench.measure_error();
    bench.wait_until_idle();
    ASSERT_TRUE(bench.error());
    EXPECT_LT(bench.error()->rms, 0.02);
    bench.go_to_frame(1);
    bench.measure_error();
    bench.wait_until_idle();
    EXPECT_FALSE(bench.error());
    EXPECT_FALSE(notes.empty());
}

TEST_F(WorkbenchTest, AnimateSquashesTheCubeAndItBounces) {
    make_small_shape();
    bench.animate();
    EXPECT_TRUE(QTest::qWaitFor([&] { return bench.is_playing(); }));
    bench.pause();
    for (int k = 0; k < 75; ++k) bench.step(); // as fast as it goes
    bench.playback().wait_for_frames(0);
    ASSERT_GE(bench.frame_count(), 75u);
    std::vector<float> bottoms, heights;
    for (const auto& pose : state().recording->frames) {
        const Box box = bounds(pose->positions);
        bottoms.push_back(float(box.min.y()));
        heights.push_back(float(box.size().y()));
    }
    const auto touch = std::min_element(bottoms.begin(), bottoms.end());
    const float rest = heights[0], squashed = *std::min_element(heights.begin(), heights.end());
    EXPECT_LT(squashed, 0.85f * rest);
    EXPECT_GT(squashed, 0.5f * rest);
    EXPECT_NEAR(*touch, bottoms[0] - 0.54f, 0.1f); // half its size below, and the skin of so few soft particles lower
    EXPECT_GT(*std::max_element(touch, bottoms.end()), *touch + 0.15f);
    EXPECT_EQ(bench.playback().made()->world.obstacles.size(), 1u);
}

TEST_F(WorkbenchTest, WantingEveryVertexDoesNotMoveTheTimeline) {
    make_small_shape();
    simulate(4);
    bench.go_to_frame(1);
    QSignalSpy moved(&bench.playback(), &Playback::moved);
    bench.want_full(true);
    EXPECT_TRUE(QTest::qWaitFor([&] { return moved.count() > 0; }));
    EXPECT_EQ(bench.frame(), 1u);
    EXPECT_TRUE(bench.pose()->positions == state().recording->frames[1]->positions);
}

TEST_F(WorkbenchTest, ABodyThatNoLongerFitsIsNotTaken) {
    make_small_shape();
    BodySettings body = state().body;
    body.size = 2;
    bench.set_body(body);
    bench.make_body();
    undo_stack().undo();
    bench.wait_until_idle();
    EXPECT_FALSE(bench.playback().has_body());
    EXPECT_EQ(notes.size(), 1u);
}

TEST_F(WorkbenchTest, PlayAndPauseAgainAreOneStep) {
    make_small_shape();
    simulate(2);
    bench.play();
    bench.playback().wait_for_frames(2);
    bench.pause();
    EXPECT_EQ(undo_stack().count(), 1);
    EXPECT_EQ(undo_stack().undoText(), QString("Simulate %1 frames").arg(bench.frame_count() - 1));
    EXPECT_EQ(state().recording->frames.size(), bench.frame_count());
}

TEST_F(WorkbenchTest, WhatABodyDoesNotTakeIsTold) {
    make_small_shape();
    bend(30);
    bench.make_body();
    bench.wait_until_idle();
    ASSERT_EQ(notes.size(), 2u);
    EXPECT_NE(notes[0].find("cannot follow the particles"), std::string::npos) << notes[0]; // the driver is coarse
    EXPECT_EQ(notes[1], "A body is made of the shape at rest, without its deformation.");
    bench.pin(std::vector<Index>{3});
    ASSERT_EQ(notes.size(), 3u);
    EXPECT_EQ(notes[2], "New pins hold the body once it is made again.");
    EXPECT_EQ(offers, (std::vector<std::string>{"body.fit_driver", "", "body.make"}));
}

} // namespace
} // namespace filigree::studio
