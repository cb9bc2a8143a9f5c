#include "coloring.h"
#include "controls.h"
#include "one_window.h"
#include "tools/tool.h"

#include <QApplication>
#include <QDialog>
#include <QFileDialog>
#include <QFileInfo>
#include <QMenu>
#include <QMenuBar>
#include <QMessageBox>
#include <QTemporaryDir>
#include <QTest>

#include <fstream>

#include <gtest/gtest.h>

using namespace filigree;
using namespace filigree::studio;

namespace {

class ActionsTest : public OneWindow {
protected:
    static QAction& action(const char* name) {
        QAction* const found = window->actions().find(name);
        if (!found) throw std::runtime_error(std::string("no action ") + name);
        return *found;
    }
    static void trigger(const char* name) {
        ASSERT_TRUE(action(name).isEnabled()) << name;
        action(name).trigger();
        workbench().wait_until_idle();
    }
    /// The dialog that an action opened.
    template <class T>
    static T* dialog(const char* name) {
        T* found = window->findChild<T*>(name);
        EXPECT_TRUE(found) << name;
        return found;
    }
};

} // namespace

TEST_F(ActionsTest, AllAreNamedExplainedAndInAMenu) {
    std::set<QString> names;
    std::map<QString, QString> keys;
    std::set<const QAction*> in_menus;
    for (const QMenu* menu : window->menuBar()->findChildren<QMenu*>())
        for (const QAction* entry : menu->actions()) in_menus.insert(entry);
    for (const QAction* one : window->actions().all()) {
        const QString name = one->objectName();
        EXPECT_TRUE(name.contains('.')) << name.toStdString();
        EXPECT_TRUE(names.insert(name).second) << name.toStdString();
        EXPECT_FALSE(one->text().isEmpty()) << name.toStdString();
        EXPECT_FALSE(one->toolTip().isEmpty()) << name.toStdString();
        EXPECT_FALSE(one->statusTip().isEmpty()) << name.toStdString();
        EXPECT_TRUE(in_menus.contains(one)) << name.toStdString();
        const QString key = one->shortcut().toString();
        if (key.isEmpty() || key == "Space") continue; // play and pause: one of them is enabled
        EXPECT_TRUE(keys.emplace(key, name).second) << key.toStdString() << " is that of " << keys[key].toStdString();
    }
    for (const char* name : {"file.open",
                             "file.save",
                             "file.save_as",
                             "file.save_mesh",
                             "file.save_driver",
                             "file.export_film",
                             "file.export_meshes",
                             "file.quit",
                             "edit.undo",
                             "edit.redo",
                             "edit.reset_deformation",
                             "edit.unpin_all",
                             "detail.remove",
                             "detail.add",
                             "body.make",
                             "body.play",
                             "body.pause",
                             "body.step",
                             "body.reset",
                             "body.animate",
                             "view.front",
                             "view.side",
                             "view.top",
                             "view.show_all",
                             "tool.pull",
                             "tool.pin",
                             "tool.turn",
                             "tool.torch",
                             "body.melt",
                             "body.freeze",
                             "help.shortcuts",
                             "help.about"})
        EXPECT_TRUE(window->actions().find(name)) << name;
    EXPECT_EQ(window->actions().find("file.bake"), nullptr);
    EXPECT_TRUE(window->findChild<QMenu*>("file.open_recent"));
}

TEST_F(ActionsTest, AreEnabledOnlyWhereTheyCanDoSomething) {
    for (const char* name : {"edit.undo", "edit.redo", "edit.reset_deformation", "edit.unpin_all", "detail.add",
                             "file.export_film", "file.export_meshes", "body.pause", "body.back", "edit.cancel"})
        EXPECT_FALSE(action(name).isEnabled()) << name;
    trigger("detail.remove");
    EXPECT_TRUE(action("detail.add").isEnabled());
    while (action("detail.remove").isEnabled()) trigger("detail.remove");
    EXPECT_EQ(workbench().state().level(), 0u);
    trigger("detail.add");
    EXPECT_EQ(workbench().state().level(), 1u);
}

