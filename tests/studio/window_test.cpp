#include "controls.h"
#include "window.h"

#include <QApplication>
#include <QCloseEvent>
#include <QDropEvent>
#include <QFileDialog>
#include <QFileInfo>
#include <QMenu>
#include <QMessageBox>
#include <QMimeData>
#include <QPushButton>
#include <QTemporaryDir>
#include <QTest>
#include <QTimer>

#include <fstream>

#include <gtest/gtest.h>

using namespace filigree;
using namespace filigree::studio;

namespace {

class Window : public testing::Test {
protected:
    static void SetUpTestSuite() {
        window = new MainWindow(false);
        window->resize(1280, 800);
        start = window->workbench().state();
    }
    static void TearDownTestSuite() {
        start = {};
        delete window;
    }
    void SetUp() override {
        workbench().wait_until_idle();
        workbench().document().replace(start);
        window->clear_last_error();
    }

    static Workbench& workbench() { return window->workbench(); }
    static void change_something() {
        Warps warps;
        warps.twist = 45;
        workbench().set_warps(warps);
        ASSERT_TRUE(workbench().document().is_modified());
    }
    /// Presses a button of the question as soon as it is there.
    static void answer(QMessageBox::StandardButton button) {
        QTimer::singleShot(0, window, [button] {
            auto* box = window->findChild<QMessageBox*>("unsaved");
            ASSERT_TRUE(box);
            box->button(button)->click();
        });
    }
    QString path(const char* name) const { return folder.filePath(name); }
    /// A triangle that can be opened.
    QString triangle(const char* name) const {
        std::ofstream(path(name).toStdString()) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        return path(name);
    }
    static void drop(const QString& file) {
        QMimeData data;
        data.setUrls({QUrl::fromLocalFile(file)});
        QDragEnterEvent enter({100, 100}, Qt::CopyAction, &data, Qt::LeftButton, Qt::NoModifier);
        QApplication::sendEvent(window, &enter);
        EXPECT_TRUE(enter.isAccepted());
        QDropEvent event({100, 100}, Qt::CopyAction, &data, Qt::LeftButton, Qt::NoModifier);
        QApplication::sendEvent(window, &event);
        QCoreApplication::processEvents();
        workbench().wait_until_idle();
    }

    QTemporaryDir folder;
    static inline MainWindow* window = nullptr;
    static inline State start;
};

} // namespace

TEST_F(Window, ADroppedFileIsOpenedAndRemembered) {
    const QString first = triangle("first.obj"), second = triangle("second.obj");
    drop(first);
    EXPECT_EQ(workbench().state().source->path, first.toStdString());
    EXPECT_TRUE(window->windowTitle().startsWith("first"));
    drop(second);
    EXPECT_EQ(window->recent_files().value(0), second);
    EXPECT_EQ(window->recent_files().value(1), first);

    QMenu* menu = window->findChild<QMenu*>("file.open_recent");
    ASSERT_GE(menu->actions().size(), 2);
    EXPECT_EQ(menu->actions()[1]->text(), "first.obj");
    menu->actions()[1]->trigger();
    workbench().wait_until_idle();
    EXPECT_EQ(workbench().state().source->path, first.toStdString());
    EXPECT_EQ(window->recent_files().value(0), first); // once, and first again
    EXPECT_EQ(window->recent_files().count(first), 1);
}

TEST_F(Window, WhatIsNoFileIsNotTaken) {
    QMimeData data;
    data.setText("a word");
    QDragEnterEvent enter({100, 100}, Qt::CopyAction, &data, Qt::LeftButton, Qt::NoModifier);
    enter.ignore();
    QApplication::sendEvent(window, &enter);
    EXPECT_FALSE(enter.isAccepted());
}

TEST_F(Window, ErrorsAreToldWithTheFilesName) {
    const std::string before = workbench().document().bytes();
    window->open_file(path("nothing.obj"));
    workbench().wait_until_idle();
    EXPECT_TRUE(window->message().contains("nothing.obj")) << window->message().toStdString();
    EXPECT_EQ(window->last_error(), window->message());
    EXPECT_TRUE(workbench().document().bytes() == before);
    EXPECT_FALSE(window->recent_files().contains(path("nothing.obj")));
    window->findChild<QToolButton*>("message.close")->click();
    EXPECT_EQ(window->message(), "");
    EXPECT_NE(window->last_error(), "");
    window->show_message("All is well.", false);
    EXPECT_EQ(window->message(), "All is well.");
}

