// "Cut pieces": the mesh becomes pieces, can be seen apart, and breaks as a body.
#include "pieces.h"

#include "one_window.h"
#include "script.h"

#include <QLabel>
#include <QTemporaryDir>

#include <fstream>

using namespace filigree;
using namespace filigree::studio;

namespace {

/// A window with a coarse wavy cube, to be cut into eight.
class Pieces : public OneWindow {
protected:
    void SetUp() override {
        OneWindow::SetUp();
        Shape shape = *state().shape;
        shape.options.resolution = 24;
        workbench().make_shape(shape);
        PieceOptions options;
        options.pattern.pieces = 8;
        workbench().set_piece_options(options);
        workbench().wait_until_idle();
    }
    static const State& state() { return workbench().state(); }
    static QUndoStack& undo_stack() { return workbench().document().undo_stack(); }
    static void cut() {
        workbench().cut_pieces();
        workbench().wait_until_idle();
        ASSERT_TRUE(state().source->pieces) << window->message().toStdString();
    }
    static void show_apart(double apart) {
        workbench().view().edit([&](ViewSettings& settings) { settings.apart = apart; });
    }
};

} // namespace

TEST_F(Pieces, TheMeshIsCutInOneStepAndKeepsItsVertices) {
    const State before = state();
    cut();
    const Mesh &whole = before.source->mesh, &mesh = state().model->mesh;
    EXPECT_EQ(state().source->pieces->report.cells, 8u);
    EXPECT_EQ(state().source->pieces->report.open_edges, 0u);
    ASSERT_GT(mesh.vertex_count(), whole.vertex_count());
    EXPECT_TRUE(std::equal(whole.positions.begin(), whole.positions.end(), mesh.positions.begin()));
    EXPECT_FALSE(state().shape);
    EXPECT_EQ(undo_stack().undoText(), "Cut pieces");
    undo_stack().undo();
    EXPECT_EQ(state().source, before.source);
    undo_stack().redo();
    workbench().make_whole();
    workbench().wait_until_idle();
    EXPECT_EQ(state().source, before.source);
    EXPECT_EQ(state().shape, before.shape);
}

TEST_F(Pieces, StrippedAgainTheyAreCutAgain) {
    cut();
    const std::size_t driver = state().model->driver().vertices.size();
    const auto input = state().source->pieces->input;
    StripOptions strip = state().strip;
    strip.base = 100;
    workbench().set_strip(strip);
    workbench().wait_until_idle();
    ASSERT_TRUE(state().source->pieces);
    EXPECT_EQ(state().source->pieces->input, input);
    EXPECT_LT(state().model->driver().vertices.size(), driver);
}

TEST_F(Pieces, AreSeenApartAndTogetherAgain) {
    cut();
    EXPECT_EQ(workbench().pose(), nullptr);
    show_apart(0.5);
    ASSERT_NE(workbench().pose(), nullptr);
    const std::vector<Vec3f> rest = driver_positions(*state().model);
    const std::vector<Index>& piece = state().source->pieces->breaking->carried.driver;
    std::vector<std::optional<Vec3f>> way(8);
    for (std::size_t d = 0; d < rest.size(); ++d) {
        const Vec3f moved = workbench().pose()->positions[d] - rest[d];
        EXPECT_GT(moved.norm(), 0);
        if (!way[piece[d]]) way[piece[d]] = moved;
        EXPECT_LT((moved - *way[piece[d]]).norm(), 1e-5f) << "a piece stays as it is";
    }
    workbench().measure_error(); // of pieces that are together
    EXPECT_TRUE(window->message().contains("moved together")) << window->message().toStdString();
    EXPECT_EQ(workbench().pose(), nullptr);
    workbench().wait_until_idle();
    EXPECT_TRUE(workbench().error());
    workbench().begin_pull(0, state().model->mesh.world_position(0));
    EXPECT_FALSE(workbench().is_pulling());
    EXPECT_TRUE(window->message().contains("as a body")) << window->message().toStdString();
}

TEST_F(Pieces, BreakWhenTheyFall) {
    cut();
    BodySettings body = state().body;
    body.particles = 400;
    body.strength = 1e-3;
    body.drop = 1;
    workbench().set_body(body);
    window->show_panel("fracture");
    workbench().animate();
    workbench().wait_until_idle();
    workbench().playback().wait_for_frames(60);
    workbench().pause();
    ASSERT_TRUE(workbench().playback().has_body()) << window->message().toStdString();
    EXPECT_GT(workbench().playback().moment()->fracture.parts, 1u);
    EXPECT_TRUE(window->findChild<QLabel*>("fracture.motion")->text().contains("pieces hang on their own"));
    const std::shared_ptr<const DroppedBody> made = workbench().playback().made();
    EXPECT_NEAR(made->report.mass, 1000, 400) << "the whole cube's";
}

TEST_F(Pieces, StrongOnesHold) {
    cut();
    BodySettings body = state().body;
    body.particles = 400;
    body.strength = 1;
    workbench().set_body(body);
    workbench().animate();
    workbench().wait_until_idle();
    workbench().playback().wait_for_frames(40);
    workbench().pause();
    EXPECT_EQ(workbench().playback().moment()->fracture.broken_area, 0);
}

TEST_F(Pieces, OnlyFiniteElementsBreak) {
    cut();
    BodySettings body = state().body;
    body.material.model = MaterialModel::springs;
    workbench().set_body(body);
    workbench().make_body();
    workbench().wait_until_idle();
    EXPECT_FALSE(workbench().playback().has_body());
    EXPECT_TRUE(window->message().contains("No body can be made of this")) << window->message().toStdString();
}

TEST_F(Pieces, ThePanelShowsWhatThereIs) {
    window->show();
    window->show_panel("fracture");
    const QTemporaryDir folder;
    const std::string script = folder.filePath("script.txt").toStdString();
    std::ofstream(script) << "expect fracture.pattern Even\nset fracture.pattern Radial\ndo fracture.cut\nwait\n"
                             "set fracture.apart 0.25\nset fracture.colored on\nwait\n"
                             "expect view.coloring Pieces\ndo fracture.whole\nwait\n";
    const Status ran = run_script(script, *window);
    ASSERT_TRUE(ran.ok()) << ran.error().message;
    EXPECT_FALSE(state().source->pieces);
    EXPECT_TRUE(window->findChild<QLabel*>("fracture.none")->isVisibleTo(window));
}
