// What the mouse does in the picture, and what the picture shows.
#include "viewport.h"

#include "drawn_objects.h"
#include "overlay.h"

#include "studio/materials.h"

#include "filigree/io/mesh_file.h"
#include "filigree/mesh/shapes.h"

#include <QApplication>
#include <QFile>
#include <QMouseEvent>
#include <QProcess>
#include <QTemporaryDir>
#include <QTest>
#include <QVBoxLayout>
#include <QWheelEvent>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <functional>

#include <gtest/gtest.h>

using namespace filigree;
using namespace filigree::studio;

namespace {

constexpr int kPatience = 20'000; // ms

/// A viewport with a bumpy ball, shown and drawn.
struct Stand {
    Workbench workbench;
    QWidget window;
    Viewport* viewport = nullptr;

    explicit Stand(const std::string& shape = "wavy-cube", unsigned resolution = 24) {
        ShapeOptions options;
        options.resolution = resolution;
        workbench.make_shape({shape, options});
        workbench.wait_until_idle();
        viewport = new Viewport(workbench, &window);
        viewport->set_animated(false);
        auto* layout = new QVBoxLayout(&window);
        layout->setContentsMargins(0, 0, 0, 0);
        layout->addWidget(viewport);
        window.resize(360, 300);
        window.show();
    }
    ~Stand() { delete viewport; }

