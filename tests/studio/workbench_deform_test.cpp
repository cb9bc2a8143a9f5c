// Warps, pulls, pins, and how far off they are.
#include "workbench_fixture.h"

#include <QTest>

#include <algorithm>

namespace filigree::studio {
namespace {

TEST_F(WorkbenchTest, WarpsMoveTheDriverAndAreNamed) {
    Warps warps;
    for (int k = 1; k <= 5; ++k) {
        warps.bend = 10 * k;
        bench.set_warps(warps, "bend");
    }
    bench.document().end_merge();
    EXPECT_EQ(undo_stack().count(), 1);
    EXPECT_EQ(undo_stack().undoText(), "Bend");
    ASSERT_NE(bench.pose(), nullptr);
    EXPECT_EQ(bench.pose()->gradients.size(), bench.pose()->positions.size());
    warps.stretch = -1; // no factor
    warps.twist = std::nan("");
    bench.set_warps(warps);
    EXPECT_EQ(state().warps.stretch, 1);
    EXPECT_EQ(state().warps.twist, 0);
    bench.reset_deformation();
    EXPECT_EQ(bench.pose(), nullptr);
    undo_stack().undo();
    EXPECT_NE(bench.pose(), nullptr);
}

TEST_F(WorkbenchTest, APullIsAStepThatUndoTakesBackExactly) {
    const State start = state();
    pull_top({0, 0.3, 0});
    EXPECT_TRUE(bench.is_pulling());
    EXPECT_TRUE(QTest::qWaitFor([&] { return bench.pose() != nullptr; })); // shown live
    EXPECT_EQ(undo_stack().count(), 0);
    bench.end_pull();
    EXPECT_FALSE(bench.is_pulling());
    EXPECT_EQ(undo_stack().undoText(), "Pull");
    const State once = state();
    const std::vector<Vec3f> shape = bench.pose()->positions;
    pull_top({0.2, 0, 0});
    bench.end_pull();
    undo_stack().undo();
    EXPECT_TRUE(state() == once);
    EXPECT_TRUE(bench.pose()->positions == shape);
    undo_stack().undo();
    EXPECT_TRUE(state() == start);
    EXPECT_EQ(bench.pose(), nullptr);
    undo_stack().redo();
    EXPECT_TRUE(state() == once);
}

TEST_F(WorkbenchTest, APullFollowsTheMouseThroughTheWarp) {
    Warps warps{.axis = Axis::y, .stretch = 1.4, .bend = 50};
    bench.set_warps(warps);
    const State before = state();
    const std::vector<Vec3f> full = full_deformation(before, RunContext()).value();
    const Index driver_vertex = 7, vertex = before.model->driver().vertices[driver_vertex];
    const Vec3d at = full[vertex].cast<double>(), target = at + Vec3d(0.1, 0.15, -0.05);
    bench.begin_pull(vertex, at);
    bench.pull_to(target);
    bench.end_pull();
    EXPECT_LT((bench.pose()->positions[driver_vertex].cast<double>() - target).norm(), 1e-3);
}

TEST_F(WorkbenchTest, AnUndoInTheMiddleOfAPullEndsIt) {
    bend(20);
    pull_top({0, 0.3, 0});
    undo_stack().undo();
    EXPECT_FALSE(bench.is_pulling());
    EXPECT_EQ(bench.pose(), nullptr);
    bench.pull_to({9, 9, 9});
    bench.end_pull();
    EXPECT_EQ(undo_stack().index(), 0);
}

TEST_F(WorkbenchTest, PinsStayPut) {
    const std::vector<Index> pins = {3, 1, 2, 2};
    bench.pin(pins);
    EXPECT_EQ(undo_stack().undoText(), "Pin 3 vertices");
    EXPECT_EQ(bench.pose(), nullptr);
    bench.pin(pins); // already
    EXPECT_EQ(undo_stack().count(), 1);
    const std::vector<Vec3f> rest = driver_positions(*state().model);
    const Index near = state().model->driver().vertices[5];
    bench.begin_pull(near, state().model->mesh.world_position(near));
    bench.pull_to(state().model->mesh.world_position(near) + Vec3d(0.3, 0.3, 0.3));
    bench.end_pull();
    for (const Index v : {1, 2, 3}) EXPECT_LT((bench.pose()->positions[v] - rest[v]).norm(), 1e-6f);
    const std::vector<Index> two = {1, 3};
    bench.unpin(two);
    EXPECT_EQ(undo_stack().undoText(), "Unpin 2 vertices");
    bench.unpin_all();
    EXPECT_EQ(undo_stack().undoText(), "Unpin 1 vertex");
    EXPECT_EQ(state().handles.size(), 1u); // the pull
    const std::vector<Index> beyond = {kNoIndex};
    bench.pin(beyond);
    EXPECT_EQ(undo_stack().undoText(), "Unpin 1 vertex");
}

TEST_F(WorkbenchTest, TheErrorIsThatOfThePoseShown) {
    bench.measure_error();
    bench.wait_until_idle();
    ASSERT_TRUE(bench.error());
    EXPECT_LT(bench.error()->max, 1e-6); // at rest there is none
    Warps warps;
    warps.twist = 60;
    bench.set_warps(warps);
    EXPECT_FALSE(bench.error()); // of another pose
    bench.measure_error();
    bench.wait_until_idle();
    ASSERT_TRUE(bench.error());
    EXPECT_GT(bench.error()->rms, 1e-6);
    EXPECT_LT(bench.error()->rms, 0.01);
    EXPECT_EQ(bench.error()->per_vertex.size(), state().model->mesh.vertex_count());
    bench.set_level(1);
    bench.measure_error();
    bench.wait_until_idle();
    EXPECT_EQ(bench.error()->per_vertex.size(), state().model->levels[1].vertices.size());
    bench.measure_error();
    warps.twist = 70;
    bench.set_warps(warps); // while it is measured
    bench.wait_until_idle();
    EXPECT_FALSE(bench.error());
}

TEST_F(WorkbenchTest, EveryVertexFollowsWhenWanted) {
    EXPECT_TRUE(bench.full().empty());
    bench.want_full(true);
    bench.wait_until_idle();
    EXPECT_EQ(bench.full().size(), state().model->mesh.vertex_count());
    Warps warps;
    for (int k = 1; k < 5; ++k) {
        warps.bend = 10 * k;
        bench.set_warps(warps);
    }
    bench.wait_until_idle();
    const std::vector<Vec3f> expected = full_deformation(state(), RunContext()).value();
    EXPECT_TRUE(std::equal(expected.begin(), expected.end(), bench.full().begin(), bench.full().end()));
    bench.want_full(false);
    EXPECT_TRUE(bench.full().empty());
}

TEST_F(WorkbenchTest, ACancelledPullLeavesTheHistoryAlone) {
    bend(20);
    undo_stack().undo();
    const State before = state();
    pull_top(Vec3d(0, 0.3, 0));
    bench.wait_until_idle(); // until it has arrived
    ASSERT_NE(bench.pose(), nullptr);
    bench.cancel_pull();
    EXPECT_FALSE(bench.is_pulling());
    EXPECT_EQ(bench.pose(), nullptr);
    EXPECT_TRUE(state() == before);
    EXPECT_EQ(undo_stack().redoText(), "Bend");
}

} // namespace
} // namespace filigree::studio
