#include "filigree/render.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace filigree {

namespace {

/// Columns right, up and back. Back is `back`, or z when that has no direction.
Mat3d basis_of(const Vec3d& back, const Vec3d& up) {
    constexpr double kParallel = 1e-6; // sine of the angle between view and up
    Mat3d basis;
    const double distance = back.stableNorm();
    const Vec3d b = distance > 0 ? Vec3d(back / distance) : Vec3d::UnitZ();
    const Vec3d u = up.stableNormalized();
    Vec3d right = u.cross(b);
    if (!(right.norm() > kParallel)) {
        // Where tilting there from the front ends: seen from above, the front is at the bottom of the picture.
        const Vec3d away = std::abs(b.z()) < 0.9 ? Vec3d(0, 0, -1) : Vec3d(0, 1, 0);
        right = (u.dot(b) < 0 ? Vec3d(-away) : away).cross(b);
    }
    basis.col(0) = right.normalized();
    basis.col(1) = b.cross(basis.col(0));
    basis.col(2) = b;
    return basis;
}

/// How far points reach in the camera's axes, and along the normals of the frustum's four sides, whose slopes are
/// `slope_x` and `slope_y`: a point is inside when x + slope_x z <= eye.x + slope_x eye.z, and so on.
struct Reach {
    double slope_x, slope_y;
    Box box = {};
    double right = -kInfinity, left = -kInfinity, top = -kInfinity, bottom = -kInfinity;

    static constexpr double kInfinity = std::numeric_limits<double>::infinity();

    /// A ball, or a point.
    void extend(const Vec3d& p, double radius = 0) {
        box.extend(p + Vec3d::Constant(radius));
        box.extend(p - Vec3d::Constant(radius));
        const double across = radius * std::sqrt(1 + slope_x * slope_x),
                     along = radius * std::sqrt(1 + slope_y * slope_y);
        right = std::max(right, p.x() + slope_x * p.z() + across);
        left = std::max(left, -p.x() + slope_x * p.z() + across);
        top = std::max(top, p.y() + slope_y * p.z() + along);
        bottom = std::max(bottom, -p.y() + slope_y * p.z() + along);
    }
};

/// Half the picture's extent at distance 1 without the margin; something is left of the smallest picture.
double slope(double half_extent, double half_margin) { return std::max(half_extent - half_margin, 0.1 * half_extent); }

Box unit_cube() {
    Box box;
    box.min = Vec3d::Constant(-0.5);
    box.max = Vec3d::Constant(0.5);
    return box;
}

/// Some point of the object, so that far from the world's origin the rest is done with small numbers.
std::optional<Vec3d> reference_point(std::span<const CameraPoints> points) {
    for (const CameraPoints& part : points)
        if (!part.positions.empty()) return part.origin + part.positions.front().cast<double>();
    return std::nullopt;
}

} // namespace

Mat3d Camera::basis() const { return basis_of(eye - target, up); }

Eigen::Matrix4d Camera::projection(double aspect, double near, double far) const {
    Eigen::Matrix4d matrix = Eigen::Matrix4d::Zero();
    if (field_of_view_deg > 0) {
        const double scale = 1 / std::tan(radians(field_of_view_deg) / 2);
        matrix(0, 0) = scale / aspect;
        matrix(1, 1) = scale;
        matrix(2, 2) = -(far + near) / (far - near);
        matrix(2, 3) = -2 * far * near / (far - near);
        matrix(3, 2) = -1;
    } else {
        matrix(0, 0) = 2 / (height * aspect);
        matrix(1, 1) = 2 / height;
        matrix(2, 2) = -2 / (far - near);
        matrix(2, 3) = -(far + near) / (far - near);
        matrix(3, 3) = 1;
    }
    return matrix;
}

Vec3d Camera::project(const Vec3d& world, double width, double picture_height) const {
    const Vec3d p = to_camera(world);
    const double distance = -p.z();
    const double visible_height =
        field_of_view_deg > 0 ? 2 * distance * std::tan(radians(field_of_view_deg) / 2) : height;
    const double pixels_a_unit = picture_height / visible_height;
    return {width / 2 + pixels_a_unit * p.x(), picture_height / 2 - pixels_a_unit * p.y(), distance};
}

