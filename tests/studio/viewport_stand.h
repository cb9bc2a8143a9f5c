// A viewport in a window, and a mouse for it.
#pragma once

#include "studio/first_state_once.h"
#include "studio/patience.h"
#include "viewport.h"

#include <QApplication>
#include <QMouseEvent>
#include <QTest>
#include <QVBoxLayout>
#include <QWheelEvent>

#include <cmath>
#include <cstdlib>
#include <functional>

namespace filigree::studio {

inline double distance(const QPointF& a, const QPointF& b) { return std::hypot(a.x() - b.x(), a.y() - b.y()); }

/// A viewport with a bumpy ball, shown and drawn.
struct Stand {
    Workbench workbench{first_state_once()};
    QWidget window;
    Viewport* viewport = nullptr;

    explicit Stand(const std::string& shape = "wavy-cube", unsigned resolution = 24) {
        ShapeOptions options;
        options.resolution = resolution;
        workbench.make_shape({shape, options});
        workbench.wait_until_idle();
        viewport = new Viewport(workbench, &window);
        viewport->set_animated(false);
        viewport->set_passes(kPasses);
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

} // namespace filigree::studio