TEST_F(ActionsTest, UndoAndRedoNameTheStep) {
    const State before = workbench().document().state();
    Warps warps;
    warps.bend = 30;
    workbench().set_warps(warps);
    const State after = workbench().document().state();
    const QString step = workbench().document().undo_stack().undoText();
    EXPECT_FALSE(step.isEmpty());
    EXPECT_EQ(action("edit.undo").text().remove('&'), "Undo " + step);
    trigger("edit.undo");
    EXPECT_TRUE(workbench().document().state() == before);
    EXPECT_EQ(action("edit.redo").text().remove('&'), "Redo " + step);
    EXPECT_EQ(action("edit.undo").text().remove('&'), "Undo");
    trigger("edit.redo");
    EXPECT_TRUE(workbench().document().state() == after);
    trigger("edit.reset_deformation");
    EXPECT_TRUE(workbench().state().warps.none());
}

TEST_F(ActionsTest, SwitchesAndChoicesOfTheView) {
    struct Switch {
        const char* name;
        bool ViewSettings::*field;
    };
    for (const Switch& one :
         {Switch{"view.split", &ViewSettings::split}, Switch{"view.driver", &ViewSettings::driver},
          Switch{"view.defects", &ViewSettings::defects}, Switch{"view.inside_points", &ViewSettings::inside_points},
          Switch{"view.clip", &ViewSettings::clip}, Switch{"view.level_by_distance", &ViewSettings::level_by_distance},
          Switch{"view.keep_up", &ViewSettings::keep_up}, Switch{"view.ground", &ViewSettings::ground}}) {
        const bool before = workbench().view().settings().*one.field;
        EXPECT_EQ(action(one.name).isChecked(), before) << one.name;
        trigger(one.name);
        EXPECT_NE(workbench().view().settings().*one.field, before) << one.name;
        EXPECT_NE(action(one.name).isChecked(), before) << one.name;
        trigger(one.name);
        EXPECT_EQ(workbench().view().settings().*one.field, before) << one.name;
    }
    trigger("view.wireframe");
    EXPECT_EQ(workbench().view().settings().style, SurfaceStyle::wireframe);
    EXPECT_TRUE(action("view.wireframe").isChecked());
    EXPECT_FALSE(action("view.shaded").isChecked());
    trigger("view.wireframe"); // once more: stays
    EXPECT_TRUE(action("view.wireframe").isChecked());
    trigger("view.color_levels");
    EXPECT_EQ(workbench().view().settings().coloring, &kLevelColors);
    for (const auto& [name, tool] : {std::pair{"tool.pin", &kPinTool},
                                     {"tool.turn", &kTurnTool},
                                     {"tool.torch", &kTorchTool},
                                     {"tool.pull", &kPullTool}}) {
        trigger(name);
        EXPECT_EQ(workbench().view().settings().tool, tool) << name;
    }
}

TEST_F(ActionsTest, Themes) {
    trigger("view.dark_theme");
    EXPECT_TRUE(is_dark(QApplication::palette()));
    EXPECT_TRUE(action("view.dark_theme").isChecked());
    EXPECT_EQ(window->findChild<QComboBox*>("view.theme")->currentIndex(), 2);
    trigger("view.light_theme");
    EXPECT_FALSE(is_dark(QApplication::palette()));
    EXPECT_TRUE(action("view.light_theme").isChecked());
    trigger("view.system_theme");
    EXPECT_TRUE(action("view.system_theme").isChecked());
}

