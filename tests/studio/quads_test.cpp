// "Make quads": the mesh becomes quads in patches, is told of, and can be undone.
#include "quads.h"

#include "filigree/present/patch_colors.h"
#include "one_window.h"
#include "script.h"
#include "words.h"

#include "filigree/file.h"

#include <QComboBox>
#include <QDoubleSpinBox>
#include <QLabel>
#include <QPushButton>
#include <QSignalSpy>
#include <QTemporaryDir>

#include <algorithm>
#include <map>
#include <set>

using namespace filigree;
using namespace filigree::studio;

namespace {

/// A window with a closed surface of triangles.
class Quads : public OneWindow {
protected:
    void SetUp() override {
        OneWindow::SetUp();
        workbench().set_quad_options({.quads = 1500});
        Shape shape = *state().shape;
        shape.name = "wavy-sphere";
        shape.options.resolution = 24;
        workbench().make_shape(shape);
        workbench().wait_until_idle();
        ASSERT_TRUE(folder.isValid());
        ASSERT_TRUE(write_mesh(level_mesh(*state().model, 0), triangles(), {}, RunContext()).ok());
        ASSERT_GT(level_mesh(*state().model, 0).face_count(), 100u);
        workbench().open(triangles());
        workbench().wait_until_idle();
        ASSERT_EQ(state().source->topology.quads, 0u);
    }
    std::string triangles() const { return folder.filePath("triangles.obj").toStdString(); }
    static const State& state() { return workbench().state(); }
    static QUndoStack& undo_stack() { return workbench().document().undo_stack(); }
    static void make_quads() {
        workbench().make_quads();
        workbench().wait_until_idle();
    }
    template <class T>
    static T& get(const char* name) {
        T* const widget = window->findChild<T*>(name);
        if (!widget) throw std::runtime_error(std::string("no control ") + name);
        return *widget;
    }
    static QString text(const char* name) { return get<QLabel>(name).text(); }

    QTemporaryDir folder;
};

} // namespace

TEST_F(Quads, TheMeshBecomesQuadsInOneStep) {
    const State before = state();
    make_quads();
    ASSERT_TRUE(state().source->quads) << window->message().toStdString();
    const Mesh& mesh = state().source->mesh;
    const QuadRemeshReport& report = state().source->quads->report;
    EXPECT_EQ(check_mesh(mesh), "");
    EXPECT_EQ(state().source->topology.quads, mesh.face_count());
    EXPECT_TRUE(state().source->topology.is_closed());
    EXPECT_EQ(report.quality.inverted, 0u);
    EXPECT_EQ(mesh.face_count(), report.patches << (2 * report.levels));
    EXPECT_EQ(state().model->mesh.face_count(), mesh.face_count());
    EXPECT_EQ(state().level(), state().model->finest_level());
    EXPECT_EQ(undo_stack().count(), 1);
    EXPECT_EQ(undo_stack().undoText(), "Make quads");
    EXPECT_TRUE(window->message().contains(with_commas(mesh.face_count()))) << window->message().toStdString();
    undo_stack().undo();
    EXPECT_EQ(state().source, before.source);
    EXPECT_EQ(state().model, before.model);
    undo_stack().redo();
    EXPECT_TRUE(state().source->quads);
}

TEST_F(Quads, OtherQuadsAreMadeOfTheMeshBefore) {
    const std::shared_ptr<const Source> input = state().source;
    make_quads();
    const std::shared_ptr<const Source> first = state().source;
    ASSERT_TRUE(first->quads);
    EXPECT_EQ(first->quads->input, input);
    make_quads();
    ASSERT_NE(state().source, first);
    EXPECT_EQ(state().source->quads->input, input);
    EXPECT_EQ(state().source->name, first->name);
    EXPECT_TRUE(state().source->mesh.positions == first->mesh.positions);
    EXPECT_EQ(undo_stack().count(), 2);
}

