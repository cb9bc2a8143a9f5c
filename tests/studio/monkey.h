// A monkey at the window: random actions, controls and drags, from a seed.
#pragma once

#include "window.h"

#include <QAbstractButton>
#include <QAbstractSlider>
#include <QApplication>
#include <QComboBox>
#include <QMenu>
#include <QSpinBox>
#include <QTest>

#include <random>
#include <vector>

namespace filigree::studio {

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

    /// 0 .. n - 1
    unsigned below(std::size_t n) { return static_cast<unsigned>(random_() % n); }

private:
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

} // namespace filigree::studio
