#include "pointer.h"

#include <QWheelEvent>

#include <algorithm>
#include <cmath>

namespace filigree::studio {

namespace {

constexpr int kHoverAfter = 25; // ms
constexpr double kDegreesAPixel = 0.4;
constexpr double kZoomAStep = 1.15; // of the wheel

void turn_view(ViewState& view, const QPointF& moved, const PictureSize&) {
    view.orbit(-kDegreesAPixel * moved.x(), kDegreesAPixel * moved.y());
}

void shift_view(ViewState& view, const QPointF& moved, const PictureSize& size) {
    view.pan(-moved.x() / size.height, moved.y() / size.height);
}

/// Down and left: farther away.
void zoom_view(ViewState& view, const QPointF& moved, const PictureSize&) {
    constexpr double kAPixel = 1.005;
    view.set_zoom(view.zoom() * std::pow(kAPixel, moved.x() - moved.y()));
}

} // namespace

Pointer::Pointer(const ToolContext& context, QWidget& widget) : context_(context), widget_(widget) {
    hover_timer_.setSingleShot(true);
    connect(&hover_timer_, &QTimer::timeout, this, &Pointer::update_hover);
    connect(&view(), &ViewState::changed, this, [this] {
        take_up();
        show_cursor();
    });
    connect(&context_.workbench.document(), &Document::changed, this, [this](const State& before) {
        if (!held_ || before.model == context_.workbench.state().model) return;
        std::exchange(held_, nullptr)->cancel(); // what is held belongs to a model that is not there any more
        hover_.reset();
        take_up();
        show_cursor();
    });
    take_up();
}

/// The tool that the view's settings name, once nothing is dragged.
void Pointer::take_up() {
    const ToolEntry* const wanted = view().settings().tool;
    if (held_ || wanted == entry_) return;
    entry_ = wanted;
    if (hot_ == tool_.get()) hot_ = nullptr;
    tool_ = wanted->make(context_);
}

// Buttons

void Pointer::press(const QMouseEvent& event) {
    if (is_dragging()) return; // a second button while the first is down
    context_.camera.stop_flight();
    last_ = event.position();
    hover_timer_.stop();
    const bool is_left = event.button() == Qt::LeftButton;
    if (event.button() == Qt::MiddleButton)
        camera_drag_ = middle_drag(event.modifiers());
    else if (is_left && event.modifiers() & Qt::ShiftModifier)
        camera_drag_ = shift_view;
    else if (event.button() == Qt::RightButton)
        camera_drag_ = turn_view;
    else if (is_left)
        press_left(event);
    show_cursor();
    Q_EMIT changed();
}

Pointer::CameraDrag Pointer::middle_drag(Qt::KeyboardModifiers keys) const {
    if (!view().settings().blender_mouse || keys & Qt::ShiftModifier) return shift_view;
    return keys & Qt::ControlModifier ? zoom_view : turn_view;
}

void Pointer::press_left(const QMouseEvent& event) {
    const Hit hit(context_, event.position(), event.modifiers());
    for (Tool* const tool : hand())
        if (tool->press(hit)) {
            held_ = tool;
            return;
        }
    camera_drag_ = turn_view;
}

void Pointer::move(const QMouseEvent& event) {
    const QPointF at = event.position(), moved = at - std::exchange(last_, at);
    if (!is_dragging()) {
        hover_at_ = at;
        if (!hover_timer_.isActive()) hover_timer_.start(kHoverAfter);
        return;
    }
    Q_EMIT has_begun();
    if (held_)
        held_->move(Hit(context_, at, event.modifiers()));
    else
        camera_drag_(view(), moved, context_.camera.tile_size());
    Q_EMIT changed();
}

void Pointer::release() {
    camera_drag_ = nullptr;
    if (Tool* const held = std::exchange(held_, nullptr)) held->release();
    take_up();
    hover_at_ = last_;
    update_hover();
}

bool Pointer::escape() {
    if (!is_dragging()) return false;
    camera_drag_ = nullptr;
    if (Tool* const held = std::exchange(held_, nullptr)) held->cancel();
    take_up();
    show_cursor();
    Q_EMIT changed();
    return true;
}

void Pointer::wheel(const QWheelEvent& event) {
    context_.camera.stop_flight();
    const double steps = event.pixelDelta().isNull() ? event.angleDelta().y() / 120.0 : event.pixelDelta().y() / 40.0;
    const double zoom = view().zoom();
    const double wanted = std::clamp(zoom * std::pow(kZoomAStep, steps), ViewState::kLeastZoom, ViewState::kMostZoom);
    const QPointF at = context_.camera.in_tile(event.position());
    if (zoom > 0 && wanted != zoom)
        view().set_camera(
            zoomed_about(context_.camera.camera(), wanted / zoom, at.x(), at.y(), context_.camera.tile_size()));
}

void Pointer::double_click(const QMouseEvent& event) {
    if (event.button() != Qt::LeftButton || tool_->takes_double_clicks()) return press(event);
    if (const std::optional<Picked> picked = context_.pick(event.position()))
        context_.camera.look_at(picked->at);
    else
        context_.camera.show_all();
}

// What is under the mouse

void Pointer::update_hover() {
    if (is_dragging()) return;
    const Hit hit(context_, hover_at_);
    const std::array tools = hand();
    const auto found = std::ranges::find_if(tools, [&](Tool* tool) { return tool->hover(hit); });
    hot_ = found == tools.end() ? nullptr : *found;
    hover_ = hot_ && hot_ == tool_.get() ? hit.surface() : std::nullopt;
    show_cursor();
    Q_EMIT changed();
}

void Pointer::forget_hover() {
    if (is_dragging()) return;
    hover_.reset();
    if (hot_ == tool_.get()) hot_ = nullptr;
}

void Pointer::leave() {
    hover_timer_.stop();
    hover_.reset();
    hot_ = nullptr;
    Q_EMIT changed();
}

void Pointer::draw(OverlayContent& content) const {
    for (const Tool* const tool : hand()) tool->draw(content, held_ ? tool == held_ : tool == hot_);
    const double radius = tool_->radius();
    if (!hover_ || is_dragging() || radius <= 0) return;
    const PictureSize size = context_.camera.tile_size();
    content.hover = hover_at_;
    content.hover_radius = std::clamp(radius * pixels_a_unit(context_.camera.camera(), hover_->at, size), 5.0,
                                      0.4 * std::min(size.width, size.height));
}

Qt::CursorShape Pointer::cursor() const {
    if (held_) return held_->cursor(true);
    if (camera_drag_) return camera_drag_ == shift_view ? Qt::SizeAllCursor : Qt::ArrowCursor;
    return hot_ ? hot_->cursor(false) : Qt::ArrowCursor;
}

void Pointer::show_cursor() {
    if (widget_.cursor().shape() != cursor()) widget_.setCursor(cursor());
}

} // namespace filigree::studio
