// A monkey at the window: random actions, controls and drags, from a seed.
#include "window.h"

#include <QAbstractButton>
#include <QAbstractSlider>
#include <QApplication>
#include <QComboBox>
#include <QMenu>
#include <QSpinBox>
#include <QTest>

#include <cstdlib>
#include <random>

#include <gtest/gtest.h>

using namespace filigree;
using namespace filigree::studio;

namespace {

class Monkey {
public:
    Monkey(MainWindow& window, unsigned seed) : window_(window), random_(seed) {}

    /// What it did, for the message of a test that fails.
    QString act() {
        switch (below(10)) {
        case 0:
        case 1:
        case 2:
            return trigger();
        case 3:
        case 4:
        case 5:
            return change_control();
        case 6:
        case 7:
            return drag(Qt::LeftButton);
        case 8:
            return drag(below(2) ? Qt::RightButton : Qt::MiddleButton);
        default:
            return wheel();
        }
    }

private:
    unsigned below(std::size_t n) { return static_cast<unsigned>(random_() % n); }

    QString trigger() {
        std::vector<QAction*> able;
        for (QAction* action : window_.actions().all())
            // an ellipsis promises a dialog
            if (action->isEnabled() && !action->text().contains(QChar(0x2026)) && !action->text().endsWith("...") &&
                action->objectName() != "file.quit" && !action->menu())
                able.push_back(action);
        if (able.empty()) return "nothing";
        QAction* const action = able[below(able.size())];
        const QString name = action->objectName();
        action->trigger();
        return name;
    }

    QString change_control() {
        std::vector<QWidget*> able;
        for (QWidget* widget : window_.findChildren<QWidget*>()) {
            const bool changes =
                qobject_cast<QAbstractSlider*>(widget) || qobject_cast<QComboBox*>(widget) ||
                (qobject_cast<QAbstractButton*>(widget) && static_cast<QAbstractButton*>(widget)->isCheckable());
            if (changes && widget->isEnabled() && widget->objectName().contains('.')) able.push_back(widget);
        }
        if (able.empty()) return "nothing";
        QWidget* const widget = able[below(able.size())];
        if (auto* slider = qobject_cast<QAbstractSlider*>(widget)) {
            // not the largest: what is tried here is order, not patience
            const int range = slider->maximum() - slider->minimum();
            slider->setValue(slider->minimum() + static_cast<int>(below(std::size_t(range / 2) + 1)));
        } else if (auto* choice = qobject_cast<QComboBox*>(widget)) {
            if (choice->count() == 0) return "nothing";
            choice->setCurrentIndex(static_cast<int>(below(std::size_t(choice->count()))));
            Q_EMIT choice->activated(choice->currentIndex());
        } else {
            static_cast<QAbstractButton*>(widget)->click();
        }
        return widget->objectName();
    }

    QPoint place() {
        const Viewport& viewport = window_.viewport();
        return {static_cast<int>(below(std::size_t(viewport.width()))),
                static_cast<int>(below(std::size_t(viewport.height())))};
    }

    QString drag(Qt::MouseButton button) {
        Viewport& viewport = window_.viewport();
        QTest::mousePress(&viewport, button, Qt::NoModifier, place());
        for (int i = 0; i < 3; ++i) {
            const QPoint at = place();
            QMouseEvent move(QEvent::MouseMove, at, viewport.mapToGlobal(at), Qt::NoButton, button, Qt::NoModifier);
            QApplication::sendEvent(&viewport, &move);
            QCoreApplication::processEvents();
        }
        QTest::mouseRelease(&viewport, button, Qt::NoModifier, place());
        return "a drag";
    }

    QString wheel() {
        Viewport& viewport = window_.viewport();
        const QPointF at = place();
        QWheelEvent event(at, viewport.mapToGlobal(at), {}, {0, below(2) ? 120 : -120}, Qt::NoButton, Qt::NoModifier,
                          Qt::NoScrollPhase, false);
        QApplication::sendEvent(&viewport, &event);
        return "the wheel";
    }

    MainWindow& window_;
    std::mt19937 random_;
};

/// How many steps: fewer where a sanitizer makes each a hundred times dearer.
int step_count() {
#if defined(__SANITIZE_THREAD__)
    return 50;
#else
    return 200;
#endif
}

TEST(RandomActions, ThreadsSurviveThem) {
    MainWindow window(false);
    window.resize(900, 620);
    window.show();
    ASSERT_TRUE(QTest::qWaitForWindowExposed(&window));
    window.workbench().make_shape({.name = "wavy-cube", .options = {.resolution = 16}});
    window.workbench().wait_until_idle();

    const char* const seed = std::getenv("FILIGREE_SEED");
    Monkey monkey(window, seed ? static_cast<unsigned>(std::atoi(seed)) : 7);
    QStringList done;
    for (int i = 0; i < step_count(); ++i) {
        done << monkey.act();
        QCoreApplication::processEvents(QEventLoop::AllEvents, 20);
        const State& state = window.workbench().state();
        ASSERT_NE(state.model, nullptr) << done.join(", ").toStdString();
        ASSERT_LE(state.level(), state.model->finest_level()) << done.join(", ").toStdString();
        if (const Pose* pose = window.workbench().pose()) {
            ASSERT_EQ(pose->positions.size(), state.model->driver().vertices.size()) << done.join(", ").toStdString();
        }
    }
    window.workbench().wait_until_idle();

    // Whatever it did can be taken back and done again, to the byte.
    Document& document = window.workbench().document();
    window.workbench().pause();
    window.workbench().wait_until_idle();
    const State last = document.state();
    const int steps = document.undo_stack().index();
    while (document.undo_stack().canUndo()) document.undo_stack().undo();
    while (document.undo_stack().index() < steps) document.undo_stack().redo();
    EXPECT_TRUE(document.state() == last) << done.join(", ").toStdString();
}

} // namespace
