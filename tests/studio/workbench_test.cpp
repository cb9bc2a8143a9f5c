#include "workbench.h"

#include "io/corpus.h"

#include "studio/materials.h"

#include "filigree/io/file.h"
#include "filigree/io/mesh_file.h"
#include "filigree/io/model_file.h"
#include "filigree/mesh/shapes.h"
#include "filigree/physics/named_materials.h"
#include "filigree/render/gl_context.h"

#include <QSignalSpy>
#include <QTemporaryDir>
#include <QTest>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

namespace filigree::studio {
namespace {

namespace fs = std::filesystem;

/// A workbench with what it told, and a folder for files.
class WorkbenchTest : public testing::Test {
protected:
    WorkbenchTest() {
        QObject::connect(&bench, &Workbench::told, &bench, [this](const QString& sentence, bool is_error) {
            (is_error ? errors : notes).push_back(sentence.toStdString());
        });
        QObject::connect(&bench, &Workbench::opened, &bench, [this] { ++opened; });
    }

    std::string path(const std::string& name) const { return (folder.path() + '/').toStdString() + name; }
    const State& state() const { return bench.state(); }
    QUndoStack& undo_stack() { return bench.document().undo_stack(); }

    /// A shape with so few vertices that bodies are made and moved in no time.
    void make_small_shape() {
        Shape shape = *state().shape;
        shape.options.resolution = 12;
        bench.make_shape(shape);
        bench.wait_until_idle();
        BodySettings body = state().body;
        body.particles = 200;
        bench.set_body(body);
        undo_stack().clear();
    }
    void pull_top(const Vec3d& way, int moves = 5) {
        const std::vector<Vec3f>& p = state().model->mesh.positions;
        const Index top =
            Index(std::max_element(p.begin(), p.end(), [](auto& a, auto& b) { return a.y() < b.y(); }) - p.begin());
        const Vec3d at = state().model->mesh.world_position(top);
        bench.begin_pull(top, at);
        for (int k = 1; k <= moves; ++k) bench.pull_to(at + double(k) / moves * way);
    }
    void simulate(std::size_t frames) {
        bench.make_body();
        bench.wait_until_idle();
        bench.play();
        bench.playback().wait_for_frames(frames);
        bench.pause();
    }

