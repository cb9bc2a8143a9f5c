// The shape, its levels, and what is stripped.
#include "studio/materials.h"
#include "workbench_fixture.h"

#include "filigree/file.h"
#include "filigree/mesh.h"

#include <QSignalSpy>

#include <algorithm>

namespace filigree::studio {
namespace {

TEST_F(WorkbenchTest, StartsWithTheWavyCube) {
    EXPECT_EQ(state().shape, Shape{});
    EXPECT_EQ(state().model->mesh.vertex_count(), 6u * 64 * 64 + 2);
    EXPECT_EQ(state().level(), state().model->finest_level());
    EXPECT_EQ(state().source->name, "Wavy cube");
    EXPECT_FALSE(bench.document().is_modified());
    EXPECT_EQ(bench.mode(), Mode::deform);
    EXPECT_EQ(bench.pose(), nullptr);
    EXPECT_EQ(bench.frame_count(), 0u);
    EXPECT_EQ(state().body.material.young_modulus, material_named("soft-rubber").young_modulus);
}

TEST_F(WorkbenchTest, FrequencyIsASliderThatIsOneStep) {
    const State start = state();
    Shape shape = *state().shape;
    shape.options.resolution = 16;
    bench.make_shape(shape);
    bench.wait_until_idle();
    bend(40);
    for (int k = 6; k < 10; ++k) {
        shape.options.frequency = k;
        bench.make_shape(shape, "frequency");
        if (k % 2) bench.wait_until_idle();
    }
    bench.document().end_merge();
    bench.wait_until_idle();
    EXPECT_EQ(state().shape->options.frequency, 9);
    EXPECT_EQ(state().warps.bend, 40); // stays
    EXPECT_NE(bench.pose(), nullptr);
    EXPECT_EQ(undo_stack().count(), 3);
    EXPECT_EQ(undo_stack().undoText(), "Frequency 9");
    EXPECT_EQ(opened, 0); // the same shape, nothing to look at anew
    shape.name = "torus";
    bench.make_shape(shape);
    bench.wait_until_idle();
    EXPECT_EQ(opened, 1);
    EXPECT_EQ(state().source->name, "Torus");
    while (undo_stack().canUndo()) undo_stack().undo();
    EXPECT_TRUE(state() == start);
}

TEST_F(WorkbenchTest, LevelsGoOneByOne) {
    const unsigned finest = state().model->finest_level();
    ASSERT_GT(finest, 1u);
    bench.add_detail(); // there is no more
    EXPECT_EQ(undo_stack().count(), 0);
    bench.remove_detail();
    EXPECT_EQ(state().level(), finest - 1);
    EXPECT_EQ(undo_stack().undoText(), "Remove detail");
    for (unsigned k = 0; k < 20; ++k) bench.remove_detail();
    EXPECT_EQ(state().level(), 0u);
    bench.add_detail();
    EXPECT_EQ(state().level(), 1u);
    bench.set_level(99);
    EXPECT_EQ(state().level(), finest);
}

TEST_F(WorkbenchTest, StrippingAgainKeepsWarpsAndDropsWhatBelongsToTheDriver) {
    Warps warps;
    warps.twist = 30;
    bench.set_warps(warps);
    pull_top({0, 0.2, 0});
    bench.end_pull();
    const State before = state();
    for (std::size_t base : {100, 200, 300}) bench.set_strip({.base = base}, "base"); // the latest wins
    bench.wait_until_idle();
    EXPECT_NEAR(double(state().model->driver().vertices.size()), 300, 30);
    EXPECT_EQ(undo_stack().undoText(), "Driver of 300 vertices");
    EXPECT_TRUE(state().handles.empty());
    EXPECT_EQ(state().handle_pose, nullptr);
    EXPECT_EQ(state().warps.twist, 30);
    EXPECT_EQ(bench.pose()->positions.size(), state().model->driver().vertices.size());
    undo_stack().undo();
    EXPECT_TRUE(state() == before);
    EXPECT_TRUE(errors.empty());
}

TEST_F(WorkbenchTest, PointsInsideAreSampled) {
    QSignalSpy ready(&bench, &Workbench::inside_points_ready);
    bench.sample_inside_points(1000);
    bench.wait_until_idle();
    EXPECT_EQ(ready.count(), 1);
    EXPECT_NEAR(double(bench.inside_points().size()), 1000, 150);
}

TEST_F(WorkbenchTest, SettingsOfTheModelDoNotLoseEachOther) {
    make_small_shape();
    Shape shape = *bench.wanted_shape();
    shape.options.frequency = 10;
    bench.make_shape(shape, "frequency");
    shape = *bench.wanted_shape();
    EXPECT_EQ(shape.options.frequency, 10);
    shape.options.amplitude = 0.08;
    bench.make_shape(shape, "amplitude");
    StripOptions strip = bench.wanted_strip();
    strip.base = 80;
    bench.set_strip(strip);
    EXPECT_EQ(bench.wanted_shape()->options.amplitude, 0.08);
    bench.wait_until_idle();
    EXPECT_EQ(state().shape->options.frequency, 10);
    EXPECT_EQ(state().shape->options.amplitude, 0.08);
    EXPECT_EQ(state().strip.base, 80u);
    EXPECT_EQ(undo_stack().count(), 1);

    const Shape there = shape;
    shape.options.frequency = 7;
    bench.make_shape(shape);
    bench.make_shape(there); // back before it was made: nothing is to be done
    bench.wait_until_idle();
    EXPECT_EQ(undo_stack().count(), 1);

    shape.options.frequency = 7;
    bench.make_shape(shape);
    undo_stack().undo(); // what was to be made was meant for what is undone
    bench.wait_until_idle();
    EXPECT_EQ(bench.wanted_shape(), state().shape);
    EXPECT_NE(state().shape->options.frequency, 7);
}

TEST_F(WorkbenchTest, ClosingDuringWorkIsSafe) {
    Workbench other;
    other.open(path("missing.obj"));
    other.set_strip({.base = 500});
    other.play();
    other.begin_pull(0, other.state().model->mesh.world_position(0));
    other.pull_to({1, 1, 1});
}

} // namespace
} // namespace filigree::studio