TEST_F(ActionsTest, TextCanBeReadInBothThemes) {
    const auto luminance = [](const QColor& color) {
        const auto light = [](double c) { return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4); };
        return 0.2126 * light(color.redF()) + 0.7152 * light(color.greenF()) + 0.0722 * light(color.blueF());
    };
    const auto contrast = [&](const QColor& a, const QColor& b) { // WCAG 2
        const double x = luminance(a) + 0.05, y = luminance(b) + 0.05;
        return std::max(x, y) / std::min(x, y);
    };
    for (const char* name : {"view.light_theme", "view.dark_theme"}) {
        trigger(name);
        const QPalette palette = QApplication::palette();
        const QColor window_color = palette.color(QPalette::Window);
        EXPECT_GT(contrast(palette.color(QPalette::WindowText), window_color), 7) << name;
        EXPECT_GT(contrast(palette.color(QPalette::Text), palette.color(QPalette::Base)), 7) << name;
        EXPECT_GT(contrast(palette.color(QPalette::ButtonText), palette.color(QPalette::Button)), 7) << name;
        EXPECT_GT(contrast(palette.color(QPalette::HighlightedText), palette.color(QPalette::Highlight)), 4.5) << name;
        for (const QColor& color : {quiet_color(palette), good_color(palette), bad_color(palette)})
            EXPECT_GT(contrast(color, window_color), 4.5) << name;
    }
    trigger("view.system_theme");
}

TEST_F(ActionsTest, FileDialogsOpenAndSave) {
    QTemporaryDir folder;
    const QString model = folder.filePath("cube.fil"), mesh = folder.filePath("cube.ply"),
                  driver = folder.filePath("driver.ply");
    const auto save = [&](const char* name, const QString& path) {
        action(name).trigger();
        auto* box = dialog<QFileDialog>((std::string(name) + ".dialog").c_str());
        ASSERT_TRUE(box);
        EXPECT_EQ(box->acceptMode(), QFileDialog::AcceptSave);
        Q_EMIT box->fileSelected(path); // as its button does
        box->close();
        QCoreApplication::sendPostedEvents(box, QEvent::DeferredDelete);
        workbench().wait_until_idle();
        EXPECT_TRUE(QFileInfo::exists(path)) << path.toStdString();
    };
    save("file.save_as", model);
    save("file.save_mesh", mesh);
    save("file.save_driver", driver);
    EXPECT_EQ(window->file_path(), model);

    action("file.open").trigger();
    auto* box = dialog<QFileDialog>("file.open.dialog");
    ASSERT_TRUE(box);
    EXPECT_EQ(box->acceptMode(), QFileDialog::AcceptOpen);
    Q_EMIT box->fileSelected(mesh);
    box->close();
    workbench().wait_until_idle();
    EXPECT_EQ(workbench().state().source->path, mesh.toStdString());
    EXPECT_EQ(window->file_path(), ""); // a mesh is not what Save writes
}

TEST_F(ActionsTest, BodyMovesAndGoesBack) {
    BodySettings body = workbench().state().body;
    body.particles = 200;
    workbench().set_body(body);
    trigger("body.make");
    ASSERT_TRUE(workbench().playback().has_body());
    EXPECT_TRUE(window->findChild<QLabel*>("body.report")->text().contains("particles"));
    trigger("body.step");
    workbench().playback().wait_for_frames(0);
    EXPECT_EQ(workbench().frame(), 1u);
    trigger("body.back");
    EXPECT_EQ(workbench().frame(), 0u);
    action("body.play").trigger();
    EXPECT_TRUE(workbench().is_playing());
    EXPECT_FALSE(action("body.play").isEnabled());
    action("body.pause").trigger();
    workbench().wait_until_idle();
    EXPECT_FALSE(workbench().is_playing());
    trigger("view.particles");
    EXPECT_TRUE(workbench().view().settings().particles);
    trigger("body.reset");
    EXPECT_LE(workbench().frame_count(), 1u);
}

