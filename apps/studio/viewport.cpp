#include "viewport.h"

#include <QSurfaceFormat>

namespace filigree::studio {

struct Viewport::Content {
    explicit Content(Workbench& bench) : workbench(bench) {}
    Workbench& workbench;
    Timings timings;
    std::string trouble;
};

Viewport::Viewport(Workbench& workbench, QWidget* parent)
    : QOpenGLWidget(parent), content_(std::make_unique<Content>(workbench)) {
    setMouseTracking(true);
}
Viewport::~Viewport() = default;

const Timings& Viewport::timings() const { return content_->timings; }
void Viewport::look_from(View) {}
void Viewport::show_all() {}
void Viewport::finish_drawing() {}
const std::string& Viewport::trouble() const { return content_->trouble; }
std::optional<Viewport::Picked> Viewport::pick(const QPointF&) { return std::nullopt; }

void Viewport::initializeGL() {}
void Viewport::paintGL() {}
void Viewport::resizeGL(int, int) {}
void Viewport::mousePressEvent(QMouseEvent* event) { QOpenGLWidget::mousePressEvent(event); }
void Viewport::mouseMoveEvent(QMouseEvent* event) { QOpenGLWidget::mouseMoveEvent(event); }
void Viewport::mouseReleaseEvent(QMouseEvent* event) { QOpenGLWidget::mouseReleaseEvent(event); }
void Viewport::mouseDoubleClickEvent(QMouseEvent* event) { QOpenGLWidget::mouseDoubleClickEvent(event); }
void Viewport::wheelEvent(QWheelEvent* event) { QOpenGLWidget::wheelEvent(event); }
void Viewport::leaveEvent(QEvent* event) { QOpenGLWidget::leaveEvent(event); }

} // namespace filigree::studio
