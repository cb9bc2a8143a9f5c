// What the picture shows.
#include "coloring.h"
#include "viewport_stand.h"

#include "overlay.h"

#include "filigree/mesh.h"

#include <QFile>
#include <QProcess>
#include <QTemporaryDir>

#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>

using namespace filigree;
using namespace filigree::studio;

namespace {

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
    stand.set([](ViewSettings& s) { s.coloring = &kExpectedErrorColors; });
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
