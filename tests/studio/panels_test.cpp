#include "coloring.h"
#include "one_window.h"
#include "panel.h"

#include <QApplication>
#include <QScrollBar>
#include <QSet>
#include <QTabBar>
#include <QTemporaryDir>
#include <QTest>

#include <fstream>

#include <gtest/gtest.h>

using namespace filigree;
using namespace filigree::studio;

namespace {

class Panels : public OneWindow {
protected:
    static void SetUpTestSuite() {
        OneWindow::SetUpTestSuite();
        window->show();
        ASSERT_TRUE(QTest::qWaitForWindowExposed(window));
    }
    static const State& state() { return workbench().state(); }
    static int steps() { return workbench().document().undo_stack().index(); }

    template <class T>
    static T& get(const char* name) {
        T* const widget = window->findChild<T*>(name);
        if (!widget) throw std::runtime_error(std::string("no control ") + name);
        return *widget;
    }
    /// Types a number as a hand would.
    static void type(const char* name, const char* text) {
        auto& number = get<QDoubleSpinBox>((std::string(name) + ".number").c_str());
        number.selectAll();
        QTest::keyClicks(&number, text);
        QTest::keyClick(&number, Qt::Key_Return);
        workbench().wait_until_idle();
    }
    static void choose(const char* name, int index) {
        get<QComboBox>(name).setCurrentIndex(index);
        workbench().wait_until_idle();
    }
};

bool is_control(const QWidget* widget) {
    return qobject_cast<const QAbstractSlider*>(widget) || qobject_cast<const QAbstractSpinBox*>(widget) ||
           qobject_cast<const QComboBox*>(widget) || qobject_cast<const QAbstractButton*>(widget) ||
           qobject_cast<const QTabBar*>(widget);
}

/// Parts that Qt's own widgets are made of.
bool is_qts_own(const QWidget* widget) {
    return widget->objectName().startsWith("qt_") || qobject_cast<const QScrollBar*>(widget) ||
           qobject_cast<const QTabBar*>(widget->parentWidget()) ||
           (widget->parentWidget() && widget->parentWidget()->inherits("QComboBoxPrivateContainer"));
}

} // namespace

TEST_F(Panels, EveryControlIsNamedAndExplained) {
    std::set<QString> names;
    int controls = 0;
    for (const QWidget* widget : window->findChildren<QWidget*>()) {
        if (!is_control(widget) || is_qts_own(widget)) continue;
        ++controls;
        const std::string name = widget->objectName().toStdString();
        EXPECT_FALSE(name.empty()) << widget->metaObject()->className();
        EXPECT_TRUE(names.insert(widget->objectName()).second) << name << " is there twice";
        EXPECT_FALSE(widget->accessibleName().isEmpty()) << name;
        const auto* tabs = qobject_cast<const QTabBar*>(widget);
        EXPECT_FALSE((tabs ? tabs->tabToolTip(0) : widget->toolTip()).isEmpty()) << name;
        EXPECT_NE(widget->focusPolicy(), Qt::NoFocus) << name << " cannot be reached by keyboard";
    }
    EXPECT_GT(controls, 90);
}

TEST_F(Panels, NumbersReachTheWorkbench) {
    struct Case {
        const char *name, *text;
        std::function<double()> get;
        double expected;
    };
    const Case cases[] = {
        {"deform.stretch", "1.5", [] { return state().warps.stretch; }, 1.5},
        {"deform.squeeze", "0.5", [] { return state().warps.squeeze; }, 0.5},
        {"deform.bend", "-45", [] { return state().warps.bend; }, -45},
        {"deform.twist", "90", [] { return state().warps.twist; }, 90},
        {"deform.taper", "2", [] { return state().warps.taper; }, 2},
        {"deform.grip", "10", [] { return workbench().view().settings().grip; }, 0.1},
        {"deform.reach", "80", [] { return workbench().view().settings().reach; }, 0.8},
        {"detail.level", "0", [] { return double(state().level()); }, 0},
        {"body.young", "20 k", [] { return state().body.material.young_modulus; }, 20e3},
        {"body.young", "1.5 MPa", [] { return state().body.material.young_modulus; }, 1.5e6},
        {"body.density", "800", [] { return state().body.material.density; }, 800},
        {"body.particles", "500", [] { return double(state().body.particles); }, 500},
        {"body.size", "0.3", [] { return state().body.size; }, 0.3},
        {"body.drop_height", "1.25", [] { return state().body.drop; }, 1.25},
        {"body.friction", "0.9", [] { return state().body.friction; }, 0.9},
        {"body.restitution", "0.2", [] { return state().body.restitution; }, 0.2},
        {"body.poisson", "0.3", [] { return state().body.material.poisson_ratio; }, 0.3},
        {"body.damping", "1.5", [] { return state().body.material.damping; }, 1.5},
        {"body.internal_damping", "0.002", [] { return state().body.material.internal_damping; }, 0.002},
        {"view.zoom", "2", [] { return workbench().view().zoom(); }, 2},
        {"view.point_count", "500", [] { return double(workbench().view().settings().inside_count); }, 500},
        {"view.clip_at", "25", [] { return workbench().view().settings().clip_at; }, 0.25},
    };
    for (const Case& c : cases) {
        type(c.name, c.text);
        EXPECT_NEAR(c.get(), c.expected, 1e-6 * std::abs(c.expected)) << c.name;
        auto& number = get<QDoubleSpinBox>((std::string(c.name) + ".number").c_str());
        EXPECT_FALSE(number.text().isEmpty());
    }
    EXPECT_EQ(state().body.preset, "custom"); // as the material was changed by hand
}

