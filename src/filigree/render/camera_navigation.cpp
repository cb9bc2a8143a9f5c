#include "filigree/render/camera_navigation.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace filigree {

namespace {

/// Model units from the bottom to the top of the picture, at a distance along the view.
double visible_height(const Camera& camera, double distance) {
    if (!(camera.field_of_view_deg > 0)) return camera.height;
    return 2 * distance * std::tan(radians(camera.field_of_view_deg) / 2);
}

} // namespace

Camera zoomed_about(const Camera& camera, double factor, double x, double y, const PictureSize& size) {
    const Vec3d fixed = point_in_plane(camera, camera.target, x, y, size);
    Camera result = camera;
    result.eye = fixed + (camera.eye - fixed) / factor;
    result.target = fixed + (camera.target - fixed) / factor;
    result.height /= factor;
    return result;
}

Camera camera_between(const Camera& from, const Camera& to, double t) {
    const Vec3d back_from = from.eye - from.target, back_to = to.eye - to.target;
    const double distance_from = back_from.norm(), distance_to = back_to.norm();
    if (t >= 1 || !(distance_from > 0) || !(distance_to > 0)) return to;
    const Eigen::Quaterniond turn_from(from.basis()), turn_to(to.basis());
    const Eigen::Quaterniond turn = turn_from.slerp(t, turn_to);
    Camera result = to;
    result.target = from.target + t * (to.target - from.target);
    result.height = from.height * std::pow(to.height / from.height, t);
    const double distance = distance_from * std::pow(distance_to / distance_from, t);
    result.eye = result.target + distance * (turn * Vec3d::UnitZ());
    result.up = turn * Vec3d::UnitY();
    return result;
}

double pixels_a_unit(const Camera& camera, const Vec3d& world, const PictureSize& size) {
    const double distance = -camera.to_camera(world).z();
    if (camera.field_of_view_deg > 0 && !(distance > 0)) return 0;
    return size.height / visible_height(camera, distance);
}

double most_pixels_a_unit(const Camera& camera, const Box& box, const PictureSize& size) {
    if (box.empty() || !(camera.field_of_view_deg > 0)) return size.height / visible_height(camera, 1);
    const Vec3d nearest = camera.eye.cwiseMax(box.min).cwiseMin(box.max);
    const double distance = (nearest - camera.eye).norm();
    return distance > 0 ? size.height / visible_height(camera, distance) : std::numeric_limits<double>::infinity();
}

Vec3d point_in_plane(const Camera& camera, const Vec3d& through, double x, double y, const PictureSize& size) {
    const Camera::Ray ray = camera.ray(x, y, size.width, size.height);
    const Vec3d back = camera.basis().col(2);
    const double slope = ray.direction.dot(back);
    if (slope == 0) return through;
    return ray.origin + ray.direction * ((through - ray.origin).dot(back) / slope);
}

std::optional<double> point_on_line(const Camera& camera, const Vec3d& through, const Vec3d& along, double x, double y,
                                    const PictureSize& size) {
    constexpr double kLeastSine2 = 1e-3; // of the angle between line and ray: below, a pixel is worth any distance
    const Camera::Ray ray = camera.ray(x, y, size.width, size.height);
    const Vec3d gap = through - ray.origin;
    const double cosine = along.dot(ray.direction), sine2 = 1 - cosine * cosine;
    if (sine2 < kLeastSine2) return std::nullopt;
    return (cosine * gap.dot(ray.direction) - gap.dot(along)) / sine2;
}

} // namespace filigree
