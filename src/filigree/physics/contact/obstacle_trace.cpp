#include "filigree/physics/contact/obstacle_trace.h"

#include <cmath>

namespace filigree {

namespace {

constexpr double kBallMargin = 1e-9; // of its radius
constexpr double kClear = 1e-6;      // of the size

/// Deeper than half its radius a point goes back along the way it came, else straight out.
WallTouch follow_beside(const Ball& ball, Vec3d& place, const Vec3d& target) {
    const double margin = kBallMargin * ball.radius, free = ball.radius + margin;
    const Vec3d from = place - ball.centre, to = target - ball.centre, way = to - from;
    const double squared = way.squaredNorm();
    const double nearest = squared > 0 ? std::clamp(-from.dot(way) / squared, 0.0, 1.0) : 1;
    if (!((from + nearest * way).norm() < ball.radius)) {
        place = target;
        return {};
    }
    Vec3d out = to;
    if (!(to.norm() > 0.5 * ball.radius && to.dot(from) > 0)) { // where the way came in
        const double along = from.dot(way), outside = from.squaredNorm() - ball.radius * ball.radius;
        const double root = std::sqrt(std::max(0.0, along * along - squared * outside));
        out = from + std::clamp((-along - root) / squared, 0.0, 1.0) * way;
    }
    const Vec3d normal = out.normalized();
    place = ball.centre + free * normal;
    return {std::max(0.0, ball.radius - normal.dot(to)), normal};
}

} // namespace

ObstacleShape::ObstacleShape(const Obstacle& obstacle) {
    ball_ = std::get_if<Ball>(&obstacle.shape);
    ground_ = std::get_if<HalfSpace>(&obstacle.shape);
    if (const auto* box = std::get_if<Cuboid>(&obstacle.shape)) surface_ = std::make_shared<ObstacleSurface>(*box);
    if (const auto* mesh = std::get_if<MeshObstacle>(&obstacle.shape)) {
        surface_ = mesh->surface;
        offset_ = mesh->offset;
        is_mesh_ = true;
    }
    if (ball_) box_ = {ball_->centre.array() - ball_->radius, ball_->centre.array() + ball_->radius};
    if (!surface_) return;
    box_ = {surface_->box().min + offset_, surface_->box().max + offset_};
    for (const Edge& edge : surface_->sharp_edges()) sharp_edges_.push_back({edge.from + offset_, edge.to + offset_});
}

WallTouch ObstacleShape::follow(Vec3d& place, const Vec3d& target) const {
    if (ball_) return follow_beside(*ball_, place, target);
    Vec3d own = place - offset_;
    const WallTouch touch = surface_->follow(own, target - offset_);
    place = own + offset_;
    return touch;
}

double ObstacleShape::clearance(const Vec3d& point, double reach) const {
    if (ball_) return std::min(reach, std::abs((point - ball_->centre).norm() - ball_->radius));
    return surface_->clearance(point - offset_, reach);
}

double ObstacleShape::gap(const Box& box, const Eigen::Isometry3d& motion) const {
    if (ground_) {
        const Vec3d normal = motion.linear() * ground_->normal.normalized();
        return normal.dot(box.centre() - motion * ground_->point) - 0.5 * normal.cwiseAbs().dot(box.size());
    }
    if (box_.empty()) return 0;
    const Vec3d centre = motion * box_.centre(), half = motion.linear().cwiseAbs() * (0.5 * box_.size());
    return ((centre - half) - box.max).cwiseMax(box.min - (centre + half)).cwiseMax(0).norm();
}

std::optional<std::pair<double, Vec3d>> ObstacleShape::closest(const Vec3d& point, double reach) const {
    const ClosestWall wall = ball_ ? ClosestWall{} : surface_->closest(point - offset_, reach);
    if (!ball_ && wall.triangle == kNoIndex) return std::nullopt;
    const Vec3d away = ball_ ? Vec3d(point - ball_->centre) : Vec3d(point - offset_ - wall.position);
    const double length = away.norm(), distance = ball_ ? std::abs(length - ball_->radius) : length;
    if (!(distance <= reach) || !(length > 0)) return std::nullopt;
    const double side = ball_ && length < ball_->radius ? -1 : 1;
    return std::pair(distance, Vec3d(side / length * away));
}

bool ObstacleShape::is_between(const Vec3d& from, const Vec3d& to) const {
    if (!ball_) return surface_->first_crossing(from - offset_, to - offset_).has_value();
    return ((from - ball_->centre).norm() < ball_->radius) != ((to - ball_->centre).norm() < ball_->radius);
}

bool ObstacleShape::is_inside(const Vec3d& point) const {
    if (ball_) return (point - ball_->centre).norm() < ball_->radius;
    return surface_->is_closed() && surface_->closest(point - offset_).distance < 0;
}

Vec3d ObstacleShape::exit(const Vec3d& point) const {
    if (ball_) {
        const Vec3d out = point - ball_->centre;
        const Vec3d normal = out.norm() > 0 ? Vec3d(out.normalized()) : Vec3d(Vec3d::UnitY());
        return ball_->centre + (1 + kBallMargin) * ball_->radius * normal;
    }
    const ClosestWall wall = surface_->closest(point - offset_);
    const double clear = kClear * surface_->box().diagonal(); // corners are floats
    return wall.position + clear * wall.normal + offset_;
}

} // namespace filigree