TEST_F(ActionsTest, FilesByNumberAreNotOverwrittenUnasked) {
    BodySettings body = workbench().state().body;
    body.particles = 200;
    workbench().set_body(body);
    trigger("body.make");
    trigger("body.step");
    workbench().playback().wait_for_frames(0);
    QTemporaryDir folder;
    ASSERT_TRUE(QDir(folder.path()).mkdir("50% done"));
    const QString path = folder.filePath("50% done/x.obj"), first = folder.filePath("50% done/x_0001.obj");
    const auto ask = [&] {
        action("file.export_meshes").trigger();
        auto* box = dialog<QFileDialog>("file.export_meshes.dialog");
        ASSERT_TRUE(box);
        Q_EMIT box->fileSelected(path);
        box->close();
        QCoreApplication::sendPostedEvents(box, QEvent::DeferredDelete);
    };
    const auto answer = [&](const char* button) {
        auto* question = dialog<QMessageBox>("file.replace");
        ASSERT_TRUE(question);
        for (QAbstractButton* one : question->buttons())
            if (one->objectName() == button) one->click();
        QCoreApplication::sendPostedEvents(question, QEvent::DeferredDelete);
        workbench().wait_until_idle();
    };
    ask();
    workbench().wait_until_idle();
    EXPECT_FALSE(window->findChild<QMessageBox*>("file.replace"));
    ASSERT_TRUE(QFileInfo::exists(first)) << window->message().toStdString();

    const auto overwrite = [&] { std::ofstream(first.toStdString()) << "mine"; };
    overwrite();
    ask();
    answer("");
    EXPECT_EQ(QFileInfo(first).size(), 4);
    ask();
    answer("file.replace.yes");
    EXPECT_GT(QFileInfo(first).size(), 4);
}

TEST_F(ActionsTest, EscDuringAPullLeavesNoStep) {
    workbench().set_mode(Mode::deform);
    const State before = workbench().document().state();
    const int steps = workbench().document().undo_stack().count();
    const Vec3d at = workbench().state().model->mesh.positions[0].cast<double>();
    workbench().begin_pull(0, at);
    workbench().pull_to(at + Vec3d(0, 0.3, 0));
    ASSERT_TRUE(QTest::qWaitFor([] { return action("edit.cancel").isEnabled(); }));
    trigger("edit.cancel");
    EXPECT_FALSE(workbench().is_pulling());
    EXPECT_EQ(workbench().document().undo_stack().count(), steps);
    EXPECT_TRUE(workbench().document().state() == before);
}

TEST_F(ActionsTest, ErrorIsMeasured) {
    Warps warps;
    warps.bend = 60;
    workbench().set_warps(warps);
    trigger("view.measure_error");
    ASSERT_TRUE(workbench().error());
    const QString text = window->findChild<QLabel*>("status.error")->text();
    EXPECT_TRUE(text.startsWith("rms ")) << text.toStdString();
    EXPECT_TRUE(text.contains("max ")) << text.toStdString();
}

TEST_F(ActionsTest, HelpListsEveryShortcut) {
    trigger("help.shortcuts");
    auto* sheet = dialog<QDialog>("help.sheet");
    ASSERT_TRUE(sheet);
    QString words;
    for (const QLabel* label : sheet->findChildren<QLabel*>()) words += label->text();
    for (const QAction* one : window->actions().all()) {
        const QString key = one->shortcut().toString(QKeySequence::NativeText);
        EXPECT_TRUE(key.isEmpty() || words.contains("<b>" + key.toHtmlEscaped() + "</b>")) << key.toStdString();
    }
    EXPECT_TRUE(words.contains("Wheel"));
    sheet->close();
    trigger("help.about");
    auto* about = dialog<QDialog>("help.about.dialog");
    ASSERT_TRUE(about);
    about->close();
}

TEST_F(ActionsTest, EscCancelsWork) {
    Shape shape;
    shape.options.resolution = 400;
    workbench().make_shape(shape);
    ASSERT_TRUE(QTest::qWaitFor([] { return action("edit.cancel").isEnabled(); })); // it has begun
    EXPECT_FALSE(window->findChild<QWidget*>("status.work")->isHidden());
    action("edit.cancel").trigger();
    workbench().wait_until_idle();
    EXPECT_TRUE(*workbench().state().shape == *start.shape);
    EXPECT_TRUE(window->findChild<QWidget*>("status.work")->isHidden());
    EXPECT_FALSE(action("edit.cancel").isEnabled());
}