TEST_F(Panels, ShapesFollowTheirSliders) {
    type("model.resolution", "8");
    ASSERT_TRUE(state().shape);
    EXPECT_EQ(state().shape->options.resolution, 8u);
    EXPECT_EQ(state().model->mesh.vertex_count(), 6u * 64 + 2);
    type("model.frequency", "2");
    EXPECT_EQ(state().shape->options.frequency, 2);
    type("model.amplitude", "10");
    EXPECT_DOUBLE_EQ(state().shape->options.amplitude, 0.1);
    choose("model.shape", 3);
    EXPECT_EQ(state().shape->name, shape_names()[3]);
    type("model.length", "2");
    EXPECT_EQ(state().shape->options.length, 2);
    choose("model.shape", 5);
    type("model.thickness", "20");
    EXPECT_DOUBLE_EQ(state().shape->options.thickness, 0.2);
    type("model.size", "3");
    EXPECT_EQ(state().shape->options.size, 3);
    while (workbench().document().undo_stack().canUndo()) workbench().document().undo_stack().undo();
    EXPECT_TRUE(*state().shape == *start.shape);
    EXPECT_EQ(get<QComboBox>("model.shape").currentIndex(), 0);
    EXPECT_EQ(get<QDoubleSpinBox>("model.resolution.number").value(), 64);
}

TEST_F(Panels, ChoicesAndSwitchesReachTheWorkbench) {
    choose("deform.axis", 2);
    EXPECT_EQ(state().warps.axis, Axis::z);
    choose("body.preset", 2);
    EXPECT_EQ(state().body.preset, "jelly");
    choose("body.obstacle", 2);
    EXPECT_EQ(state().body.obstacle, ObstacleChoice::step);
    get<QCheckBox>("body.ground").click();
    EXPECT_FALSE(state().body.ground);
    get<QCheckBox>("body.gravity").click();
    EXPECT_FALSE(state().body.gravity);
    choose("body.model", 2);
    get<QCheckBox>("body.plastic").click();
    EXPECT_TRUE(state().body.material.is_plastic());
    type("body.yield", "5 k");
    EXPECT_DOUBLE_EQ(state().body.material.yield_stress, 5e3);
    get<QCheckBox>("body.melts").click();
    EXPECT_TRUE(state().body.material.melts());

    struct Case {
        const char* name;
        bool ViewSettings::*field;
    };
    for (const Case& c :
         {Case{"view.split", &ViewSettings::split}, Case{"view.driver", &ViewSettings::driver},
          Case{"view.inside_points", &ViewSettings::inside_points}, Case{"view.clip", &ViewSettings::clip},
          Case{"view.level_by_distance", &ViewSettings::level_by_distance},
          Case{"view.keep_up", &ViewSettings::keep_up}, Case{"view.ground", &ViewSettings::ground}}) {
        const bool before = workbench().view().settings().*c.field;
        get<QCheckBox>(c.name).click();
        EXPECT_NE(workbench().view().settings().*c.field, before) << c.name;
        get<QCheckBox>(c.name).click();
        EXPECT_EQ(workbench().view().settings().*c.field, before) << c.name;
    }
    choose("view.style", 2);
    EXPECT_EQ(workbench().view().settings().style, SurfaceStyle::wireframe);
    choose("view.coloring", 2);
    EXPECT_EQ(workbench().view().settings().coloring, &kLevelColors);
    choose("view.coloring", 4);
    EXPECT_EQ(workbench().view().settings().coloring, &kExpectedErrorColors);
    EXPECT_TRUE(get<QLabel>("view.error").isVisibleTo(get<QScrollArea>("view").widget()));
    choose("view.up", 2);
    EXPECT_EQ(workbench().view().settings().up, UpAxis::z);
    choose("view.clip_axis", 0);
    EXPECT_EQ(workbench().view().settings().clip_axis, 0);
}

