#include "pointer.h"

#include "drawn_objects.h"

#include <QWheelEvent>

#include <algorithm>
#include <cmath>

namespace filigree::studio {

namespace {

constexpr int kHoverAfter = 25;    // ms
constexpr double kKnobRadius = 9;  // pixels around a gizmo's knob that take hold of it
constexpr double kKnobMargin = 16; // pixels between an arrow's knob and the picture's border
constexpr double kDegreesAPixel = 0.4;
constexpr double kZoomAStep = 1.15; // of the wheel
constexpr int kDragFrom = 3;        // pixels: below, it was a click

} // namespace

Pointer::Pointer(Workbench& workbench, DrawnObjects& drawn, PictureCamera& camera, QWidget& widget, Pick pick)
    : workbench_(workbench), drawn_(drawn), camera_(camera), widget_(widget), pick_(std::move(pick)) {
    hover_timer_.setSingleShot(true);
    connect(&hover_timer_, &QTimer::timeout, this, &Pointer::update_hover);
    connect(&workbench.view(), &ViewState::changed, this, &Pointer::show_cursor);
    connect(&workbench.document(), &Document::changed, this, [this](const State& before) {
        if (before.model != workbench_.state().model) drop();
    });
}

Box Pointer::rest_box() const {
    const State& state = workbench_.state();
    return state.source ? state.source->box : Box();
}

double Pointer::grip() const {
    const auto body = settings().tool == Tool::torch ? workbench_.playback().made() : nullptr;
    return body ? torch_radius(*body, workbench_.view().torch(cools_)) : settings().grip * rest_box().diagonal();
}

// Buttons

void Pointer::press(const QMouseEvent& event) {
    if (is_dragging()) return; // a second button while the first is down
    camera_.stop_flight();
    pressed_ = last_ = event.position();
    pressed_step_ = workbench_.document().undo_stack().index();
    hover_timer_.stop();
    const bool is_left = event.button() == Qt::LeftButton;
    if (event.button() == Qt::MiddleButton || (is_left && event.modifiers() & Qt::ShiftModifier))
        drag_ = Drag::pan;
    else if (event.button() == Qt::RightButton)
        drag_ = Drag::orbit;
    else if (is_left)
        press_left(event);
    show_cursor();
    Q_EMIT changed();
}

void Pointer::press_left(const QMouseEvent& event) {
    const QPointF at = camera_.in_tile(pressed_);
    const PictureSize size = camera_.tile_size();
    const auto part = gizmo_at(gizmos(), camera_.camera(), at.x(), at.y(), size, kKnobRadius);
    held_ = part || settings().tool == Tool::turn ? std::nullopt : pick_(pressed_);
    if (part) {
        gizmo_.emplace(*part, workbench_.state().warps, rest_box(), camera_.camera(), at.x(), at.y(), size);
        hot_part_ = part;
        drag_ = Drag::gizmo;
    } else if (!held_) {
        drag_ = Drag::orbit;
    } else if (settings().tool == Tool::pin) {
        unpins_ = event.modifiers() & (Qt::ControlModifier | Qt::AltModifier);
        painted_ = VertexSet(workbench_.state().model->driver().vertices.size());
        drag_ = Drag::paint;
        paint_pins(pressed_);
    } else if (settings().tool == Tool::torch) {
        cools_ = event.modifiers() & (Qt::ControlModifier | Qt::AltModifier);
        drag_ = Drag::torch;
        hold_torch(pressed_);
    } else {
        drag_ = Drag::pending_pull;
    }
}

void Pointer::move(const QMouseEvent& event) {
    const QPointF at = event.position(), moved = at - last_, way = at - pressed_;
    if (drag_ == Drag::none) {
        hover_at_ = at;
        if (!hover_timer_.isActive()) hover_timer_.start(kHoverAfter);
        return;
    }
    last_ = at;
    if (drag_ == Drag::pending_pull) {
        if (std::hypot(way.x(), way.y()) < kDragFrom) return;
        drag_ = Drag::pull;
        workbench_.begin_pull(held_->vertex, held_->at);
    }
    Q_EMIT has_begun();
    const PictureSize size = camera_.tile_size();
    if (drag_ == Drag::pull) {
        // Tiles have one camera, so the way from the press is the same in each of them.
        const QPointF tile_at = camera_.in_tile(pressed_) + way;
        workbench_.pull_to(point_in_plane(camera_.camera(), held_->at, tile_at.x(), tile_at.y(), size));
    } else if (drag_ == Drag::orbit) {
        workbench_.view().orbit(-kDegreesAPixel * moved.x(), kDegreesAPixel * moved.y());
    } else if (drag_ == Drag::pan) {
        workbench_.view().pan(-moved.x() / size.height, moved.y() / size.height);
    } else if (drag_ == Drag::paint) {
        paint_pins(at);
    } else if (drag_ == Drag::torch) {
        hold_torch(at);
    } else if (drag_ == Drag::gizmo) {
        const QPointF tile_at = camera_.in_tile(at);
        workbench_.set_warps(gizmo_->moved_to(tile_at.x(), tile_at.y()), "gizmo");
    }
    Q_EMIT changed();
}

void Pointer::release() {
    const Drag was = std::exchange(drag_, Drag::none);
    if (was == Drag::pull) workbench_.end_pull();
    if (was == Drag::paint) {
        const std::vector<Index> painted = painted_.members();
        unpins_ ? workbench_.unpin(painted) : workbench_.pin(painted);
    }
    end_drag(was);
    hover_at_ = last_;
    update_hover();
}

bool Pointer::escape() {
    const Drag was = std::exchange(drag_, Drag::none);
    if (was == Drag::none) return false;
    if (was == Drag::pull) workbench_.cancel_pull();
    end_drag(was);
    QUndoStack& history = workbench_.document().undo_stack();
    if (was == Drag::gizmo && history.index() > pressed_step_) history.undo();
    show_cursor();
    Q_EMIT changed();
    return true;
}

/// What is held belongs to a model that is not there any more.
void Pointer::drop() {
    if (drag_ == Drag::none || drag_ == Drag::orbit || drag_ == Drag::pan) return;
    const Drag was = std::exchange(drag_, Drag::none);
    if (was == Drag::pull) workbench_.cancel_pull();
    end_drag(was);
    hover_.reset();
    show_cursor();
}

void Pointer::end_drag(Drag was) {
    if (was == Drag::torch) workbench_.put_out_torch();
    if (was == Drag::gizmo) workbench_.document().end_merge();
    painted_ = VertexSet(0);
    gizmo_.reset();
    held_.reset();
}

void Pointer::wheel(const QWheelEvent& event) {
    camera_.stop_flight();
    ViewState& view = workbench_.view();
    const double steps = event.pixelDelta().isNull() ? event.angleDelta().y() / 120.0 : event.pixelDelta().y() / 40.0;
    const double zoom = view.zoom();
    const double wanted = std::clamp(zoom * std::pow(kZoomAStep, steps), ViewState::kLeastZoom, ViewState::kMostZoom);
    const QPointF at = camera_.in_tile(event.position());
    if (zoom > 0 && wanted != zoom)
        view.set_camera(zoomed_about(camera_.camera(), wanted / zoom, at.x(), at.y(), camera_.tile_size()));
}

void Pointer::double_click(const QMouseEvent& event) {
    if (event.button() != Qt::LeftButton || settings().tool == Tool::pin) return press(event);
    if (const std::optional<Picked> picked = pick_(event.position()))
        camera_.look_at(picked->at);
    else
        camera_.show_all();
}

// Pins

/// Adds the driver's vertices within the grip of what is under the mouse, and the nearest one in any case.
void Pointer::paint_pins(const QPointF& point) {
    const std::optional<Picked> picked = pick_(point);
    if (!picked || !workbench_.state().model) return;
    const std::vector<Vec3f>& driver = drawn_.pose().positions;
    const Vec3f at = (picked->at - drawn_.origin()).cast<float>();
    const auto reach = static_cast<float>(grip());
    Index nearest = 0;
    float least = std::numeric_limits<float>::infinity();
    for (Index v = 0; v < driver.size(); ++v) {
        const float distance = (driver[v] - at).norm();
        if (distance < least) {
            least = distance;
            nearest = v;
        }
        if (distance <= reach) painted_.add(v);
    }
    painted_.add(nearest);
}

/// Warms what is under the mouse; beside the body nothing.
void Pointer::hold_torch(const QPointF& point) {
    if (const std::optional<Picked> picked = pick_(point))
        workbench_.hold_torch(picked->at, cools_);
    else
        workbench_.put_out_torch();
}

std::vector<Index> Pointer::shown_pins() const {
    std::vector<Index> pins = pinned_vertices(workbench_.state().handles);
    if (unpins_)
        std::erase_if(pins, [this](Index v) { return painted_.contains(v); });
    else
        pins.insert(pins.end(), painted_.members().begin(), painted_.members().end());
    return pins;
}

// What is under the mouse

std::vector<GizmoShape> Pointer::gizmos() const {
    const bool are_shown = settings().gizmos && settings().tool == Tool::pull && !settings().split &&
                           workbench_.mode() == Mode::deform && !workbench_.is_pulling() && workbench_.state().model;
    if (!are_shown) return {};
    const Camera& camera = camera_.camera();
    std::vector<GizmoShape> shapes = gizmo_shapes(workbench_.state().warps, rest_box(), camera.eye - camera.target);
    const PictureSize size = camera_.tile_size();
    const auto is_inside = [&](const Vec3d& place) {
        const Vec3d at = camera_.project(place);
        return at.z() > 0 && std::min({at.x(), at.y(), size.width - at.x(), size.height - at.y()}) >= kKnobMargin;
    };
    // An arrow that leaves the picture is shorter, so that its knob can be reached.
    for (GizmoShape& shape : shapes) {
        if (!shape.has_tip || !is_inside(shape.line.front())) continue;
        const Vec3d from = shape.line.front(), way = shape.knob - from;
        for (double part = 0.9; part > 0.05 && !is_inside(shape.knob); part -= 0.1)
            shape.knob = shape.line.back() = from + part * way;
    }
    return shapes;
}

void Pointer::update_hover() {
    if (is_dragging()) return;
    const QPointF at = camera_.in_tile(hover_at_);
    hot_part_ = gizmo_at(gizmos(), camera_.camera(), at.x(), at.y(), camera_.tile_size(), kKnobRadius);
    hover_ = hot_part_ || settings().tool == Tool::turn || workbench_.is_playing() ? std::nullopt : pick_(hover_at_);
    show_cursor();
    Q_EMIT changed();
}

void Pointer::forget_hover() {
    if (!is_dragging()) hover_.reset();
}

void Pointer::leave() {
    hover_timer_.stop();
    hover_.reset();
    if (!is_dragging()) hot_part_.reset();
    Q_EMIT changed();
}

Qt::CursorShape Pointer::cursor() const {
    switch (drag_) {
    case Drag::pull:
    case Drag::pending_pull:
    case Drag::gizmo:
        return Qt::ClosedHandCursor;
    case Drag::pan:
        return Qt::SizeAllCursor;
    case Drag::orbit:
        return Qt::ArrowCursor;
    case Drag::paint:
    case Drag::torch:
        return Qt::CrossCursor;
    case Drag::none:
        break;
    }
    if (hot_part_) return Qt::PointingHandCursor;
    if (hover_) return settings().tool == Tool::pull ? Qt::OpenHandCursor : Qt::CrossCursor;
    return Qt::ArrowCursor;
}

void Pointer::show_cursor() {
    if (widget_.cursor().shape() != cursor()) widget_.setCursor(cursor());
}

} // namespace filigree::studio
