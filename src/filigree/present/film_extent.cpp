#include "filigree/present/film_extent.h"

#include <cmath>
#include <map>
#include <numbers>

namespace filigree {

namespace {

constexpr std::size_t kPointsKept = 20'000; // of a moment: a film may be long
constexpr double kRows = 200;               // of a turning body's profile, over its diagonal
constexpr int kAround = 48;                 // points of a circle

} // namespace

void FilmExtent::add(std::span<const Vec3f> positions, const Vec3d& origin) {
    const Box own = bounds(positions);
    if (own.empty()) return;
    const Box here{own.min + origin, own.max + origin};
    if (!origin_) origin_ = here.centre();
    const std::size_t stride = 1 + positions.size() / kPointsKept;
    for (std::size_t v = 0; v < positions.size(); v += stride)
        points_.push_back((positions[v].cast<double>() + origin - *origin_).cast<float>());
    box_.extend(here.min);
    box_.extend(here.max);
}

void FilmExtent::widen(double radius) {
    radius_ = radius;
    box_.min.array() -= radius;
    box_.max.array() += radius;
}

CameraPoints FilmExtent::points_turning(UpAxis axis, std::vector<Vec3f>& ring) const {
    const Vec3d up = up_vector(axis), centre = box_.centre();
    // A lathe's profile says enough: for each height the largest radius.
    std::map<long, std::pair<double, double>> profile;
    for (const Vec3f& point : points_) {
        const Vec3d p = point.cast<double>() + *origin_ - centre;
        const double height = p.dot(up), radius = (p - height * up).norm();
        auto& [most, at] = profile[std::lround(height / std::max(box_.diagonal(), 1e-300) * kRows)];
        if (radius >= most) most = radius, at = height;
    }
    ring.clear();
    for (const auto& [row, edge] : profile)
        for (int k = 0; k < kAround; ++k)
            ring.push_back(
                (Eigen::AngleAxisd(k * 2 * std::numbers::pi / kAround, up) * (edge.first * up.unitOrthogonal()) +
                 edge.second * up)
                    .cast<float>());
    return {ring, centre, radius_};
}

double FilmExtent::ground_level(UpAxis up) const { return box_.min[static_cast<int>(up)] - 1e-4 * box_.diagonal(); }

} // namespace filigree