TEST_F(Panels, ADragIsOneStep) {
    window->show_panel("deform");
    QCoreApplication::processEvents();
    auto& slider = get<QSlider>("deform.bend");
    const int y = slider.height() / 2;
    QTest::mousePress(&slider, Qt::LeftButton, {}, {slider.width() / 2, y});
    for (int x = 5; x <= 30; x += 5) {
        const QPoint at(slider.width() / 2 + x, y);
        QMouseEvent move(QEvent::MouseMove, at, slider.mapToGlobal(at), Qt::NoButton, Qt::LeftButton, {});
        QApplication::sendEvent(&slider, &move);
    }
    EXPECT_GT(state().warps.bend, 5); // while it is dragged
    QTest::mouseRelease(&slider, Qt::LeftButton, {}, {slider.width() / 2 + 30, y});
    workbench().wait_until_idle();
    EXPECT_EQ(steps(), 1);
    EXPECT_EQ(get<QDoubleSpinBox>("deform.bend.number").value(), state().warps.bend);
    workbench().document().undo_stack().undo();
    EXPECT_EQ(state().warps.bend, 0);
    EXPECT_EQ(get<QDoubleSpinBox>("deform.bend.number").value(), 0);
    EXPECT_EQ(steps(), 0); // showing what is undone is no new step
}

TEST_F(Panels, SlidersWorkByKeysAndGoBackByDoubleClick) {
    window->show_panel("deform");
    QCoreApplication::processEvents();
    auto& bend = get<QSlider>("deform.bend");
    QTest::keyClick(&bend, Qt::Key_Right);
    EXPECT_EQ(state().warps.bend, 1);
    QTest::keyClick(&bend, Qt::Key_Left);
    QTest::keyClick(&bend, Qt::Key_Left);
    EXPECT_EQ(state().warps.bend, -1);
    EXPECT_EQ(steps(), 3);
    QTest::mouseDClick(&bend, Qt::LeftButton, {}, bend.rect().center());
    EXPECT_EQ(state().warps.bend, 0);

    // Several positions of this slider mean one number, yet each key changes it.
    auto& count = get<QSlider>("body.particles");
    type("body.particles", "100");
    std::size_t before = state().body.particles;
    for (int k = 0; k < 20; ++k) {
        QTest::keyClick(&count, Qt::Key_Right);
        EXPECT_GT(state().body.particles, before);
        before = state().body.particles;
    }
}

TEST_F(Panels, AWheelOverAPanelChangesNothing) {
    window->viewport().setFocus();
    for (const char* name : {"deform.bend", "body.young", "model.resolution"}) {
        auto& slider = get<QSlider>(name);
        const int before = slider.value();
        QWheelEvent event({5, 5}, slider.mapToGlobal(QPointF(5, 5)), {}, {0, 120}, {}, {}, Qt::NoScrollPhase, false);
        QApplication::sendEvent(&slider, &event);
        EXPECT_EQ(slider.value(), before) << name;
    }
    EXPECT_EQ(steps(), 0);
}

TEST_F(Panels, DriverSizeStripsAgain) {
    type("detail.driver", "300");
    EXPECT_NEAR(double(state().model->driver().vertices.size()), 300, 30);
    const QString text = get<QLabel>("detail.report").text();
    EXPECT_TRUE(text.contains("move 24,578")) << text.toStdString();
    EXPECT_TRUE(get<QLabel>("detail.levels").text().contains("24,578 vertices"));
    EXPECT_TRUE(get<QLabel>("detail.shown").text().contains("24,578 vertices"));
}

TEST_F(Panels, AChangeKeepsTheOneThatIsStillBeingMade) {
    get<QDoubleSpinBox>("model.resolution.number").setValue(12);
    get<QDoubleSpinBox>("model.frequency.number").setValue(3);
    get<QDoubleSpinBox>("detail.driver.number").setValue(100);
    workbench().wait_until_idle();
    EXPECT_EQ(state().shape->options.resolution, 12u);
    EXPECT_EQ(state().shape->options.frequency, 3);
    EXPECT_EQ(state().strip.base, std::optional<std::size_t>(100));
}

TEST_F(Panels, TheDriverIsNoLargerThanTheMesh) {
    EXPECT_EQ(get<QDoubleSpinBox>("detail.driver.number").maximum(), 24578);
    type("model.resolution", "3");
    EXPECT_EQ(get<QDoubleSpinBox>("detail.driver.number").maximum(), double(state().model->mesh.vertex_count()));
    EXPECT_EQ(get<QDoubleSpinBox>("detail.driver.number").value(), double(state().model->driver().vertices.size()));
    while (state().level() > 0) workbench().remove_detail();
    EXPECT_FALSE(get<QPushButton>("overview.remove_detail").isEnabled());
}