TEST_F(Window, UnsavedChangesAreAskedFor) {
    EXPECT_TRUE(window->may_discard()); // nothing to lose, no question
    change_something();
    EXPECT_TRUE(window->isWindowModified());
    answer(QMessageBox::Cancel);
    EXPECT_FALSE(window->may_discard());
    EXPECT_TRUE(workbench().document().is_modified());
    answer(QMessageBox::Discard);
    EXPECT_TRUE(window->may_discard());
}

TEST_F(Window, CancelKeepsTheDocumentWhenAFileIsOpened) {
    const QString file = triangle("other.obj");
    change_something();
    answer(QMessageBox::Cancel);
    window->open_file(file);
    workbench().wait_until_idle();
    EXPECT_EQ(workbench().state().warps.twist, 45);
    answer(QMessageBox::Discard);
    window->open_file(file);
    workbench().wait_until_idle();
    EXPECT_EQ(workbench().state().source->path, file.toStdString());
}

TEST_F(Window, SaveIsOneOfTheAnswers) {
    const QString file = path("cube.fil");
    window->save_file(file);
    workbench().wait_until_idle();
    EXPECT_EQ(window->file_path(), file);
    EXPECT_TRUE(window->windowTitle().startsWith("cube.fil"));
    const qint64 size = QFileInfo(file).size();
    EXPECT_GT(size, 0);
    change_something();
    answer(QMessageBox::Save);
    EXPECT_TRUE(window->may_discard());
    EXPECT_FALSE(workbench().document().is_modified());
    EXPECT_FALSE(window->isWindowModified());
}

TEST_F(Window, AFailedSaveIsNotRemembered) {
    const QString before = window->file_path();
    window->save_file(path("no_such_folder/cube.fil"));
    workbench().wait_until_idle();
    EXPECT_TRUE(window->message().contains("no_such_folder")) << window->message().toStdString();
    EXPECT_EQ(window->file_path(), before);
    change_something();
    EXPECT_TRUE(workbench().document().is_modified());
}

TEST_F(Window, ClosingAsksAndIsSafeDuringWork) {
    MainWindow other(false);
    other.show();
    Shape shape;
    shape.options.resolution = 300;
    other.workbench().make_shape(shape);
    ASSERT_TRUE(other.workbench().jobs().is_busy());
    EXPECT_TRUE(other.close());
    EXPECT_FALSE(other.isVisible());
}

TEST_F(Window, ClosingCanBeCalledOff) {
    change_something();
    answer(QMessageBox::Cancel);
    QCloseEvent event;
    QApplication::sendEvent(window, &event);
    EXPECT_FALSE(event.isAccepted());
}

TEST_F(Window, ControlsKeepTheKeysThatTheyNeed) {
    const auto keeps = [](QWidget* widget, Qt::Key key) {
        QKeyEvent event(QEvent::ShortcutOverride, key, Qt::NoModifier);
        event.ignore();
        QApplication::sendEvent(widget, &event);
        return event.isAccepted();
    };
    auto* slider = window->findChild<QSlider*>("deform.bend");
    auto* button = window->findChild<QPushButton*>("overview.animate");
    EXPECT_TRUE(keeps(slider, Qt::Key_Right));
    EXPECT_TRUE(keeps(slider, Qt::Key_PageUp));
    EXPECT_FALSE(keeps(slider, Qt::Key_Space));
    EXPECT_TRUE(keeps(button, Qt::Key_Space));
    EXPECT_FALSE(keeps(button, Qt::Key_Right));
    EXPECT_FALSE(keeps(&window->viewport(), Qt::Key_Right));
}

TEST_F(Window, TheTimelineScrubs) {
    BodySettings body = workbench().state().body;
    body.particles = 200;
    workbench().set_body(body);
    workbench().make_body();
    workbench().wait_until_idle();
    for (int k = 0; k < 3; ++k) {
        workbench().step();
        workbench().wait_until_idle();
    }
    auto* scrub = window->findChild<QSlider*>("timeline.scrub");
    ASSERT_TRUE(QTest::qWaitFor([&] { return scrub->maximum() == 3; })) << workbench().frame_count();
    EXPECT_TRUE(scrub->isEnabled());
    EXPECT_EQ(scrub->value(), 3);
    scrub->setValue(1);
    EXPECT_EQ(workbench().frame(), 1u);
    EXPECT_TRUE(window->findChild<QLabel*>("timeline.frame")->text().startsWith("frame 1 of 3"));
}
