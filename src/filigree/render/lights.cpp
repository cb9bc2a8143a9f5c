#include "filigree/render/lights.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace filigree {

namespace {

constexpr double kKeyReach = 0.16; // of the key light: tangent of half the angle it is seen under

} // namespace

std::array<double, 2> evenly(unsigned i, double shift) {
    const double g = 1.32471795724474602596;
    const auto part = [](double x) { return x - std::floor(x); };
    return {part(shift + (i + 1) / g), part(shift + (i + 1) / (g * g))};
}

std::array<Vec3d, 2> tangents(const Vec3d& n) {
    const Vec3d other = std::abs(n.x()) < 0.7 ? Vec3d::UnitX() : Vec3d::UnitY();
    const Vec3d t = other.cross(n).normalized();
    return {t, n.cross(t)};
}

std::array<Vec3d, 8> corners_of(const Box& box) {
    std::array<Vec3d, 8> corners;
    for (int k = 0; k < 8; ++k)
        corners[k] = Vec3d((k & 1) ? box.max.x() : box.min.x(), (k & 2) ? box.max.y() : box.min.y(),
                           (k & 4) ? box.max.z() : box.min.z());
    return corners;
}

Lights::Lights(const Vec3d& back, const Vec3d& camera_right, const Vec3d& up) {
    const Vec3d level = up.cross(back);
    right_ = level.norm() > 1e-3 ? level.normalized() : camera_right;
    const Vec3d front = right_.cross(up);
    key_ = (-0.72 * right_ + 0.72 * up + 0.42 * front).normalized();
    sky_ = (up + 0.55 * front).normalized();
    fill_ = (0.80 * right_ + 0.05 * up + 0.45 * front).normalized();
    // Looking down (or up) along the axis, front is no longer towards the viewer: turn all that way.
    const double along = back.dot(up);
    if (std::abs(along) > 0.85)
        for (Vec3d* d : {&key_, &sky_, &fill_}) *d = (*d + 0.6 * along * up).normalized();
}

Vec3d Lights::key(unsigned i) const {
    const auto [u, v] = evenly(i, 0.5);
    const double r = kKeyReach * std::sqrt(u);
    return around(key_, 1, r, 2 * std::numbers::pi * v).normalized();
}

Vec3d Lights::sky(unsigned i) const {
    const auto [u, v] = evenly(i, 0.25);
    const double z = 1 - u, r = std::sqrt(std::max(0.0, 1 - z * z));
    return around(sky_, z, r, 2 * std::numbers::pi * v);
}

Vec3d Lights::around(const Vec3d& axis, double along, double across, double angle) const {
    const Vec3d a = (right_ - axis * axis.dot(right_)).normalized(), b = axis.cross(a);
    return along * axis + across * (std::cos(angle) * a + std::sin(angle) * b);
}

LightView::LightView(const Vec3d& direction, const Box& box, int size) {
    const auto [a, b] = tangents(direction);
    Vec3d lo = Vec3d::Constant(std::numeric_limits<double>::infinity()), hi = -lo;
    for (const Vec3d& c : corners_of(box)) {
        const Vec3d p(a.dot(c), b.dot(c), direction.dot(c));
        lo = lo.cwiseMin(p);
        hi = hi.cwiseMax(p);
    }
    const double margin = 4.0 / size; // so that the outermost texels stay empty
    const Vec3d extent = (hi - lo).cwiseMax(1e-6) * (1 + 2 * margin);
    const Vec3d centre = 0.5 * (lo + hi);
    const double near = hi.z() + 0.02, far = lo.z() - 4 * kGroundSide; // the ground far behind is lit too
    matrix = Eigen::Matrix4d::Zero();
    matrix.row(0) << 2 / extent.x() * a.transpose(), -2 / extent.x() * centre.x();
    matrix.row(1) << 2 / extent.y() * b.transpose(), -2 / extent.y() * centre.y();
    matrix.row(2) << -2 / (near - far) * direction.transpose(), (near + far) / (near - far);
    matrix(3, 3) = 1;
    texel = std::max(extent.x(), extent.y()) / size;
}

Eigen::Matrix4d LightView::to_texture() const {
    Eigen::Matrix4d half = Eigen::Matrix4d::Identity();
    half.diagonal() << 0.5, 0.5, 0.5, 1;
    half.col(3) << 0.5, 0.5, 0.5, 1;
    return half * matrix;
}

} // namespace filigree
