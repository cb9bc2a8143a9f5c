// What the mouse does in the picture.
#include "coloring.h"
#include "viewport_stand.h"

#include "overlay.h"

#include "sanitized.h"
#include "studio/materials.h"

#include "filigree/file.h"
#include "filigree/mesh.h"

#include <QTemporaryDir>

#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>

using namespace filigree;
using namespace filigree::studio;

namespace {

TEST(Pointer, PicksWhatItProjects) {
    Stand stand("wavy-sphere", 24);
    ASSERT_TRUE(stand.is_ready());
    ASSERT_EQ(stand.viewport->trouble(), "");
    for (const QPoint& at : {stand.middle(), stand.middle() + QPoint(37, -22), stand.middle() + QPoint(-50, 31)}) {
        const auto picked = stand.viewport->pick(at);
        ASSERT_TRUE(picked) << at.x() << " " << at.y();
        EXPECT_LT(distance(stand.viewport->place_of(picked->at), at), 0.01);
        // The vertex is one of the triangle's corners, so near.
        const Vec3d vertex = stand.workbench.state().model->mesh.world_position(picked->vertex);
        EXPECT_LT((vertex - picked->at).norm(), 0.1);
        // And nothing lies in front: the eye sees the near side.
        EXPECT_GT((stand.workbench.view().camera().eye - picked->at).dot(picked->at), 0);
    }
    EXPECT_FALSE(stand.viewport->pick({2, 2}));
    EXPECT_FALSE(stand.viewport->pick({-5, 100}));
}

TEST(Pointer, ADragOnTheShapePullsIt) {
    Stand stand;
    ASSERT_TRUE(stand.is_ready());
    stand.set([](ViewSettings& s) { s.grip = 0.15; }); // some of the few driver vertices, not one
    const State before = stand.workbench.document().state();
    const QPoint from = stand.middle() + QPoint(-20, -15), to = from + QPoint(-45, -30);
    const auto grabbed = stand.viewport->pick(from);
    ASSERT_TRUE(grabbed);
    const Vec3d rest = stand.place_of_vertex(grabbed->vertex);
    const Camera camera = stand.workbench.view().camera();

    stand.drag(from, to);
    stand.workbench.wait_until_idle();
    ASSERT_TRUE(stand.workbench.pose());
    EXPECT_EQ(stand.workbench.view().camera().eye, camera.eye) << "the camera has nothing to do with it";
    const QPointF moved =
        stand.viewport->place_of(stand.place_of_vertex(grabbed->vertex)) - stand.viewport->place_of(rest);
    EXPECT_LT(distance(moved, to - from), 4) << moved.x() << " " << moved.y();
    // The picture agrees with the pose, wherever that was restored: the point held is under the pointer.
    stand.viewport->finish_drawing();
    const auto there = stand.viewport->pick(to);
    ASSERT_TRUE(there);
    EXPECT_LT((stand.place_of_vertex(there->vertex) - stand.place_of_vertex(grabbed->vertex)).norm(), 0.12);

    QUndoStack& history = stand.workbench.document().undo_stack();
    EXPECT_EQ(history.count(), history.index());
    const State pulled = stand.workbench.document().state();
    EXPECT_FALSE(pulled == before);
    history.undo();
    EXPECT_TRUE(stand.workbench.document().state() == before);
    history.redo();
    EXPECT_TRUE(stand.workbench.document().state() == pulled);
}

/// With the settings that the window starts with: what was grabbed is where the pointer is.
TEST(Pointer, WhatIsGrabbedStaysUnderThePointer) {
    constexpr double kMost =
        kSanitized ? 8 : 2; // pixels; letting go ends by the clock, under a sanitizer with less solved
    Stand stand("wavy-cube", 64);
    stand.window.resize(600, 480);
    ASSERT_TRUE(stand.is_ready());
    const auto check = [&](const QString& name) {
        for (const QPoint& from : {QPoint(0, 0), QPoint(-90, 40), QPoint(70, -60), QPoint(110, 50), QPoint(-40, -90)}) {
            const QPoint at = stand.middle() + from;
            const auto grabbed = stand.viewport->pick(at);
            if (!grabbed) continue;
            const QPointF before = stand.viewport->place_of(stand.place_of_vertex(grabbed->vertex));
            for (const QPoint& way : {QPoint(45, -30), QPoint(-20, 60)}) {
                stand.drag(at, at + way);
                stand.workbench.wait_until_idle();
                const QPointF after = stand.viewport->place_of(stand.place_of_vertex(grabbed->vertex));
                EXPECT_LT(distance(after - before, way), kMost)
                    << name.toStdString() << " " << from.x() << " " << from.y() << ": " << (after - before).x() << " "
                    << (after - before).y();
                stand.workbench.document().undo_stack().undo();
            }
        }
    };
    check("cube");
    // And with a shape that is bent already.
    Warps warps;
    warps.bend = 40;
    stand.workbench.set_warps(warps);
    check("bent cube");
}

TEST(Pointer, TheMiddleButtonIsBlendersWhereThatIsChosen) {
    Stand stand;
    ASSERT_TRUE(stand.is_ready());
    const QPoint from = stand.middle(), to = from + QPoint(40, 0);
    const auto camera = [&] { return stand.workbench.view().camera(); };
    const Camera first = camera();
    stand.drag(from, to, Qt::MiddleButton);
    EXPECT_GT((camera().target - first.target).norm(), 0.05) << "moves";

    stand.workbench.view().set_camera(first);
    stand.set([](ViewSettings& s) { s.blender_mouse = true; });
    stand.drag(from, to, Qt::MiddleButton);
    EXPECT_EQ(camera().target, first.target);
    EXPECT_GT((camera().eye - first.eye).norm(), 0.1 * (first.eye - first.target).norm()) << "turns";

    stand.workbench.view().set_camera(first);
    stand.drag(from, to, Qt::MiddleButton, Qt::ShiftModifier);
    EXPECT_GT((camera().target - first.target).norm(), 0.05) << "moves";

    stand.workbench.view().set_camera(first);
    stand.drag(from, to, Qt::MiddleButton, Qt::ControlModifier);
    EXPECT_EQ(camera().target, first.target);
    EXPECT_LT((camera().eye - first.target).norm(), 0.95 * (first.eye - first.target).norm()) << "comes closer";
}

TEST(Pointer, EscapePutsBack) {
    Stand stand;
    ASSERT_TRUE(stand.is_ready());
    const State before = stand.workbench.document().state();
    const QPoint from = stand.middle();
    stand.press(from);
    stand.move(from, from + QPoint(60, 0));
    EXPECT_TRUE(stand.workbench.is_pulling());
    QTest::keyClick(stand.viewport, Qt::Key_Escape);
    EXPECT_FALSE(stand.workbench.is_pulling());
    stand.release(from + QPoint(60, 0));
    stand.workbench.wait_until_idle();
    EXPECT_TRUE(stand.workbench.document().state() == before);
    EXPECT_FALSE(stand.workbench.pose());
}

TEST(Pointer, AClickChangesNothing) {
    Stand stand;
    ASSERT_TRUE(stand.is_ready());
    const State before = stand.workbench.document().state();
    const Camera camera = stand.workbench.view().camera();
    QTest::mouseClick(stand.viewport, Qt::LeftButton, {}, stand.middle());
    EXPECT_TRUE(stand.workbench.document().state() == before);
    EXPECT_EQ(stand.workbench.view().camera().eye, camera.eye);
}

TEST(Pointer, ADragBesideTheShapeTurnsAndTheWheelZooms) {
    Stand stand;
    ASSERT_TRUE(stand.is_ready());
    ViewState& view = stand.workbench.view();
    const auto distance_to_target = [&] { return (view.camera().eye - view.camera().target).norm(); };
    const Camera before = view.camera();
    stand.drag({5, 5}, {65, 5});
    EXPECT_GT((view.camera().eye - before.eye).norm(), 0.2 * distance_to_target());
    EXPECT_EQ(view.camera().target, before.target);
    EXPECT_FALSE(stand.workbench.pose());

    // Right over the shape turns too; Shift moves.
    const Camera turned = view.camera();
    stand.drag(stand.middle(), stand.middle() + QPoint(0, 30), Qt::RightButton);
    EXPECT_GT((view.camera().eye - turned.eye).norm(), 0.05 * distance_to_target());
    const Camera raised = view.camera();
    const QPointF target_at = stand.viewport->place_of(raised.target);
    stand.drag(stand.middle(), stand.middle() + QPoint(40, 10), Qt::LeftButton, Qt::ShiftModifier);
    EXPECT_LT(distance(stand.viewport->place_of(raised.target), target_at + QPointF(40, 10)), 0.01);
    EXPECT_FALSE(stand.workbench.pose());

    const double zoom = view.zoom();
    const QPoint at = stand.middle() + QPoint(60, 20);
    const auto fixed = stand.viewport->pick(stand.middle());
    ASSERT_TRUE(fixed);
    stand.wheel(at, 3);
    EXPECT_GT(view.zoom(), 1.3 * zoom);
    stand.wheel(at, -3);
    EXPECT_NEAR(view.zoom(), zoom, 1e-6 * zoom);
    EXPECT_LT(distance(stand.viewport->place_of(fixed->at), stand.middle()), 0.01) << "there and back again";
    stand.wheel(at, 200);
    EXPECT_LE(view.zoom(), ViewState::kMostZoom * 1.0001);
    stand.wheel(at, -400);
    EXPECT_GE(view.zoom(), ViewState::kLeastZoom * 0.9999);
    QTest::mouseDClick(stand.viewport, Qt::LeftButton, {}, QPoint(3, 3));
    EXPECT_NEAR(view.zoom(), 1, 1e-6) << "a double click beside the shape shows all";
}

TEST(Pointer, TheTorchMeltsABodyUnderTheMouse) {
    Stand stand("wavy-sphere");
    ASSERT_TRUE(stand.is_ready());
    Workbench& workbench = stand.workbench;
    QStringList told;
    QObject::connect(&workbench, &Workbench::told, [&](const QString& sentence) { told << sentence; });
    stand.set([](ViewSettings& s) { s.tool = &kTorchTool; });
    stand.drag(stand.middle(), stand.middle() + QPoint(8, 0));
    ASSERT_EQ(told.size(), 1) << "there is no body yet";
    EXPECT_TRUE(told[0].contains("torch"));
    EXPECT_FALSE(workbench.pose());

    BodySettings body = workbench.state().body;
    body.material = material_named("wax");
    body.particles = 300;
    body.drop = 0;
    workbench.set_body(body);
    workbench.make_body();
    workbench.wait_until_idle();
    ASSERT_TRUE(stand.is_ready());
    stand.set([](ViewSettings& s) { s.coloring = &kHeatColors; });
    QTest::mousePress(stand.viewport, Qt::LeftButton, {}, stand.middle());
    EXPECT_TRUE(QTest::qWaitFor([&] { return workbench.melt_surface() != nullptr; }, 60'000));
    QTest::mouseRelease(stand.viewport, Qt::LeftButton, {}, stand.middle());
    workbench.pause();
    ASSERT_TRUE(stand.is_drawn());
    EXPECT_TRUE(stand.viewport->pick(stand.middle())) << "what has melted is taken hold of too";
    const auto* overlay = static_cast<const Overlay*>(stand.viewport->findChild<QWidget*>("viewport.overlay"));
    ASSERT_TRUE(overlay->content().legend);
    EXPECT_EQ(overlay->content().legend->unit, "°C");

    // What is seen is what is saved.
    QTemporaryDir folder;
    const std::string path = folder.filePath("melt.ply").toStdString();
    workbench.save_mesh(path);
    workbench.wait_until_idle();
    const auto saved = read_mesh(path, RunContext());
    ASSERT_TRUE(saved);
    EXPECT_EQ(saved->mesh.vertex_count(), workbench.melt_surface()->vertex_count());

    // Nothing is lost by a change of the air; at the start there is the mesh again, also once that is undone.
    const std::size_t frames = workbench.frame_count();
    workbench.freeze();
    workbench.pause();
    EXPECT_GE(workbench.frame_count(), frames);
    workbench.document().undo_stack().undo();
    workbench.go_to_frame(0);
    EXPECT_EQ(workbench.melt_surface(), nullptr);
}

TEST(Pointer, ThePinToolPinsAndUnpins) {
    Stand stand;
    ASSERT_TRUE(stand.is_ready());
    stand.set([](ViewSettings& s) { s.tool = &kPinTool; });
    const auto pinned = [&] {
        std::size_t count = 0;
        for (const Handle& handle : stand.workbench.state().handles)
            if (handle.pinned) count += handle.vertices.size();
        return count;
    };
    stand.drag(stand.middle(), stand.middle() + QPoint(30, 0));
    const std::size_t some = pinned();
    EXPECT_GT(some, 0u);
    EXPECT_LT(some, stand.workbench.state().model->driver().vertices.size());
    EXPECT_EQ(
        stand.workbench.document().undo_stack().text(stand.workbench.document().undo_stack().index() - 1).isEmpty(),
        false);
    const auto* overlay = stand.viewport->findChild<QWidget*>("viewport.overlay");
    ASSERT_TRUE(overlay);
    EXPECT_EQ(static_cast<const Overlay*>(overlay)->content().pins.size(), some);
    stand.drag(stand.middle(), stand.middle() + QPoint(30, 0), Qt::LeftButton, Qt::ControlModifier);
    EXPECT_EQ(pinned(), 0u);
}

TEST(Pointer, ADragKeepsTheToolItBeganWith) {
    Stand stand;
    ASSERT_TRUE(stand.is_ready());
    const QPoint from = stand.middle(), to = from + QPoint(30, 0);
    stand.press(from);
    stand.move(from, to);
    stand.set([](ViewSettings& s) { s.tool = &kPinTool; });
    EXPECT_TRUE(stand.workbench.is_pulling());
    stand.release(to);
    stand.workbench.wait_until_idle();
    ASSERT_EQ(stand.workbench.state().handles.size(), 1u);
    EXPECT_FALSE(stand.workbench.state().handles[0].pinned);
    ASSERT_TRUE(stand.is_ready());
    stand.drag(from, to);
    ASSERT_EQ(stand.workbench.state().handles.size(), 2u);
    EXPECT_TRUE(stand.workbench.state().handles[1].pinned);
}

TEST(Pointer, ADragPullsABody) {
    Stand stand("wavy-sphere", 16);
    ASSERT_TRUE(stand.is_ready());
    BodySettings body = stand.workbench.state().body;
    body.particles = 300;
    body.gravity = false;
    stand.workbench.set_body(body);
    stand.workbench.make_body();
    stand.workbench.wait_until_idle();
    stand.workbench.set_mode(Mode::body);
    ASSERT_TRUE(stand.workbench.playback().has_body());
    ASSERT_TRUE(stand.is_ready());
    stand.viewport->show_all();
    const auto grabbed = stand.viewport->pick(stand.middle());
    ASSERT_TRUE(grabbed);
    const QPointF before = stand.viewport->place_of(stand.place_of_vertex(grabbed->vertex));
    const QPoint to = stand.middle() + QPoint(-60, 0);
    stand.press(stand.middle());
    stand.move(stand.middle(), to);
    EXPECT_TRUE(stand.workbench.playback().is_grabbed());
    const bool came = QTest::qWaitFor(
        [&] { return stand.viewport->place_of(stand.place_of_vertex(grabbed->vertex)).x() < before.x() - 25; },
        kPatience);
    EXPECT_TRUE(came) << "the body does not follow the pointer";
    const auto* overlay = static_cast<const Overlay*>(stand.viewport->findChild<QWidget*>("viewport.overlay"));
    EXPECT_TRUE(overlay->content().pull) << "a line shows what pulls";
    stand.release(to);
    EXPECT_FALSE(stand.workbench.playback().is_grabbed());
    stand.workbench.pause();
    stand.workbench.wait_until_idle();
}

TEST(Pointer, GizmosDragTheWarps) {
    Stand stand;
    ASSERT_TRUE(stand.is_ready());
    stand.set([](ViewSettings& s) { s.gizmos = true; });
    const Box box = world_bounds(stand.workbench.state().source->mesh);
    stand.workbench.view().set_zoom(0.6);
    const State before = stand.workbench.document().state();
    const auto steps = stand.workbench.document().undo_stack().index();
    for (const GizmoShape& shape : gizmo_shapes({}, box)) {
        const QPoint at = stand.viewport->place_of(shape.knob).toPoint();
        ASSERT_TRUE(stand.viewport->rect().contains(at));
        QPointF way = stand.viewport->place_of(shape.line.back()) - stand.viewport->place_of(shape.line.front());
        if (shape.part == WarpKind::twist) {
            const QPointF next = stand.viewport->place_of(shape.line[2]);
            way = next - stand.viewport->place_of(shape.knob);
        }
        way *= 25 / std::hypot(way.x(), way.y());
        stand.drag(at, at + way.toPoint());
        const Warps& warps = stand.workbench.state().warps;
        const int changed =
            (warps.stretch != 1) + (warps.squeeze != 1) + (warps.bend != 0) + (warps.twist != 0) + (warps.taper != 1);
        EXPECT_EQ(changed, 1) << static_cast<int>(shape.part);
        EXPECT_TRUE(warps.stretch == 1 || warps.stretch > 1.1);
        EXPECT_TRUE(warps.squeeze == 1 || warps.squeeze < 0.9) << "wider, so shorter";
        EXPECT_TRUE(warps.taper == 1 || warps.taper > 1.1);
        EXPECT_TRUE(warps.bend == 0 || warps.bend > 10);
        EXPECT_TRUE(warps.twist == 0 || warps.twist > 10);
        EXPECT_EQ(stand.workbench.document().undo_stack().index(), steps + 1) << "one drag is one step";
        stand.workbench.document().undo_stack().undo();
        EXPECT_TRUE(stand.workbench.document().state() == before);
    }
}

TEST(Pointer, EscapeOnAKnobThatWasNotMovedUndoesNothing) {
    Stand stand;
    ASSERT_TRUE(stand.is_ready());
    stand.set([](ViewSettings& s) { s.gizmos = true; });
    stand.workbench.view().set_zoom(0.6);
    Warps warps;
    warps.taper = 1.2;
    stand.workbench.set_warps(warps);
    stand.workbench.wait_until_idle();
    const int step = stand.workbench.document().undo_stack().index();
    const Camera& camera = stand.workbench.view().camera();
    const Box box = world_bounds(stand.workbench.state().source->mesh);
    const GizmoShape shape = gizmo_shapes(warps, box, camera.eye - camera.target)[0];
    const QPoint at = stand.viewport->place_of(shape.knob).toPoint();
    stand.press(at);
    QTest::keyClick(stand.viewport, Qt::Key_Escape);
    stand.release(at);
    EXPECT_EQ(stand.workbench.document().undo_stack().index(), step);
    EXPECT_EQ(stand.workbench.state().warps, warps);
    stand.press(at);
    stand.move(at, at + QPoint(0, -25));
    EXPECT_FALSE(stand.workbench.state().warps == warps);
    QTest::keyClick(stand.viewport, Qt::Key_Escape);
    stand.release(at);
    EXPECT_EQ(stand.workbench.document().undo_stack().index(), step);
    EXPECT_EQ(stand.workbench.state().warps, warps);
}

TEST(Pointer, ADragEndsWithTheModelThatItIsOf) {
    Stand stand;
    ASSERT_TRUE(stand.is_ready());
    const auto strip_again = [&](std::size_t vertices) {
        StripOptions options;
        options.base = vertices;
        stand.workbench.set_strip(options);
        stand.workbench.wait_until_idle();
    };
    for (const ToolEntry* const tool : {&kPinTool, &kPullTool}) {
        stand.set([&](ViewSettings& s) { s.tool = tool; });
        ASSERT_TRUE(stand.is_ready());
        const QPoint from = stand.middle(), to = from + QPoint(30, 0);
        stand.press(from);
        if (tool == &kPinTool) stand.move(from, to);
        strip_again(tool == &kPinTool ? 20 : 30);
        const State before = stand.workbench.document().state();
        stand.move(from, to);
        stand.release(to);
        stand.workbench.wait_until_idle();
        EXPECT_TRUE(stand.workbench.state().handles.empty());
        EXPECT_TRUE(stand.workbench.document().state() == before);
    }
}

} // namespace