    bool is_drawn() {
        return QTest::qWaitFor([&] { return viewport->is_ready() && viewport->is_still(); }, kPatience);
    }
    bool is_ready() {
        return QTest::qWaitFor([&] { return viewport->is_ready(); }, kPatience);
    }
    QPoint middle() const { return viewport->rect().center(); }
    QImage picture() {
        viewport->finish_drawing();
        return viewport->grabFramebuffer();
    }
    void set(const std::function<void(ViewSettings&)>& change) {
        ViewSettings settings = workbench.view().settings();
        change(settings);
        workbench.view().set(settings);
    }
    void drag(const QPoint& from, const QPoint& to, Qt::MouseButton button = Qt::LeftButton,
              Qt::KeyboardModifiers keys = {}) {
        press(from, button, keys);
        move(from, to, button);
        release(to, button);
    }
    void press(const QPoint& at, Qt::MouseButton button = Qt::LeftButton, Qt::KeyboardModifiers keys = {}) {
        QTest::mousePress(viewport, button, keys, at);
    }
    void move(const QPoint& from, const QPoint& to, Qt::MouseButton button = Qt::LeftButton) {
        constexpr int kSteps = 8;
        for (int i = 1; i <= kSteps; ++i) {
            const QPointF at = QPointF(from) + QPointF(to - from) * i / kSteps;
            QMouseEvent event(QEvent::MouseMove, at, viewport->mapToGlobal(at), Qt::NoButton, button, {});
            QApplication::sendEvent(viewport, &event);
            QApplication::processEvents();
        }
    }
    void release(const QPoint& at, Qt::MouseButton button = Qt::LeftButton) {
        QTest::mouseRelease(viewport, button, {}, at);
    }
    void wheel(const QPoint& at, int notches) {
        for (int i = 0; i < std::abs(notches); ++i) {
            QWheelEvent event(at, viewport->mapToGlobal(at), {}, {0, notches > 0 ? 120 : -120}, Qt::NoButton, {},
                              Qt::NoScrollPhase, false);
            QApplication::sendEvent(viewport, &event);
        }
    }
    /// Where a vertex of the finest mesh is now.
    Vec3d place_of_vertex(Index vertex) {
        const State& state = workbench.state();
        const Pose* pose = workbench.pose();
        if (!pose) return state.model->mesh.world_position(vertex);
        const Restorer restorer = Restorer::create(*state.model, {}, RunContext()).value();
        return state.model->mesh.origin + restorer.positions(*pose, RunContext()).value()[vertex].cast<double>();
    }
};

double distance(const QPointF& a, const QPointF& b) { return std::hypot(a.x() - b.x(), a.y() - b.y()); }

/// The mean difference of two pictures' colours, 0 to 255, within a rectangle.
double difference(const QImage& a, const QImage& b, const QRect& within) {
    double sum = 0;
    for (int y = within.top(); y <= within.bottom(); ++y)
        for (int x = within.left(); x <= within.right(); ++x) {
            const QRgb p = a.pixel(x, y), q = b.pixel(x, y);
            sum += std::abs(qRed(p) - qRed(q)) + std::abs(qGreen(p) - qGreen(q)) + std::abs(qBlue(p) - qBlue(q));
        }
    return sum / (3.0 * within.width() * within.height());
}

TEST(Viewport, ShowsAModelOfFewerLevels) {
    Stand stand("torus", 64);
    ASSERT_TRUE(stand.is_drawn());
    const unsigned before = stand.workbench.state().model->finest_level();
    stand.workbench.set_strip({.base = 3000});
    stand.workbench.wait_until_idle();
    ASSERT_LT(stand.workbench.state().model->finest_level(), before);
    EXPECT_TRUE(stand.is_drawn()) << "the model before has a level of that number too";
}

TEST(Viewport, PicksWhatItProjects) {
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

TEST(Viewport, ADragOnTheShapePullsIt) {
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
TEST(Viewport, WhatIsGrabbedStaysUnderThePointer) {
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
                EXPECT_LT(distance(after - before, way), 2)
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

TEST(Viewport, EscapePutsBack) {
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

TEST(Viewport, AClickChangesNothing) {
    Stand stand;
    ASSERT_TRUE(stand.is_ready());
    const State before = stand.workbench.document().state();
    const Camera camera = stand.workbench.view().camera();
    QTest::mouseClick(stand.viewport, Qt::LeftButton, {}, stand.middle());
    EXPECT_TRUE(stand.workbench.document().state() == before);
    EXPECT_EQ(stand.workbench.view().camera().eye, camera.eye);
}

TEST(Viewport, ADragBesideTheShapeTurnsAndTheWheelZooms) {
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

TEST(Viewport, TheTorchMeltsABodyUnderTheMouse) {
    Stand stand("wavy-sphere");
    ASSERT_TRUE(stand.is_ready());
    Workbench& workbench = stand.workbench;
    QStringList told;
    QObject::connect(&workbench, &Workbench::told, [&](const QString& sentence) { told << sentence; });
    stand.set([](ViewSettings& s) { s.tool = Tool::torch; });
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
    stand.set([](ViewSettings& s) { s.coloring = Coloring::heat; });
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

TEST(Viewport, ThePinToolPinsAndUnpins) {
    Stand stand;
    ASSERT_TRUE(stand.is_ready());
    stand.set([](ViewSettings& s) { s.tool = Tool::pin; });
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

TEST(Viewport, ADragPullsABody) {
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

TEST(Viewport, ABodyAndTheGroundBelowItAreInThePicture) {
    Stand stand("wavy-sphere", 16);
    ASSERT_TRUE(stand.is_ready());
    ViewState& view = stand.workbench.view();
    const Camera before = view.camera();
    BodySettings body = stand.workbench.state().body;
    body.particles = 300;
    body.drop = 1;
    stand.workbench.set_body(body);
    stand.workbench.make_body();
    stand.workbench.wait_until_idle();
    const auto made = stand.workbench.playback().made();
    ASSERT_TRUE(made && made->surroundings.has_ground);
    const auto is_seen = [&](const Vec3d& place) {
        return stand.viewport->rect().contains(stand.viewport->place_of(place).toPoint());
    };
    const Vec3d ground(0, made->surroundings.ground_level, 0);
    EXPECT_TRUE(is_seen(ground)) << made->surroundings.ground_level;
    EXPECT_TRUE(is_seen(Vec3d(0, 0.5, 0)));
    const auto direction = [](const Camera& camera) { return (camera.eye - camera.target).normalized(); };
    EXPECT_LT((direction(view.camera()) - direction(before)).norm(), 1e-9);
    EXPECT_GT((view.camera().eye - view.camera().target).norm(), (before.eye - before.target).norm());

    // What is far enough away stays where it is; what shows all shows the ground too.
    view.set_zoom(0.5);
    const Camera far = view.camera();
    stand.workbench.make_body();
    stand.workbench.wait_until_idle();
    EXPECT_EQ(view.camera().eye, far.eye);
    stand.viewport->show_all();
    EXPECT_TRUE(is_seen(ground));
    EXPECT_TRUE(is_seen(Vec3d(0, 0.5, 0)));
}

TEST(Viewport, PointsInsideAreSeenAndFollowThePose) {
    Stand stand("wavy-cube", 16);
    stand.window.resize(220, 180);
    ASSERT_TRUE(stand.is_ready());
    stand.set([](ViewSettings& s) { s.clip = true; });
    const QImage without = stand.picture();
    stand.set([](ViewSettings& s) {
        s.inside_points = true;
        s.inside_count = 500;
    });
    stand.workbench.wait_until_idle();
    // Balls that are much bluer than anything else here.
    const auto blue = [](const QImage& picture) {
        std::size_t count = 0;
        for (int y = 0; y < picture.height(); ++y)
            for (int x = 0; x < picture.width(); ++x)
                count += qBlue(picture.pixel(x, y)) > qRed(picture.pixel(x, y)) + 40;
        return count;
    };
    const QImage rest = stand.picture();
    EXPECT_EQ(blue(without), 0u);
    EXPECT_GT(blue(rest), 700u);
    Warps warps;
    warps.stretch = 0.4;
    stand.workbench.set_warps(warps);
    stand.workbench.wait_until_idle();
    const QImage flat = stand.picture();
    EXPECT_GT(blue(flat), 250u);
    const auto height = [](const QImage& picture) { // of what is blue
        int first = picture.height(), last = 0;
        for (int y = 0; y < picture.height(); ++y)
            for (int x = 0; x < picture.width(); ++x)
                if (qBlue(picture.pixel(x, y)) > qRed(picture.pixel(x, y)) + 40) {
                    first = std::min(first, y);
                    last = std::max(last, y);
                }
        return last - first;
    };
    EXPECT_LT(height(flat), 0.8 * height(rest)) << "they stayed behind";
}

TEST(Viewport, SplitShowsThreePictures) {
    Stand stand;
    stand.window.resize(480, 240);
    ASSERT_TRUE(stand.is_ready());
    Warps warps;
    warps.twist = 60;
    stand.workbench.set_warps(warps);
    stand.set([](ViewSettings& s) { s.split = true; });
    stand.workbench.wait_until_idle();
    const auto* overlay = static_cast<const Overlay*>(stand.viewport->findChild<QWidget*>("viewport.overlay"));
    ASSERT_TRUE(QTest::qWaitFor([&] { return stand.viewport->is_still(); }, kPatience));
    const QImage picture = stand.picture();
    ASSERT_EQ(overlay->content().captions.size(), 3u);
    EXPECT_EQ(overlay->content().captions[0].title, "Driver");
    const int width = picture.width() / 3;
    const QImage tiles[3] = {picture.copy(0, 0, width, picture.height()),
                             picture.copy(width, 0, width, picture.height()),
                             picture.copy(2 * width, 0, width, picture.height())};
    const QRect all = tiles[0].rect();
    // Each shows the shape; the driver is rougher than what is restored, which is nearly the full deformation.
    const double driver = difference(tiles[0], tiles[1], all), full = difference(tiles[1], tiles[2], all);
    EXPECT_GT(driver, 2 * full);
    EXPECT_GT(full, 0);
    EXPECT_LT(full, 4);
    for (const QImage& tile : tiles)
        EXPECT_GT(std::abs(qGray(tile.pixel(tile.width() / 2, tile.height() / 2)) - qGray(tile.pixel(3, 3))), 8);
    // What is under the pointer is the same in each of them.
    const QPoint at(width / 2, picture.height() / 2);
    const auto left = stand.viewport->pick(at), right = stand.viewport->pick(at + QPoint(2 * width, 0));
    ASSERT_TRUE(left && right);
    EXPECT_LT((left->at - right->at).norm(), 0.05);
}

TEST(Viewport, TheLevelFollowsTheDistance) {
    Stand stand("wavy-cube", 32);
    stand.window.resize(220, 180);
    ASSERT_TRUE(stand.is_ready());
    ASSERT_GE(stand.workbench.state().model->finest_level(), 1u);
    stand.set([](ViewSettings& s) {
        s.level_by_distance = true;
        s.keep_up = false;
    });
    stand.viewport->finish_drawing(); // all levels are there, and measured
    bool is_drawn = false;
    QObject::connect(stand.viewport, &Viewport::timings_changed, stand.viewport,
                     [&] { is_drawn = stand.viewport->timings().part == 1; });
    ViewState& view = stand.workbench.view();
    std::vector<std::size_t> counts;
    std::vector<unsigned> levels;
    for (const double zoom : {8.0, 1.0, 0.12, 0.03, 0.12, 1.0, 8.0}) {
        is_drawn = false;
        view.set_zoom(zoom);
        ASSERT_TRUE(QTest::qWaitFor([&] { return is_drawn; }, kPatience));
        counts.push_back(stand.viewport->timings().vertices);
        levels.push_back(stand.viewport->timings().level);
    }
    EXPECT_EQ(levels.front(), stand.workbench.state().level());
    EXPECT_TRUE(std::is_sorted(counts.rbegin() + 3, counts.rend()));
    EXPECT_TRUE(std::is_sorted(counts.begin() + 3, counts.end()));
    EXPECT_LT(levels[3], levels[0]);
    EXPECT_LT(counts[3], counts[0] / 3);
    EXPECT_EQ(counts.back(), counts.front());
    stand.set([](ViewSettings& s) { s.level_by_distance = false; });
    view.set_zoom(0.03);
    stand.viewport->finish_drawing();
    EXPECT_EQ(stand.viewport->timings().vertices, counts.front()) << "switched off";
}

/// One level melts into the other while pictures are drawn, and over the change the pictures differ from each other as
/// they do where there is none.
TEST(Viewport, LevelsChangeWithoutPops) {
    Stand stand("wavy-cube", 32);
    stand.window.resize(200, 160);
    stand.set([](ViewSettings& s) { s.level_by_distance = true; });
    ViewState& view = stand.workbench.view();
    ASSERT_TRUE(stand.is_drawn());
    const auto level = [&] { return stand.viewport->timings().level; };
    std::vector<double> parts;
    QObject::connect(stand.viewport, &Viewport::timings_changed, stand.viewport,
                     [&] { parts.push_back(stand.viewport->timings().part); });
    double zoom = 1;
    const unsigned finest = level();
    for (; zoom > 0.02 && level() == finest; zoom *= 0.8) {
        parts.clear();
        view.set_zoom(zoom);
        ASSERT_TRUE(QTest::qWaitFor([&] { return !parts.empty(); }, kPatience));
    }
    ASSERT_LT(level(), finest);
    ASSERT_TRUE(QTest::qWaitFor([&] { return parts.back() == 1; }, kPatience));
    EXPECT_TRUE(std::is_sorted(parts.begin(), parts.end()));
    EXPECT_GT(std::count_if(parts.begin(), parts.end(), [](double part) { return part > 0 && part < 1; }), 0)
        << "the level pops";

    // Whole pictures, before and after the change.
    zoom /= 0.8;
    std::vector<QImage> pictures;
    for (const double factor : {1.5, 1.35, 1.21, 1.0}) {
        view.set_zoom(zoom * factor);
        pictures.push_back(stand.picture());
    }
    const auto step = [&](std::size_t i) { return difference(pictures[i - 1], pictures[i], pictures[i].rect()); };
    EXPECT_LT(step(3), 1.5 * std::max(step(1), step(2)) + 0.3);
}

TEST(Viewport, GizmosDragTheWarps) {
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
        if (shape.part == GizmoPart::twist) {
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

TEST(Viewport, EscapeOnAKnobThatWasNotMovedUndoesNothing) {
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

TEST(Viewport, ADragEndsWithTheModelThatItIsOf) {
    Stand stand;
    ASSERT_TRUE(stand.is_ready());
    const auto strip_again = [&](std::size_t vertices) {
        StripOptions options;
        options.base = vertices;
        stand.workbench.set_strip(options);
        stand.workbench.wait_until_idle();
    };
    for (const Tool tool : {Tool::pin, Tool::pull}) {
        stand.set([&](ViewSettings& s) { s.tool = tool; });
        ASSERT_TRUE(stand.is_ready());
        const QPoint from = stand.middle(), to = from + QPoint(30, 0);
        stand.press(from);
        if (tool == Tool::pin) stand.move(from, to);
        strip_again(tool == Tool::pin ? 20 : 30);
        const State before = stand.workbench.document().state();
        stand.move(from, to);
        stand.release(to);
        stand.workbench.wait_until_idle();
        EXPECT_TRUE(stand.workbench.state().handles.empty());
        EXPECT_TRUE(stand.workbench.document().state() == before);
    }
}

TEST(Viewport, AModelThatWasPosedIsSeenWhole) {
    Stand stand("wavy-cube", 12);
    ASSERT_TRUE(stand.is_ready());
    Warps warps;
    warps.stretch = 4;
    stand.workbench.set_warps(warps);
    QTemporaryDir folder;
    const std::string path = folder.filePath("long.fil").toStdString();
    stand.workbench.save_model(path);
    stand.workbench.wait_until_idle();
    stand.workbench.open(path);
    stand.workbench.wait_until_idle();
    const Pose* pose = stand.workbench.pose();
    ASSERT_TRUE(pose);
    const Vec3d origin = stand.workbench.state().model->mesh.origin;
    for (const Vec3f& place : pose->positions) {
        const QPointF at = stand.viewport->place_of(origin + place.cast<double>());
        ASSERT_TRUE(QRectF(stand.viewport->rect()).contains(at)) << at.x() << " " << at.y();
    }
}

TEST(Viewport, APoseTooCurvedForTheDriverIsSaidInThePicture) {
    Stand stand;
    ASSERT_TRUE(stand.is_ready());
    stand.workbench.set_strip({.base = 60});
    stand.workbench.wait_until_idle();
    const auto* overlay = static_cast<const Overlay*>(stand.viewport->findChild<QWidget*>("viewport.overlay"));
    EXPECT_EQ(overlay->content().warning, "");
    Warps warps;
    warps.bend = 170;
    stand.workbench.set_warps(warps);
    stand.workbench.wait_until_idle();
    ASSERT_TRUE(stand.is_drawn());
    EXPECT_EQ(overlay->content().warning, stand.workbench.expected_error().warning());
    EXPECT_NE(overlay->content().warning, "");
    EXPECT_FALSE(overlay->content().legend);

    const QRect corner(14, stand.viewport->height() - 150, 200, 60);
    const QImage with = stand.window.grab().toImage();
    stand.set([](ViewSettings& s) { s.coloring = Coloring::expected_error; });
    stand.workbench.wait_until_idle();
    ASSERT_TRUE(stand.is_drawn());
    ASSERT_TRUE(overlay->content().legend);
    EXPECT_EQ(overlay->content().legend->title, "Expected error");
    EXPECT_EQ(overlay->content().legend->unit, "% of the diagonal");
    EXPECT_EQ(overlay->content().legend->per_value, 100);
    stand.workbench.reset_deformation();
    EXPECT_EQ(overlay->content().warning, "") << "at once: the shape is at rest";
    stand.workbench.wait_until_idle();
    ASSERT_TRUE(stand.is_drawn());
    EXPECT_GT(difference(with, stand.window.grab().toImage(), corner), 2) << "it is not painted";
    EXPECT_EQ(stand.viewport->timings().restore, 0) << "at rest nothing is restored";

    stand.workbench.set_strip({.code = DetailCode::reference});
    stand.workbench.wait_until_idle();
    ASSERT_TRUE(stand.is_drawn());
    EXPECT_FALSE(overlay->content().legend);
    EXPECT_TRUE(overlay->content().note.contains("blend code")) << overlay->content().note.toStdString();
}

TEST(Viewport, MeshesWithoutFacesOrExtentAreSeenAndSaidSo) {
    Stand stand("wavy-cube", 8);
    ASSERT_TRUE(stand.is_ready());
    const auto* overlay = static_cast<const Overlay*>(stand.viewport->findChild<QWidget*>("viewport.overlay"));
    QTemporaryDir folder;
    const auto open = [&](const char* name, const char* text) {
        QFile file(folder.filePath(name));
        ASSERT_TRUE(file.open(QIODevice::WriteOnly));
        file.write(text);
        file.close();
        stand.workbench.open(folder.filePath(name).toStdString());
        stand.workbench.wait_until_idle();
        ASSERT_EQ(stand.workbench.state().source->name, name);
        ASSERT_TRUE(stand.is_ready());
        stand.viewport->finish_drawing();
    };
    open("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 1 1 1\n");
    EXPECT_TRUE(overlay->content().note.contains("no faces")) << overlay->content().note.toStdString();
    open("one.obj", "v 1000 0 0\n");
    EXPECT_TRUE(overlay->content().note.contains("one place")) << overlay->content().note.toStdString();
    EXPECT_LT(distance(stand.viewport->place_of(Vec3d(1000, 0, 0)), stand.middle()), 40);
    EXPECT_GT((stand.workbench.view().camera().eye - Vec3d(1000, 0, 0)).norm(), 0.1);
}

/// What a computer whose OpenGL is too old shows: runs in a process of its own, below.
TEST(Viewport, WithoutOpenGlChild) {
    if (!std::getenv("FILIGREE_TEST_WITHOUT_OPENGL")) GTEST_SKIP() << "for WithoutOpenGlItSaysSo";
    Stand stand;
    ASSERT_TRUE(QTest::qWaitFor([&] { return !stand.viewport->trouble().empty(); }, kPatience));
    EXPECT_NE(stand.viewport->trouble().find("OpenGL"), std::string::npos);
    stand.drag(stand.middle(), stand.middle() + QPoint(50, 0));
    stand.wheel(stand.middle(), 2);
    stand.viewport->show_all();
    stand.viewport->finish_drawing();
    EXPECT_FALSE(stand.viewport->pick(stand.middle()));
    // The sentence can be read: not all of the picture has one colour.
    const QImage picture = stand.window.grab().toImage();
    std::size_t others = 0;
    for (int y = 0; y < picture.height(); ++y)
        for (int x = 0; x < picture.width(); ++x) others += picture.pixel(x, y) != picture.pixel(0, 0);
    EXPECT_GT(others, 200u);
}

TEST(Viewport, WithoutOpenGlItSaysSo) {
    QProcess child;
    QProcessEnvironment environment = QProcessEnvironment::systemEnvironment();
    environment.insert("FILIGREE_TEST_WITHOUT_OPENGL", "1");
    // Not on Qt's offscreen platform: without OpenGL it falls over any QOpenGLWidget (Qt 6.4, rhiFlush).
    environment.insert("MESA_GL_VERSION_OVERRIDE", "3.3");
    child.setProcessEnvironment(environment);
    child.start(QApplication::applicationFilePath(), {"--gtest_filter=Viewport.WithoutOpenGlChild"});
    ASSERT_TRUE(child.waitForFinished(60'000));
    EXPECT_EQ(child.exitStatus(), QProcess::NormalExit);
    EXPECT_EQ(child.exitCode(), 0) << child.readAllStandardOutput().toStdString();
}

} // namespace