TEST_F(Panels, SpacingIsAnotherWayToSayHowMany) {
    auto& spacing = get<QDoubleSpinBox>("body.spacing.number");
    type("body.particles", "1000");
    const double before = spacing.value();
    EXPECT_NEAR(before, 100, 15); // mm: a cube of nearly a metre
    type("body.spacing", "50");
    EXPECT_NEAR(double(state().body.particles), 1000 * std::pow(before / 50, 3), 100);
    type("body.size", "0.5");
    EXPECT_NEAR(spacing.value(), 25, 0.2);
    choose("model.shape", 2); // open: no volume
    EXPECT_TRUE(spacing.isHidden());
}

TEST_F(Panels, PointsHaveNoDefects) {
    QTemporaryDir folder;
    const QString path = folder.filePath("points.obj");
    std::ofstream(path.toStdString()) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
    workbench().open(path.toStdString());
    workbench().wait_until_idle();
    ASSERT_EQ(state().source->topology.faces, 0u);
    EXPECT_TRUE(get<QLabel>("model.verdict").text().startsWith("Points have no"));
    EXPECT_TRUE(get<QCheckBox>("view.defects").isHidden());
    EXPECT_FALSE(get<QPushButton>("overview.remove_detail").isEnabled()); // its driver has all of them
    const QStringList warnings = get<QLabel>("model.warnings").text().split('\n');
    EXPECT_EQ(QSet<QString>(warnings.begin(), warnings.end()).size(), warnings.size()); // each once
}

TEST_F(Panels, DefectsAreListed) {
    EXPECT_TRUE(get<QLabel>("model.verdict").text().contains("No defects"));
    choose("model.shape", 2); // the plane is open
    EXPECT_TRUE(get<QLabel>("model.defects").text().contains("256 open edges"))
        << get<QLabel>("model.defects").text().toStdString();
    get<QCheckBox>("view.defects").click();
    EXPECT_TRUE(workbench().view().settings().defects);
}

TEST_F(Panels, NothingIsCutOff) {
    window->viewport().setUpdatesEnabled(false); // its pictures do not matter here
    get<QToolButton>("body.advanced").setChecked(true);
    ViewSettings settings;
    settings.clip = settings.inside_points = true;
    settings.coloring = &kErrorColors;
    workbench().view().set(settings);
    choose("body.preset", 8); // wax: all of its rows
    for (const char* panel : {"model", "quads", "detail", "deform", "body", "fracture", "fit", "flesh", "view"}) {
        ASSERT_TRUE(window->show_panel(panel));
        for (int k = 0; k < 5; ++k) QCoreApplication::processEvents();
        const auto& area = get<QScrollArea>(panel);
        EXPECT_LE(area.widget()->minimumSizeHint().width(), area.viewport()->width()) << panel;
        for (const QWidget* widget : window->findChildren<QWidget*>()) {
            if (!widget->isVisible() || is_qts_own(widget)) continue;
            const auto* label = qobject_cast<const QLabel*>(widget);
            if (!label && !qobject_cast<const QAbstractButton*>(widget) &&
                !qobject_cast<const QAbstractSpinBox*>(widget))
                continue;
            const std::string name = widget->objectName().toStdString();
            if (label && label->wordWrap()) {
                EXPECT_LE(label->heightForWidth(label->width()), label->height()) << panel << ": " << name;
                continue;
            }
            if (qobject_cast<const ElidedText*>(widget)) continue;
            // the status bar makes room for a longer text a moment later
            EXPECT_TRUE(QTest::qWaitFor([&] { return widget->sizeHint().width() <= widget->width(); }))
                << panel << ": " << name << " " << widget->sizeHint().width() << " in " << widget->width();
            EXPECT_LE(widget->minimumSizeHint().height(), widget->height()) << panel << ": " << name;
        }
    }
    get<QToolButton>("body.advanced").setChecked(false);
    window->viewport().setUpdatesEnabled(true);
}

TEST_F(Panels, TheColumnShowsWhatTheScriptNames) {
    for (const char* panel : {"model", "quads", "detail", "deform", "body", "fracture", "fit", "flesh", "view"}) {
        EXPECT_TRUE(window->show_panel(panel));
        EXPECT_EQ(window->panel(), panel);
        EXPECT_TRUE(get<QScrollArea>(panel).isVisible());
    }
    EXPECT_FALSE(window->show_panel("kitchen"));
    EXPECT_EQ(window->panel(), "view");
    auto& tabs = get<QTabBar>("panels");
    QTest::keyClick(&tabs, Qt::Key_Left);
    EXPECT_EQ(window->panel(), "flesh");
}
