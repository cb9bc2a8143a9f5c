#include "view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace filigree::studio {

namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kSteepest = 89; // degrees above or below: straight down, "up" would have no direction in the picture

/// What zoom divides: the distance, or the height of a parallel projection.
double reach_of(const Camera& camera) {
    return camera.field_of_view_deg > 0 ? (camera.eye - camera.target).norm() : camera.height;
}

} // namespace

void ViewState::set(const ViewSettings& settings) {
    if (settings == settings_) return;
    const bool turns = settings.up != settings_.up;
    settings_ = settings;
    if (turns) camera_.up = up_vector(settings.up);
    Q_EMIT changed();
    if (turns) Q_EMIT camera_changed();
}

void ViewState::set_camera(const Camera& camera) {
    camera_ = camera;
    Q_EMIT camera_changed();
}

double ViewState::zoom() const {
    const double reach = reach_of(camera_);
    return reach > 0 ? fitted_distance_ / reach : 1;
}

void ViewState::set_zoom(double zoom) {
    if (!std::isfinite(zoom)) return;
    const double reach = fitted_distance_ / std::clamp(zoom, kLeastZoom, kMostZoom);
    const Vec3d offset = camera_.eye - camera_.target;
    if (camera_.field_of_view_deg > 0 && offset.norm() > 0)
        camera_.eye = camera_.target + reach / offset.norm() * offset;
    else
        camera_.height = reach;
    Q_EMIT camera_changed();
}

void ViewState::fit(const Box& box, const Vec3d& direction, double aspect) {
    std::array<Vec3f, 8> corners;
    const Vec3d middle = box.centre();
    // A single point has no size: any will do that numbers there can hold.
    const double least = box.diagonal() > 0 ? 0 : std::max(0.5, 1e-6 * middle.norm());
    const Vec3d half = (0.5 * box.size()).cwiseMax(least);
    for (int k = 0; k < 8; ++k)
        corners[std::size_t(k)] =
            half.cwiseProduct(Vec3d(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1)).cast<float>();
    const CameraPoints points{corners, middle};
    const double field_of_view = camera_.field_of_view_deg;
    camera_ =
        fit_camera(std::span(&points, 1), direction, up_vector(settings_.up), aspect > 0 ? aspect : 1, field_of_view);
    fitted_distance_ = reach_of(camera_);
    Q_EMIT camera_changed();
}

void ViewState::orbit(double azimuth, double elevation) {
    const Vec3d offset = camera_.eye - camera_.target;
    const double distance = offset.norm();
    if (!(distance > 0)) return;
    const Vec3d up = up_vector(settings_.up);
    const double now = std::asin(std::clamp(offset.dot(up) / distance, -1.0, 1.0)) / kDegree;
    const double next = std::clamp(now + elevation, -kSteepest, kSteepest);
    Vec3d level = offset - offset.dot(up) * up;
    if (level.norm() < 1e-9 * distance) level = up.cross(camera_.basis().col(0)); // from straight above
    level = Eigen::AngleAxisd(azimuth * kDegree, up) * level.normalized();
    camera_.eye = camera_.target + distance * (std::cos(next * kDegree) * level + std::sin(next * kDegree) * up);
    camera_.up = up;
    Q_EMIT camera_changed();
}

void ViewState::pan(double right, double up) {
    const Mat3d basis = camera_.basis();
    const double distance = (camera_.eye - camera_.target).norm();
    const double height = camera_.field_of_view_deg > 0
                              ? 2 * distance * std::tan(0.5 * kDegree * camera_.field_of_view_deg)
                              : camera_.height;
    const Vec3d step = height * (right * basis.col(0) + up * basis.col(1));
    camera_.eye += step;
    camera_.target += step;
    Q_EMIT camera_changed();
}

} // namespace filigree::studio
