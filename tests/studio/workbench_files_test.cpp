// Opening, saving, meshes and films.
#include "io/corpus.h"
#include "workbench_fixture.h"

#include "filigree/file.h"
#include "filigree/io/model/model_file.h"
#include "filigree/io/system/file.h"
#include "filigree/mesh.h"
#include "filigree/render.h"
#include "filigree/strip.h"

#include <QSignalSpy>
#include <QTest>

#include <algorithm>
#include <filesystem>
#include <fstream>

namespace filigree::studio {
namespace {

namespace fs = std::filesystem;

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
    bend(80);
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
    ASSERT_TRUE(pack_model(model, {}, {.levels = true}, path("ball.fil"), context).ok());
    ASSERT_GT(fs::file_size(path("ball.fil")), 1u << 18);
    std::size_t first = 0;
    QObject::connect(&bench, &Workbench::told, &bench, [&](const QString& sentence, bool) {
        if (!sentence.startsWith("A first look at ball.fil")) return;
        first = state().source->mesh.vertex_count();
        bend(30);
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
    bend(30);
    bench.wait_until_idle();
    EXPECT_EQ(state().warps.bend, 30);
    ASSERT_EQ(errors.size(), 2u);
    EXPECT_EQ(errors[1], "The document was changed while a.ply was read; open it again.");
}

TEST_F(WorkbenchTest, ADocumentIsSavedOnlyWhenTheFileHoldsItAll) {
    make_small_shape();
    QSignalSpy saved(&bench, &Workbench::saved);
    bench.save_model(path("a.fil"));
    bench.wait_until_idle();
    EXPECT_EQ(saved.count(), 1);
    EXPECT_FALSE(bench.document().is_modified());
    EXPECT_TRUE(notes.back().starts_with("Saved a.fil. ")) << notes.back();
    EXPECT_TRUE(notes.back().ends_with("kB, in " + folder.path().toStdString() + '.')) << notes.back();
    bench.pin(std::vector<Index>{0, 1});
    bench.save_model(path("a.fil"));
    bench.wait_until_idle();
    EXPECT_TRUE(bench.document().is_modified());
    EXPECT_TRUE(notes.back().starts_with("Saved a.fil, without the pins. ")) << notes.back();
    bench.unpin_all();
    bend(30);
    simulate(2);
    bench.save_model(path("a.fil"));
    bench.wait_until_idle();
    EXPECT_TRUE(bench.document().is_modified());
    EXPECT_TRUE(notes.back().starts_with("Saved a.fil with its recording, without the deformation. ")) << notes.back();
}

TEST_F(WorkbenchTest, AnOpenedModelKnowsHowItWasStripped) {
    make_small_shape();
    StripOptions strip;
    strip.base = 80;
    bench.set_strip(strip);
    bench.wait_until_idle();
    const std::size_t driver = state().model->driver().vertices.size();
    bench.save_model(path("a.fil"));
    bench.open(path("a.fil"));
    bench.wait_until_idle();
    EXPECT_EQ(state().strip.base, driver);
}

/// Its vertices are in the file behind the mesh's own, and nowhere else.
TEST_F(WorkbenchTest, ADriverMadeElsewhereIsNoPartOfTheMesh) {
    const Mesh ball = make_wavy_sphere({.resolution = 24}), cage = make_wavy_sphere({.resolution = 8, .amplitude = 0});
    const Model model = strip_to_driver(ball, cage, RunContext()).value().model;
    ASSERT_TRUE(write_model(model, path("caged.fil"), RunContext()).ok());
    bench.open(path("caged.fil"));
    bench.wait_until_idle();
    EXPECT_EQ(state().source->mesh.vertex_count(), ball.vertex_count());
    EXPECT_EQ(state().model->vertex_count(), ball.vertex_count());
    bench.set_warps({.bend = 40});
    bench.save_mesh(path("bent.ply"));
    bench.wait_until_idle();
    EXPECT_EQ(read_mesh(path("bent.ply"), RunContext())->mesh.vertex_count(), ball.vertex_count());
    bench.want_full(true);
    bench.wait_until_idle();
    EXPECT_EQ(bench.full().size(), ball.vertex_count());
    bench.measure_error();
    bench.wait_until_idle();
    ASSERT_TRUE(bench.error());
    EXPECT_EQ(bench.error()->per_vertex.size(), ball.vertex_count());
    EXPECT_LT(bench.error()->rms, 1e-2);
    EXPECT_TRUE(errors.empty()) << errors.front();
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

} // namespace
} // namespace filigree::studio