Camera::Ray Camera::ray(double x, double y, double width, double picture_height) const {
    const Mat3d axes = basis();
    const double visible_height = field_of_view_deg > 0 ? 2 * std::tan(radians(field_of_view_deg) / 2) : height;
    const double units_a_pixel = visible_height / picture_height;
    const Vec3d across = units_a_pixel * ((x - width / 2) * axes.col(0) + (picture_height / 2 - y) * axes.col(1));
    if (field_of_view_deg > 0) return {eye, (across - axes.col(2)).normalized()};
    return {eye + across, -axes.col(2)};
}

CameraPoints points_of_faces(const Mesh& mesh, std::vector<Vec3f>& room, double radius) {
    const CameraPoints all{mesh.positions, mesh.origin, radius};
    if (mesh.face_count() == 0) return all;
    std::vector<bool> is_used(mesh.vertex_count(), false);
    for (const Index v : mesh.corners) is_used[v] = true;
    if (std::ranges::find(is_used, false) == is_used.end()) return all;
    room.clear();
    for (std::size_t v = 0; v < is_used.size(); ++v)
        if (is_used[v]) room.push_back(mesh.positions[v]);
    return {room, mesh.origin, radius};
}

Camera fit_camera(std::span<const CameraPoints> points, const Vec3d& direction, const Vec3d& up, double aspect,
                  double field_of_view_deg, double margin) {
    const double half_height = field_of_view_deg > 0 ? std::tan(radians(field_of_view_deg) / 2) : 0.5;
    const double half_margin = 2 * margin * half_height;
    Reach reach{slope(aspect * half_height, half_margin), slope(half_height, half_margin)};

    const Mat3d axes = basis_of(direction, up);
    const std::optional<Vec3d> reference = reference_point(points);
    for (const CameraPoints& part : points) {
        if (part.positions.empty()) continue;
        const Vec3d offset = axes.transpose() * (part.origin - *reference);
        for (const Vec3f& position : part.positions)
            reach.extend(axes.transpose() * position.cast<double>() + offset, part.radius);
    }
    if (!reference) {
        const Box cube = unit_cube();
        for (int corner = 0; corner < 8; ++corner)
            reach.extend(axes.transpose() * Vec3d(corner & 1 ? cube.max.x() : cube.min.x(),
                                                  corner & 2 ? cube.max.y() : cube.min.y(),
                                                  corner & 4 ? cube.max.z() : cube.min.z()));
    }

    const Box& box = reach.box;
    const double diagonal = box.diagonal();
    Camera camera;
    camera.up = up;
    camera.field_of_view_deg = std::max(field_of_view_deg, 0.0);
    Vec3d eye = box.centre();
    if (field_of_view_deg > 0) {
        // Between opposite sides the eye is where both touch; along the view the narrower pair decides.
        eye.x() = (reach.right - reach.left) / 2;
        eye.y() = (reach.top - reach.bottom) / 2;
        const double depth_x = (reach.right + reach.left) / (2 * reach.slope_x);
        const double depth_y = (reach.top + reach.bottom) / (2 * reach.slope_y);
        constexpr double kLeastDistance = 1e-3; // of the diagonal: points in a line with the view leave it open
        const double least = diagonal > 0 ? kLeastDistance * diagonal : 1;
        eye.z() = std::max({depth_x, depth_y, box.max.z() + least});
        camera.height = 2 * half_height * (eye.z() - box.centre().z());
    } else {
        const Vec3d size = box.size();
        const double height = std::max(size.x() / (2 * reach.slope_x), size.y() / (2 * reach.slope_y));
        camera.height = height > 0 ? height : diagonal > 0 ? diagonal : 1;
        eye.z() = box.max.z() + (diagonal > 0 ? diagonal : 1);
    }
    const Vec3d target(eye.x(), eye.y(), box.centre().z());
    const Vec3d origin = reference.value_or(Vec3d::Zero());
    camera.eye = origin + axes * eye;
    camera.target = origin + axes * target;
    return camera;
}

Camera turned(const Camera& camera, double degrees) {
    Camera result = camera;
    const Eigen::AngleAxisd turn(radians(degrees), camera.up.stableNormalized());
    result.eye = camera.target + turn * (camera.eye - camera.target);
    return result;
}

} // namespace filigree