TEST_F(Quads, DeformationsStay) {
    Warps warps;
    warps.twist = 40;
    workbench().set_warps(warps);
    make_quads();
    ASSERT_TRUE(state().source->quads);
    EXPECT_EQ(state().warps.twist, 40);
    ASSERT_NE(workbench().pose(), nullptr);
    EXPECT_EQ(workbench().pose()->positions.size(), state().model->driver().vertices.size());
}

TEST_F(Quads, AShapeIsOneNoMore) {
    workbench().make_shape({});
    workbench().wait_until_idle();
    ASSERT_TRUE(state().shape);
    make_quads();
    ASSERT_TRUE(state().source->quads) << window->message().toStdString();
    EXPECT_FALSE(state().shape);
    undo_stack().undo();
    EXPECT_TRUE(state().shape);
}

TEST_F(Quads, ThePanelSaysHowTheyAreMadeAndHowTheyCameOut) {
    window->show();
    window->show_panel("quads");
    EXPECT_FALSE(get<QLabel>("quads.none").isHidden());
    EXPECT_TRUE(get<QLabel>("quads.figures").isHidden());
    get<QDoubleSpinBox>("quads.count.number").setValue(800);
    get<QComboBox>("quads.levels").setCurrentIndex(2);
    get<QDoubleSpinBox>("quads.feature_angle.number").setValue(180);
    get<QComboBox>("quads.small_parts").setCurrentIndex(1);
    const QuadRemeshOptions& options = workbench().quad_options();
    EXPECT_EQ(options.quads, 800u);
    EXPECT_EQ(options.levels, std::optional(2u));
    EXPECT_EQ(options.feature_angle_deg, 180);
    EXPECT_EQ(options.small_parts, SmallParts::keep);
    get<QComboBox>("quads.levels").setCurrentIndex(0);
    EXPECT_FALSE(options.levels);

    get<QPushButton>("quads.make_button").click();
    workbench().wait_until_idle();
    ASSERT_TRUE(state().source->quads) << window->message().toStdString();
    EXPECT_TRUE(get<QLabel>("quads.none").isHidden());
    const QString figures = text("quads.figures");
    const QuadRemeshReport& report = state().source->quads->report;
    EXPECT_TRUE(figures.contains(with_commas(report.quality.quads))) << figures.toStdString();
    EXPECT_TRUE(figures.contains(with_commas(report.patches))) << figures.toStdString();
    EXPECT_TRUE(text("quads.remarks").contains("triangles") || text("quads.remarks").contains("faces"));
    undo_stack().undo();
    EXPECT_FALSE(get<QLabel>("quads.none").isHidden());
    EXPECT_TRUE(get<QLabel>("quads.figures").isHidden());
}

TEST_F(Quads, WhatIsRefusedIsToldAndChangesNothing) {
    workbench().set_quad_options({.quads = 0});
    const State before = workbench().document().state();
    QSignalSpy failed(&workbench().jobs(), &Jobs::failed);
    make_quads();
    EXPECT_EQ(failed.count(), 1);
    EXPECT_TRUE(window->message().contains("No quads can be made")) << window->message().toStdString();
    EXPECT_TRUE(workbench().document().state() == before);
    EXPECT_EQ(undo_stack().count(), 0);
}

