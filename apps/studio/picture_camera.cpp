#include "picture_camera.h"

#include "drawn_objects.h"
#include "motion_cameras.h"

#include <QStyle>

#include <algorithm>
#include <cmath>

namespace filigree::studio {

namespace {

constexpr double kFlight = 0.25; // s on the way to another camera
constexpr double kLatest = 1.5;  // s that are looked at while a body moves, as its future is not known
constexpr double kLag = 0.1;     // s that the camera then stays behind

/// Where a mesh is looked at from when it is opened: from the front, a little from the right and above.
Vec3d first_direction(UpAxis up) {
    const Vec3d above = up_vector(up);
    return (view_direction(View::front, up) + 0.55 * view_direction(View::side, up) + 0.42 * above).normalized();
}

double distance(const Camera& camera) { return (camera.eye - camera.target).norm(); }

} // namespace

PictureCamera::PictureCamera(Workbench& workbench, DrawnObjects& drawn, const QWidget& widget)
    : workbench_(workbench), drawn_(drawn), widget_(widget),
      is_animated_(widget.style()->styleHint(QStyle::SH_Widget_Animation_Duration, nullptr, &widget) > 0) {
    connect(&timer_, &QTimer::timeout, this, &PictureCamera::fly_on);
    connect(&workbench.view(), &ViewState::changed, this, &PictureCamera::follow_view);
    connect(&workbench, &Workbench::opened, this, &PictureCamera::follow_opened);
    connect(&workbench, &Workbench::opened_motion, this, &PictureCamera::follow_opened);
    connect(&workbench, &Workbench::pose_changed, this, &PictureCamera::follow_motion);
    connect(&workbench.view(), &ViewState::changed, this, &PictureCamera::follow_motion);
    connect(&workbench, &Workbench::mode_changed, this, &PictureCamera::follow_body);
    connect(&workbench.playback(), &Playback::state_changed, this, &PictureCamera::follow_body);
}

// Tiles

PictureSize PictureCamera::tile_size() const {
    return {std::max(1.0, double(widget_.width()) / tile_count()), std::max(1.0, double(widget_.height()))};
}

QPointF PictureCamera::in_tile(const QPointF& point) const {
    const double width = tile_size().width;
    const double tile = std::clamp(std::floor(point.x() / width), 0.0, double(tile_count() - 1));
    return {point.x() - tile * width, point.y()};
}

QPointF PictureCamera::from_tile(const Vec3d& place, int tile) const {
    return {place.x() + tile * tile_size().width, place.y()};
}

Vec3d PictureCamera::project(const Vec3d& world) const {
    const PictureSize size = tile_size();
    return camera().project(world, size.width, size.height);
}

// What is shown

void PictureCamera::show_all_from(const Vec3d& direction) { fit(direction, true); }

void PictureCamera::show_all() {
    const Vec3d direction = camera().eye - camera().target;
    fit(direction.norm() > 0 ? direction : first_direction(workbench_.view().settings().up), true);
}

void PictureCamera::show(const Box& box, const Vec3d& direction) {
    stop_flight();
    workbench_.view().fit(box, direction.normalized(), tile_size().aspect());
    fitted_ = camera();
    fitted_box_ = box;
}

void PictureCamera::fit(const Vec3d& direction, bool may_fly) {
    Box box = drawn_.box();
    if (box.empty()) return;
    if (const Box room = body_room(); workbench_.mode() == Mode::body && !room.empty()) {
        box.extend(room.min);
        box.extend(room.max);
    }
    const Camera from = camera();
    show(box, direction);
    if (std::exchange(was_fitted_, true) && may_fly) fly_from(from);
}

void PictureCamera::look_at(const Vec3d& point) {
    const Camera from = camera();
    Camera to = from;
    to.target = point;
    to.eye += to.target - from.target;
    stop_flight();
    workbench_.view().set_camera(to);
    fly_from(from);
}

void PictureCamera::follow_size() {
    const bool was_untouched = was_fitted_ && camera().eye == fitted_.eye && camera().target == fitted_.target;
    if (was_untouched && !fly_to_) fit(camera().eye - camera().target, false);
}

void PictureCamera::follow_view() {
    const bool is_split = workbench_.view().settings().split;
    if (is_split == std::exchange(was_split_, is_split) || !was_fitted_) return;
    const double zoom = workbench_.view().zoom();
    fit(camera().eye - camera().target, false);
    workbench_.view().set_zoom(zoom);
    fitted_ = camera();
}

/// A shape whose slider moves stays where it is, unless it leaves the picture.
void PictureCamera::follow_opened() {
    const State& state = workbench_.state();
    if (!state.source) return;
    const Box box = opened_box();
    const std::string name = state.shape ? "shape " + state.shape->name : state.source->path;
    const bool is_same = was_fitted_ && name == fitted_name_ &&
                         (box.centre() - fitted_box_.centre()).norm() < 0.25 * fitted_box_.diagonal() &&
                         box.diagonal() < 1.5 * fitted_box_.diagonal() && box.diagonal() > 0.6 * fitted_box_.diagonal();
    fitted_name_ = name;
    if (is_same || box.empty()) return;
    show(box, first_direction(workbench_.view().settings().up));
    was_fitted_ = true;
}

/// Of what was opened, as it is posed: the driver's box, and as much around it as the detail needs at rest.
Box PictureCamera::opened_box() const {
    const State& state = workbench_.state();
    Box box = state.source->box;
    if (state.recording && state.recording->original) { // some frames tell where it goes
        constexpr std::size_t kSome = 16;
        const std::size_t count = state.recording->frames.size(), step = std::max<std::size_t>(1, count / kSome);
        for (std::size_t frame = 0; frame < count; frame += step) {
            const Box there = workbench_.motion_box(frame);
            box.extend(there.min);
            box.extend(there.max);
        }
        return box;
    }
    const Pose* pose = workbench_.pose();
    if (!pose || !state.model || pose->positions.size() != state.model->driver().vertices.size()) return box;
    const Vec3d origin = state.source->mesh.origin;
    const Box rest = bounds(driver_positions(*state.model)), posed = bounds(pose->positions);
    const double margin =
        std::max((origin + rest.min - box.min).maxCoeff(), (box.max - (origin + rest.max)).maxCoeff());
    if (posed.empty() || !posed.size().allFinite()) return box;
    box.min = origin + posed.min - Vec3d::Constant(margin);
    box.max = origin + posed.max + Vec3d::Constant(margin);
    return box;
}

/// Of the body; empty without one.
Box PictureCamera::body_room() const {
    const auto made = workbench_.playback().made();
    return made ? room_of(*made, up_vector(workbench_.view().settings().up)) : Box();
}

bool PictureCamera::is_seen(const Box& box) const {
    const PictureSize size = tile_size();
    for (int k = 0; k < 8; ++k) {
        const Vec3d at = project(Vec3d(k & 1 ? box.max.x() : box.min.x(), k & 2 ? box.max.y() : box.min.y(),
                                       k & 4 ? box.max.z() : box.min.z()));
        if (!(at.z() > 0 && at.x() >= 0 && at.y() >= 0 && at.x() <= size.width && at.y() <= size.height)) return false;
    }
    return true;
}

/// When a body is made, the view is widened so that its fall stays in the picture; it is never narrowed.
void PictureCamera::follow_body() {
    const auto made = workbench_.mode() == Mode::body ? workbench_.playback().made() : nullptr;
    if (made == framed_body_) return;
    framed_body_ = made;
    const Box room = body_room();
    if (!made || !was_fitted_ || room.empty() || is_seen(room)) return;
    stop_flight();
    const Camera from = camera();
    show(room, from.eye - from.target);
    if (distance(from) > distance(fitted_)) workbench_.view().set_zoom(distance(fitted_) / distance(from));
    fly_from(from);
}

/// Goes along with what moves. What the user does to the view meanwhile stays: direction, zoom and shift.
void PictureCamera::follow_motion() {
    const bool follows =
        workbench_.view().settings().follow && workbench_.mode() == Mode::body && workbench_.frame_count() > 1;
    if (!follows) {
        followed_.reset();
        zoom_ = 1;
        aside_ = Vec3d::Zero();
        return;
    }
    if (followed_ && distance(camera()) > 0) {
        zoom_ *= distance(*followed_) / distance(camera());
        aside_ += camera().target - followed_->target;
    }
    const Camera of_frame = camera_of_frame(std::min(workbench_.frame(), workbench_.frame_count() - 1));
    Camera to = camera();
    const Vec3d direction = (to.eye - to.target).normalized();
    to.target = of_frame.target + aside_;
    to.eye = to.target + distance(of_frame) / zoom_ * direction;
    to.height = of_frame.height / zoom_;
    stop_flight();
    followed_ = to;
    workbench_.view().set_camera(to);
}

Camera PictureCamera::camera_of_frame(std::size_t frame) {
    const std::size_t count = workbench_.frame_count();
    const Vec3d direction = (camera().eye - camera().target).normalized();
    if (workbench_.playback().is_playing()) {
        const auto latest = std::size_t(std::ceil(kLatest * workbench_.frames_per_second()));
        const std::size_t first = frame + 1 > latest ? frame + 1 - latest : 0;
        Camera now = motion_cameras(workbench_, first, frame + 1, camera(), tile_size().aspect()).back();
        const std::size_t before_this = std::exchange(followed_frame_, frame); // frames may have been left out since
        if (!followed_ || frame < before_this) return now;
        const double share = 1 - std::exp(-double(frame - before_this) / (kLag * workbench_.frames_per_second()));
        const Vec3d before = followed_->target - aside_;
        const double reach = zoom_ * distance(*followed_) + share * (distance(now) - zoom_ * distance(*followed_));
        now.target = before + share * (now.target - before);
        now.eye = now.target + reach * direction;
        return now;
    }
    constexpr double kOther = 0.05; // of directions: distances would be others
    const auto& recording = workbench_.state().recording;
    if (track_.empty() || track_of_ != recording || (track_direction_ - direction).norm() > kOther) {
        track_ = motion_cameras(workbench_, 0, count, camera(), tile_size().aspect());
        track_of_ = recording;
        track_direction_ = direction;
    }
    return track_[std::min(frame, track_.size() - 1)];
}

std::vector<QPointF> PictureCamera::places_of(std::span<const Index> some, std::span<const Vec3f> positions,
                                              const Vec3d& origin) const {
    std::vector<QPointF> places;
    for (const Index v : some)
        if (v < positions.size()) places.push_back(place_of(origin + positions[v].cast<double>()));
    return places;
}

// On the way

void PictureCamera::fly_from(const Camera& from) {
    if (!is_animated_) return;
    fly_to_ = camera();
    fly_from_ = from;
    flight_.start();
    workbench_.view().set_camera(from);
    timer_.start(15);
}

void PictureCamera::fly_on() {
    if (!fly_to_) return timer_.stop();
    const double t = 1e-9 * double(flight_.nsecsElapsed()) / kFlight;
    if (t >= 1) return land();
    workbench_.view().set_camera(camera_between(*fly_from_, *fly_to_, t * t * (3 - 2 * t)));
}

void PictureCamera::land() {
    if (!fly_to_) return;
    const Camera to = *fly_to_;
    stop_flight();
    workbench_.view().set_camera(to);
}

void PictureCamera::stop_flight() {
    timer_.stop();
    fly_from_.reset();
    fly_to_.reset();
}

} // namespace filigree::studio
