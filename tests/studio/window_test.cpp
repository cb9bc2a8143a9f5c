#include "one_window.h"
#include "overlay.h"
#include "panel.h"

#include <QApplication>
#include <QCloseEvent>
#include <QDropEvent>
#include <QFileDialog>
#include <QFileInfo>
#include <QMenu>
#include <QMessageBox>
#include <QMimeData>
#include <QPushButton>
#include <QSettings>
#include <QTemporaryDir>
#include <QTest>
#include <QTimer>

#include <fstream>

#include <gtest/gtest.h>

using namespace filigree;
using namespace filigree::studio;

namespace {

class Window : public OneWindow {
protected:
    static void change_something() {
        Warps warps;
        warps.twist = 45;
        workbench().set_warps(warps);
        ASSERT_TRUE(workbench().document().is_modified());
    }
    /// A body of few particles with two frames.
    static void make_body_and_steps(Workbench& of) {
        BodySettings body = of.state().body;
        body.particles = 200;
        of.set_body(body);
        of.make_body();
        of.wait_until_idle();
        for (int k = 0; k < 2; ++k) {
            of.step();
            of.wait_until_idle();
        }
    }
    /// Presses a button of the question as soon as it is there.
    static void answer(QMessageBox::StandardButton button, MainWindow& of = *window, QString* explanation = nullptr) {
        QTimer::singleShot(0, &of, [button, &of, explanation] {
            auto* box = of.findChild<QMessageBox*>("unsaved");
            ASSERT_TRUE(box);
            if (explanation) *explanation = box->informativeText();
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
    const State before = workbench().document().state();
    window->open_file(path("nothing.obj"));
    workbench().wait_until_idle();
    EXPECT_TRUE(window->message().contains("nothing.obj")) << window->message().toStdString();
    EXPECT_TRUE(workbench().document().state() == before);
    EXPECT_FALSE(window->recent_files().contains(path("nothing.obj")));
    window->findChild<QToolButton*>("message.close")->click();
    EXPECT_EQ(window->message(), "");
    window->show_message("All is well.", false);
    EXPECT_EQ(window->message(), "All is well.");
}

TEST_F(Window, AMessageHidesNothingThatIsWrittenInThePicture) {
    window->show();
    ASSERT_TRUE(QTest::qWaitForWindowExposed(window));
    workbench().view().edit([](ViewSettings& settings) { settings.level_by_distance = settings.split = true; });
    auto* overlay = static_cast<Overlay*>(window->findChild<QWidget*>("viewport.overlay"));
    const auto is_written = [&] {
        return overlay->content().captions.size() == 3 && overlay->content().note.contains("Level");
    };
    ASSERT_TRUE(QTest::qWaitFor(is_written, 20'000));
    /// The first row with something written in it.
    const auto top = [&] {
        QImage image(overlay->size(), QImage::Format_ARGB32_Premultiplied);
        image.fill(Qt::transparent);
        overlay->render(&image, {}, {}, {});
        const int separator = image.width() / 3; // goes all the way up
        for (int y = 0; y < image.height(); ++y)
            for (int x = 0; x < separator - 5; ++x)
                if (qAlpha(image.pixel(x, y)) > 0) return y;
        return image.height();
    };
    window->show_message("", false);
    const int before = top();
    EXPECT_LT(before, 20);
    window->show_message("A sentence.", true);
    auto* bar = window->findChild<QWidget*>("message");
    EXPECT_GT(top(), bar->geometry().bottom());
    window->findChild<QToolButton*>("message.close")->click();
    EXPECT_EQ(top(), before);
    workbench().view().edit([](ViewSettings& settings) { settings.level_by_distance = settings.split = false; });
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

TEST_F(Window, ClosesOnceTheModelIsWrittenThoughAModelHoldsNoPins) {
    const QString file = path("pinned.fil");
    MainWindow other(false);
    other.show();
    other.save_file(file);
    other.workbench().wait_until_idle();
    ASSERT_TRUE(QFile::remove(file));
    other.workbench().pin(std::vector<Index>{0, 1});
    QString explanation;
    answer(QMessageBox::Save, other, &explanation);
    EXPECT_TRUE(other.close());
    EXPECT_FALSE(other.isVisible());
    EXPECT_TRUE(QFileInfo::exists(file));
    EXPECT_TRUE(explanation.contains("without the pins")) << explanation.toStdString();
}

TEST_F(Window, StaysWhenTheModelCannotBeWritten) {
    const QString inside = path("gone");
    ASSERT_TRUE(QDir().mkdir(inside));
    MainWindow other(false);
    other.show();
    other.save_file(inside + "/cube.fil");
    other.workbench().wait_until_idle();
    ASSERT_TRUE(QDir(inside).removeRecursively());
    other.workbench().pin(std::vector<Index>{0, 1});
    answer(QMessageBox::Save, other);
    EXPECT_FALSE(other.close());
    EXPECT_TRUE(other.isVisible());
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

TEST_F(Window, ClosingWaitsForFiles) {
    const QString file = path("cube.obj");
    {
        MainWindow other(false);
        other.show();
        other.write([&] { other.workbench().save_mesh(file.toStdString()); });
        ASSERT_TRUE(other.workbench().jobs().is_busy());
        EXPECT_FALSE(other.close());
        EXPECT_TRUE(other.findChild<QWidget*>("farewell"));
        EXPECT_TRUE(QTest::qWaitFor([&] { return !other.isVisible(); }));
    }
    EXPECT_TRUE(QFileInfo::exists(file));
}

TEST_F(Window, AFileThatCannotBeWrittenKeepsTheWindowOpen) {
    MainWindow other(false);
    other.show();
    other.write([&] { other.workbench().save_mesh(path("no_such_folder/cube.obj").toStdString()); });
    EXPECT_FALSE(other.close());
    other.workbench().wait_until_idle();
    QCoreApplication::processEvents();
    EXPECT_TRUE(other.isVisible());
    EXPECT_TRUE(other.message().contains("no_such_folder"));
    EXPECT_TRUE(other.close());
}

TEST_F(Window, WhatMovesIsAskedForAsWell) {
    make_body_and_steps(workbench());
    workbench().pause();
    workbench().document().set_saved();
    ASSERT_FALSE(workbench().document().is_modified());
    const std::size_t before = workbench().frame_count();
    workbench().play();
    ASSERT_TRUE(QTest::qWaitFor([&] { return workbench().frame_count() > before; }));
    answer(QMessageBox::Cancel);
    EXPECT_FALSE(window->may_discard());
    EXPECT_FALSE(workbench().is_playing());
    EXPECT_TRUE(workbench().document().is_modified());
}

TEST_F(Window, AMessageThatIsNotSoAnyMoreGoes) {
    Q_EMIT workbench().told("The driver is coarse.", false);
    Q_EMIT workbench().withdrawn("Another sentence.");
    EXPECT_EQ(window->message(), "The driver is coarse.");
    Q_EMIT workbench().withdrawn("The driver is coarse.");
    EXPECT_EQ(window->message(), "");
    Q_EMIT workbench().told("Saved.", false);
    window->dismiss_message();
    EXPECT_EQ(window->message(), "");
}

TEST_F(Window, AMessageCanOfferAButton) {
    auto& offer = *window->findChild<QPushButton*>("message.offer");
    window->show_message("Everything here is pinned.", false, "edit.unpin_all");
    EXPECT_FALSE(offer.isHidden());
    EXPECT_EQ(offer.text(), "Unpin all");
    workbench().pin(std::vector<Index>{1, 2});
    offer.click();
    EXPECT_TRUE(workbench().state().handles.empty());
    EXPECT_EQ(window->message(), "");
    workbench().pin(std::vector<Index>{1, 2});
    window->show_message("Something else.", false);
    EXPECT_TRUE(offer.isHidden());
    offer.click(); // what was offered before is gone
    EXPECT_FALSE(workbench().state().handles.empty());
}

TEST_F(Window, TheMouseAndTheCameraAreRemembered) {
    QSettings::setPath(QSettings::NativeFormat, QSettings::UserScope, folder.path()); // not the user's own
    const auto leave_with = [](bool on) {
        MainWindow one(true);
        one.workbench().view().edit([&](ViewSettings& view) { view.blender_mouse = view.follow = on; });
        one.close();
    };
    for (const bool on : {true, false}) {
        leave_with(on);
        MainWindow next(true);
        EXPECT_EQ(next.workbench().view().settings().blender_mouse, on);
        EXPECT_EQ(next.workbench().view().settings().follow, on);
    }
}

TEST_F(Window, TheExportSheetAsksForWhatMatters) {
    make_body_and_steps(workbench());
    workbench().playback().wait_for_frames(0);
    window->actions().find("file.export_animation")->trigger();
    auto* sheet = window->findChild<QDialog*>("export.sheet");
    ASSERT_TRUE(sheet);
    auto* keys = sheet->findChild<QComboBox*>("export.keys");
    EXPECT_EQ(keys->currentText(), "30 a second");
    keys->setCurrentIndex(0);
    sheet->findChild<QCheckBox*>("export.compress")->click();
    EXPECT_EQ(workbench().glb_settings(), (GlbSettings{.keys = 0, .compress = true}));
    sheet->findChild<QComboBox*>("export.format")->setCurrentIndex(1);
    EXPECT_TRUE(keys->isHidden());
    sheet->findChild<QPushButton*>("export.go_on")->click();
    auto* dialog = window->findChild<QFileDialog*>("file.export_animation.dialog");
    ASSERT_TRUE(dialog);
    EXPECT_EQ(dialog->defaultSuffix(), "pc2");
    dialog->reject();
    workbench().set_glb_settings({});
}

TEST_F(Window, LongNamesAreShortened) {
    const QString name = QString("a_very_long_name_").repeated(12);
    window->open_file(triangle((name + ".obj").toStdString().c_str()));
    workbench().wait_until_idle();
    EXPECT_TRUE(window->message().contains(name));
    auto* text = window->findChild<QLabel*>("message.text");
    EXPECT_FALSE(text->text().contains(name));
    EXPECT_TRUE(text->text().contains(QChar(0x2026)));
    EXPECT_TRUE(text->toolTip().contains(name));
    auto* title = window->findChild<ElidedText*>("model.name");
    EXPECT_TRUE(title->is_elided());
    EXPECT_EQ(title->text(), name + ".obj");
}

TEST_F(Window, TheStatusBarHasRoomForWhatItSays) {
    window->show();
    ASSERT_TRUE(QTest::qWaitForWindowExposed(window));
    window->resize(1280, 800);
    const std::pair<const char*, const char*> texts[] = {
        {"status.vertices", "9,999,999 vertices · driver 20,000"},
        {"status.milliseconds", "driver 999 ms · restore 999 ms · draw 999 ms"},
        {"status.rate", "999 pictures/s"},
        {"status.error", "rms 0.00012 · max 0.00012 · 0.42°"},
    };
    for (const auto& [name, text] : texts) {
        auto* label = window->findChild<ElidedText*>(name);
        ASSERT_TRUE(label);
        label->setText(QString::fromUtf8(text));
        label->show();
    }
    for (int k = 0; k < 3; ++k) QCoreApplication::sendPostedEvents();
    for (const auto& [name, text] : texts) EXPECT_FALSE(window->findChild<ElidedText*>(name)->is_elided()) << name;
    EXPECT_EQ(window->size(), QSize(1280, 800));
    window->findChild<ElidedText*>("status.error")->setText(QString("rms ").repeated(200));
    for (int k = 0; k < 3; ++k) QCoreApplication::sendPostedEvents();
    EXPECT_EQ(window->size(), QSize(1280, 800));
}

TEST_F(Window, SmallWindowsHaveNothingOnTopOfEachOther) {
    make_body_and_steps(workbench());
    window->show();
    ASSERT_TRUE(QTest::qWaitForWindowExposed(window));
    auto* timeline = window->findChild<QWidget*>("timeline");
    for (const QSize size : {QSize(1280, 800), QSize(800, 500), QSize(700, 500)}) {
        window->resize(size);
        for (int k = 0; k < 5; ++k) QCoreApplication::processEvents();
        EXPECT_EQ(window->size(), size);
        std::vector<QWidget*> parts;
        for (auto* part : timeline->findChildren<QWidget*>(QString(), Qt::FindDirectChildrenOnly))
            if (part->isVisible()) parts.push_back(part);
        for (QWidget* part : parts) {
            const std::string name = part->objectName().toStdString();
            EXPECT_TRUE(timeline->rect().contains(part->geometry())) << name << " at " << size.width();
            EXPECT_GE(part->width(), part->minimumSizeHint().width()) << name << " at " << size.width();
            for (QWidget* other : parts)
                EXPECT_TRUE(part == other || !part->geometry().intersects(other->geometry()))
                    << name << " and " << other->objectName().toStdString() << " at " << size.width();
        }
    }
    window->resize(1280, 800);
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
    make_body_and_steps(workbench());
    auto* scrub = window->findChild<QSlider*>("timeline.scrub");
    ASSERT_TRUE(QTest::qWaitFor([&] { return scrub->maximum() == 2; })) << workbench().frame_count();
    EXPECT_TRUE(scrub->isEnabled());
    EXPECT_EQ(scrub->value(), 2);
    scrub->setValue(1);
    EXPECT_EQ(workbench().frame(), 1u);
    EXPECT_TRUE(window->findChild<QLabel*>("timeline.frame")->text().contains("1 of 2"));
}