    Workbench bench;
    std::vector<std::string> errors, notes;
    int opened = 0;
    QTemporaryDir folder;
};

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
    Warps warps;
    warps.bend = 40;
    bench.set_warps(warps);
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

TEST_F(WorkbenchTest, LawAndThinShellAreSteps) {
    bench.set_law(HeightLaw::volume);
    bench.set_thin_shell(true);
    EXPECT_EQ(state().restore.law, HeightLaw::volume);
    EXPECT_TRUE(state().restore.thin_shell);
    EXPECT_EQ(undo_stack().count(), 2);
    bench.set_law(HeightLaw::volume);
    EXPECT_EQ(undo_stack().count(), 2);
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

TEST_F(WorkbenchTest, TheReferenceCodeWorksOnRegularQuads) {
    bench.set_strip({.code = DetailCode::reference});
    bench.wait_until_idle();
    EXPECT_EQ(state().model->code(), DetailCode::reference);
    Warps warps;
    warps.bend = 45;
    bench.set_warps(warps);
    bench.save_mesh(path("bent.obj"));
    bench.wait_until_idle();
    EXPECT_TRUE(errors.empty());
}

TEST_F(WorkbenchTest, WhatTheReferenceCodeRefusesIsToldAndChangesNothing) {
    ASSERT_TRUE(write_mesh(level_mesh(*state().model, 0), path("triangles.obj"), {}, RunContext()).ok());
    bench.open(path("triangles.obj"));
    bench.wait_until_idle();
    const State before = state();
    bench.set_strip({.code = DetailCode::reference});
    bench.wait_until_idle();
    ASSERT_EQ(errors.size(), 1u);
    EXPECT_TRUE(state() == before);
}

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
    Warps warps;
    warps.bend = 20;
    bench.set_warps(warps);
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

TEST_F(WorkbenchTest, PointsInsideAreSampled) {
    QSignalSpy ready(&bench, &Workbench::inside_points_ready);
    bench.sample_inside_points(1000);
    bench.wait_until_idle();
    EXPECT_EQ(ready.count(), 1);
    EXPECT_NEAR(double(bench.inside_points().size()), 1000, 150);
}

TEST_F(WorkbenchTest, SavedModelsComeBackWithTheirRecording) {
    make_small_shape();
    simulate(4);
    EXPECT_TRUE(bench.document().is_modified());
    bench.save_model(path("cube.fil"));
    bench.wait_until_idle();
    EXPECT_TRUE(errors.empty());
    EXPECT_FALSE(bench.document().is_modified());
    const std::size_t frames = state().recording->frames.size();
    const Pose last = *state().recording->frames.back();
    bench.open(path("cube.fil"));
    bench.wait_until_idle();
    EXPECT_EQ(opened, 1);
    EXPECT_EQ(bench.mode(), Mode::body);
    EXPECT_FALSE(state().shape);
    ASSERT_EQ(bench.frame_count(), frames);
    bench.go_to_frame(frames - 1);
    EXPECT_TRUE(bench.pose()->positions == last.positions);
    EXPECT_FALSE(undo_stack().canUndo());
}

TEST_F(WorkbenchTest, AShapeIsSavedAsItIsDeformed) {
    make_small_shape();
    bench.set_warps({.bend = 40});
    pull_top({0.1, 0.2, 0});
    bench.end_pull();
    bench.wait_until_idle();
    const Pose before = *bench.pose();
    bench.save_model(path("pulled.fil"));
    bench.open(path("pulled.fil"));
    bench.wait_until_idle();
    EXPECT_TRUE(errors.empty());
    EXPECT_EQ(bench.mode(), Mode::deform);
    ASSERT_NE(bench.pose(), nullptr);
    EXPECT_TRUE(bench.pose()->positions == before.positions);
    EXPECT_TRUE(bench.pose()->gradients == before.gradients);

    // It can be pulled on, but not be compared with what is not known.
    pull_top({0, 0.2, 0});
    bench.end_pull();
    bench.wait_until_idle();
    EXPECT_FALSE(bench.pose()->positions == before.positions);
    bench.measure_error();
    bench.wait_until_idle();
    ASSERT_EQ(errors.size(), 1u);
    EXPECT_NE(errors[0].find("from a file"), std::string::npos) << errors[0];
    bench.reset_deformation();
    EXPECT_EQ(bench.pose(), nullptr);
}

TEST_F(WorkbenchTest, ASaveThatFailsLeavesTheDocumentUnsaved) {
    bench.remove_detail();
    bench.save_model(path("no/such/folder.fil"));
    bench.wait_until_idle();
    ASSERT_EQ(errors.size(), 1u);
    EXPECT_NE(errors[0].find("folder.fil"), std::string::npos);
    EXPECT_TRUE(bench.document().is_modified());
    bench.save_mesh(path("cube.xyz"));
    bench.wait_until_idle();
    ASSERT_EQ(errors.size(), 2u);
    EXPECT_NE(errors[1].find("cube.xyz"), std::string::npos);
    EXPECT_FALSE(fs::exists(path("cube.xyz")));
}

TEST_F(WorkbenchTest, AChangeDuringTheSaveIsNotSaved) {
    bench.remove_detail();
    bench.save_model(path("cube.fil"));
    bench.remove_detail();
    bench.wait_until_idle();
    EXPECT_TRUE(bench.document().is_modified());
}

TEST_F(WorkbenchTest, MeshesAreSavedAsShown) {
    Warps warps;
    warps.bend = 80;
    bench.set_warps(warps);
    bench.set_level(2);
    bench.save_mesh(path("bent.ply"));
    bench.save_driver(path("driver.ply"));
    bench.wait_until_idle();
    EXPECT_TRUE(errors.empty());
    const Mesh mesh = read_mesh(path("bent.ply"), RunContext()).value().mesh;
    const auto expected =
        Restorer::create(*state().model, state().restore, RunContext())->positions(*bench.pose(), RunContext());
    EXPECT_TRUE(mesh.positions == expected.value());
    const Mesh driver = read_mesh(path("driver.ply"), RunContext()).value().mesh;
    EXPECT_TRUE(driver.positions == bench.pose()->positions);
    ASSERT_EQ(driver.scalars.size(), 9u);
    EXPECT_EQ(driver.scalars[5].name, "f12");
    EXPECT_EQ(driver.scalars[5].values[3], bench.pose()->gradients[3](1, 2));
}

TEST_F(WorkbenchTest, ErrorsOfFilesNameThemAndKeepTheDocument) {
    const State before = state();
    bench.open(path("missing.obj"));
    bench.wait_until_idle();
    ASSERT_EQ(errors.size(), 1u);
    EXPECT_NE(errors[0].find("missing.obj"), std::string::npos);
    ASSERT_TRUE(write_file(path("junk.fil"), "FILIGREE but not a model").ok());
    bench.open(path("junk.fil"));
    bench.wait_until_idle();
    ASSERT_EQ(errors.size(), 2u);
    EXPECT_NE(errors[1].find("junk.fil"), std::string::npos);
    ASSERT_TRUE(write_file(path("empty.obj"), "# nothing\n").ok());
    bench.open(path("empty.obj"));
    bench.wait_until_idle();
    ASSERT_EQ(errors.size(), 3u);
    EXPECT_NE(errors[2].find("empty.obj"), std::string::npos);
    EXPECT_TRUE(state() == before);
    EXPECT_EQ(opened, 0);
}

TEST_F(WorkbenchTest, BadFilesOfTheCorpusLeaveTheDocumentAlone) {
    const auto rows = filigree_test::read_corpus();
    if (rows.empty()) GTEST_SKIP() << "no corpus";
    std::size_t refused = 0;
    for (const auto& row : rows) {
        std::error_code ignored; // folders have no size
        if (const auto size = fs::file_size(row.path, ignored); !ignored && size > 2'000'000) continue;
        if (read_mesh(row.path, RunContext()).ok()) continue;
        const std::uint64_t id = bench.document().state_id();
        errors.clear();
        bench.open(row.path.string());
        bench.wait_until_idle();
        ASSERT_EQ(errors.size(), 1u) << row.file;
        EXPECT_NE(errors[0].find(row.path.filename().string()), std::string::npos) << errors[0];
        EXPECT_EQ(bench.document().state_id(), id) << row.file;
        ++refused;
    }
    EXPECT_GT(refused, 0u);
}

TEST_F(WorkbenchTest, OpeningCanBeCancelled) {
    const State before = state();
    ASSERT_TRUE(write_mesh(state().model->mesh, path("cube.ply"), {}, RunContext()).ok());
    bench.open(path("cube.ply"));
    bench.jobs().cancel();
    bench.wait_until_idle();
    EXPECT_EQ(opened, 0);
    EXPECT_TRUE(state() == before);
    EXPECT_TRUE(errors.empty());
    bench.open(path("missing.ply"));
    bench.open(path("cube.ply")); // takes the other's place
    bench.wait_until_idle();
    EXPECT_EQ(opened, 1);
    EXPECT_EQ(state().source->name, "cube.ply");
    EXPECT_EQ(state().source->path, path("cube.ply"));
}

TEST_F(WorkbenchTest, ALargeStreamIsLookedAtAndWarpedBeforeAllOfItIsRead) {
    const RunContext context;
    const Mesh mesh = make_wavy_sphere({.resolution = 150});
    const Model model = strip(mesh, {.base = 300}, context).value().model;
    ASSERT_TRUE(write_coded_model(model, {}, {.levels = true}, path("ball.fil"), context).ok());
    ASSERT_GT(fs::file_size(path("ball.fil")), 1u << 18);
    std::size_t first = 0;
    QObject::connect(&bench, &Workbench::told, &bench, [&](const QString& sentence, bool) {
        if (!sentence.startsWith("A first look at ball.fil")) return;
        first = state().source->mesh.vertex_count();
        Warps warps;
        warps.bend = 30;
        bench.set_warps(warps);
    });
    bench.open(path("ball.fil"));
    bench.wait_until_idle();
    EXPECT_TRUE(errors.empty());
    EXPECT_GT(first, 1000u);
    EXPECT_LT(first, mesh.vertex_count() / 2);
    EXPECT_EQ(state().source->mesh.vertex_count(), mesh.vertex_count());
    EXPECT_EQ(state().model->driver().vertices.size(), model.driver().vertices.size());
    EXPECT_EQ(state().warps.bend, 30);
    EXPECT_EQ(opened, 1);

    std::string bytes = read_file(path("ball.fil")).value();
    bytes.resize((1u << 18) + 100); // cut off: what is there is looked at, and the rest is told to be missing
    std::ofstream(path("half.fil"), std::ios::binary) << bytes;
    bench.open(path("half.fil"));
    bench.wait_until_idle();
    EXPECT_EQ(errors.size(), 1u);
    EXPECT_EQ(state().source->name, "half.fil");
    EXPECT_LT(state().source->mesh.vertex_count(), mesh.vertex_count() / 2);
}

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
    EXPECT_NE(warning.find("Fit driver"), std::string::npos) << warning;
    EXPECT_EQ(warning.find("--"), std::string::npos) << "that is for the command line: " << warning;
    EXPECT_EQ(notes, std::vector{warning});

    bench.fit_driver();
    bench.wait_until_idle();
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

TEST_F(WorkbenchTest, FramesAreExportedAsMeshes) {
    make_small_shape();
    bench.export_meshes(path("frame_%03d.obj"));
    ASSERT_EQ(errors.size(), 1u); // nothing recorded
    for (int k = 0; k < 3; ++k) {
        bench.step();
        bench.wait_until_idle();
        bench.playback().wait_for_frames(0);
    }
    for (const char* bad : {"frame.obj", "%d_%d.obj", "%s.obj", "%123456d.obj", "50%"}) bench.export_meshes(path(bad));
    EXPECT_EQ(errors.size(), 6u);
    bench.export_meshes(path("frame_%03d.obj"));
    bench.wait_until_idle();
    EXPECT_EQ(errors.size(), 6u);
    ASSERT_EQ(bench.frame_count(), 4u);
    EXPECT_TRUE(fs::exists(path("frame_001.obj")));
    const Mesh last = read_mesh(path("frame_004.obj"), RunContext()).value().mesh;
    EXPECT_EQ(last.vertex_count(), state().model->mesh.vertex_count());
    EXPECT_LT(bounds(last.positions).min.y(), bounds(state().model->mesh.positions).min.y());
    EXPECT_FALSE(fs::exists(path("frame_005.obj")));
}

TEST_F(WorkbenchTest, FilmsAreDrawnWithoutTheWindow) {
    if (!HeadlessContext::create().ok()) GTEST_SKIP() << "no OpenGL";
    make_small_shape();
    for (int k = 0; k < 2; ++k) {
        bench.step();
        bench.wait_until_idle();
        bench.playback().wait_for_frames(0);
    }
    bench.view().fit(world_bounds(state().model->mesh), view_direction(View::iso, UpAxis::y), 4.0 / 3);
    bench.export_film(path("film_%02d.png"), {.width = 64, .height = 48, .passes = 1});
    bench.wait_until_idle();
    EXPECT_TRUE(errors.empty()) << errors[0];
    EXPECT_TRUE(fs::exists(path("film_03.png")));
    EXPECT_FALSE(fs::exists(path("film_04.png")));
    bench.export_film(path("film.txt"), {});
    bench.wait_until_idle();
    EXPECT_EQ(errors.size(), 1u);
    bench.export_film(path("cancelled_%02d.png"), {.width = 320, .height = 240, .passes = 16});
    EXPECT_TRUE(QTest::qWaitFor([&] { return bench.jobs().fraction() > 0; }));
    bench.jobs().cancel();
    bench.wait_until_idle();
    EXPECT_FALSE(fs::exists(path("cancelled_01.png")));
}

TEST_F(WorkbenchTest, ACancelledPullLeavesTheHistoryAlone) {
    Warps warps;
    warps.bend = 20;
    bench.set_warps(warps);
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

TEST_F(WorkbenchTest, OpeningIsNeitherDroppedNorDoesItDropChanges) {
    make_small_shape();
    bench.save_mesh(path("a.ply"));
    bench.wait_until_idle();
    Shape shape = *state().shape;
    shape.options.frequency = 8;
    bench.open(path("a.ply"));
    bench.make_shape(shape); // refused
    EXPECT_EQ(errors.size(), 1u);
    bench.wait_until_idle();
    EXPECT_EQ(state().source->name, "a.ply");

    bench.open(path("a.ply"));
    Warps warps;
    warps.bend = 30;
    bench.set_warps(warps);
    bench.wait_until_idle();
    EXPECT_EQ(state().warps.bend, 30);
    ASSERT_EQ(errors.size(), 2u);
    EXPECT_EQ(errors[1], "The document was changed while a.ply was read; open it again.");
}

TEST_F(WorkbenchTest, ADocumentIsSavedOnlyWhenTheFileHoldsItAll) {
    make_small_shape();
    QSignalSpy saved(&bench, &Workbench::saved);
    bench.set_law(HeightLaw::keep);
    bench.save_model(path("a.fil"));
    bench.wait_until_idle();
    EXPECT_EQ(saved.count(), 1);
    EXPECT_FALSE(bench.document().is_modified()); // a law is how it is shown
    EXPECT_EQ(notes.back(), "Saved a.fil, without the law.");
    bench.pin(std::vector<Index>{0, 1});
    bench.save_model(path("a.fil"));
    bench.wait_until_idle();
    EXPECT_TRUE(bench.document().is_modified());
    EXPECT_EQ(notes.back(), "Saved a.fil, without the pins and the law.");
    bench.unpin_all();
    Warps warps;
    warps.bend = 30;
    bench.set_warps(warps);
    simulate(2);
    bench.save_model(path("a.fil"));
    bench.wait_until_idle();
    EXPECT_TRUE(bench.document().is_modified());
    EXPECT_EQ(notes.back(), "Saved a.fil with its recording, without the deformation and the law.");
}

TEST_F(WorkbenchTest, AnOpenedModelKnowsHowItWasStripped) {
    make_small_shape();
    StripOptions strip;
    strip.base = 80;
    strip.precision = Precision::int16;
    bench.set_strip(strip);
    bench.wait_until_idle();
    const std::size_t driver = state().model->driver().vertices.size();
    bench.save_model(path("a.fil"));
    bench.open(path("a.fil"));
    bench.wait_until_idle();
    EXPECT_EQ(state().strip.precision, Precision::int16);
    EXPECT_EQ(state().strip.base, driver);
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
    Warps warps;
    warps.bend = 30;
    bench.set_warps(warps);
    bench.make_body();
    bench.wait_until_idle();
    ASSERT_EQ(notes.size(), 2u);
    EXPECT_NE(notes[0].find("cannot follow the particles"), std::string::npos) << notes[0]; // the driver is coarse
    EXPECT_EQ(notes[1], "A body is made of the shape at rest, without its deformation.");
    bench.pin(std::vector<Index>{3});
    ASSERT_EQ(notes.size(), 3u);
    EXPECT_EQ(notes[2], "Make the body again for new pins to hold it.");
}

TEST_F(WorkbenchTest, NumbersAreLookedForInTheFileNameAlone) {
    make_small_shape();
    simulate(2);
    fs::create_directory(path("50% done"));
    const std::string pattern = path("50% done/frame_%03d.obj");
    EXPECT_TRUE(existing_outputs(pattern, bench.frame_count()).empty());
    bench.export_meshes(pattern);
    bench.wait_until_idle();
    EXPECT_TRUE(errors.empty());
    EXPECT_EQ(existing_outputs(pattern, 2),
              (std::vector<std::string>{path("50% done/frame_001.obj"), path("50% done/frame_002.obj")}));
    EXPECT_EQ(existing_outputs(path("50% done/frame_001.obj"), 9).size(), 1u);
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