TEST_F(Quads, CancelLeavesTheMeshAsItWas) {
    workbench().set_quad_options({.quads = 200'000});
    const State before = workbench().document().state();
    workbench().make_quads();
    EXPECT_TRUE(workbench().jobs().is_busy());
    workbench().jobs().cancel();
    workbench().wait_until_idle();
    EXPECT_TRUE(window->message().contains("cancelled")) << window->message().toStdString();
    EXPECT_TRUE(workbench().document().state() == before);
}

TEST_F(Quads, WhatTakesTheMeshAwayTakesTheQuadsAlong) {
    workbench().make_quads();
    workbench().set_strip({.base = 50}); // would be lost: it is of the mesh before
    EXPECT_TRUE(window->message().contains("are being made")) << window->message().toStdString();
    workbench().open(triangles());
    workbench().wait_until_idle();
    EXPECT_FALSE(state().source->quads);
    EXPECT_EQ(undo_stack().count(), 0);
    workbench().open(triangles());
    workbench().make_quads(); // of which mesh?
    EXPECT_TRUE(window->message().contains("being opened")) << window->message().toStdString();
    workbench().wait_until_idle();
    EXPECT_FALSE(state().source->quads);
}

TEST_F(Quads, PointsHaveNone) {
    Mesh points;
    points.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    const std::string path = folder.filePath("points.obj").toStdString();
    ASSERT_TRUE(write_mesh(points, path, {}, RunContext()).ok());
    workbench().open(path);
    workbench().wait_until_idle();
    ASSERT_EQ(state().source->topology.faces, 0u);
    EXPECT_FALSE(window->actions().find("quads.make")->isEnabled());
    EXPECT_FALSE(get<QPushButton>("quads.make_button").isEnabled());
}

TEST_F(Quads, PatchesDifferFromTheirNeighbours) {
    workbench().make_shape({}); // a cube: each side a patch of 64 x 64 quads
    workbench().wait_until_idle();
    const Mesh& mesh = state().source->mesh;
    const Result<FaceLabels> labels = patch_labels(mesh, 6, RunContext());
    ASSERT_TRUE(labels) << labels.error().message;
    ASSERT_EQ(labels->of_face.size(), mesh.face_count());
    std::map<Index, std::size_t> counts;
    for (const Index label : labels->of_face) {
        ASSERT_LT(label, labels->names.size());
        ++counts[label];
    }
    for (const auto& [label, count] : counts) EXPECT_EQ(count % (64 * 64), 0u) << label; // whole patches
    EXPECT_GE(counts.size(), 3u); // as many sides meet at each corner
    // At the cube's corners three faces meet, of three patches.
    std::map<Index, std::set<Index>> around;
    std::map<Index, std::size_t> valence;
    for (std::size_t f = 0; f < mesh.face_count(); ++f)
        for (const Index v : mesh.face(f)) {
            around[v].insert(labels->of_face[f]);
            ++valence[v];
        }
    for (const auto& [v, faces] : valence) EXPECT_TRUE(faces != 3 || around[v].size() == 3u) << "vertex " << v;
    EXPECT_FALSE(patch_labels(level_mesh(*state().model, 0), 6, RunContext()));
}

TEST_F(Quads, PatchesAreSeen) {
    window->show();
    make_quads();
    ASSERT_TRUE(state().source->quads) << window->message().toStdString();
    const auto picture = [] {
        EXPECT_TRUE(wait_until_still(*window, 60));
        window->viewport().finish_drawing();
        return window->viewport().grabFramebuffer();
    };
    /// Pixels that are clearly of a colour.
    const auto colored = [](const QImage& image) {
        int count = 0;
        for (int y = 0; y < image.height(); y += 2)
            for (int x = 0; x < image.width(); x += 2) count += image.pixelColor(x, y).hsvSaturationF() > 0.2;
        return count;
    };
    const int before = colored(picture());
    window->actions().find("view.color_patches")->trigger();
    const int with = colored(picture());
    EXPECT_GT(with, 4 * std::max(500, before));
    workbench().remove_detail();
    EXPECT_LT(colored(picture()), with / 4) << "coarser levels have none";
}

TEST_F(Quads, ReportsSayWhatWasChanged) {
    MadeQuads quads;
    quads.report.clean.welded_vertices = 1;
    quads.report.clean.closed_handles = 12;
    quads.report.feature_edges = 300;
    quads.report.input.euler = 0;
    quads.report.input.components = quads.report.output.components = 1;
    quads.report.output.euler = 2;
    quads.report.wrapped = true;
    quads.report.tries = 2;
    quads.report.retried = "two quads were turned over";
    const QString remarks = quads_remarks(quads);
    for (const char* line : {"1 vertex welded", "12 small handles closed", "300 edges kept",
                             "Handles: 1 of the mesh, 0 of", "closed wrap", "try 2", "two quads were turned over"})
        EXPECT_TRUE(remarks.contains(line)) << line << " in " << remarks.toStdString();
    EXPECT_FALSE(remarks.contains("Parts"));
    EXPECT_EQ(quads_remarks({}), "");
}
