#include "filigree/present/warp_gizmo.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace filigree {

namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kGap = 0.03;   // between the mesh and a handle, diagonals
constexpr double kArrow = 0.08; // length of an arrow, diagonals

/// The mesh's box along and across the axis of the warps, and where the warps carry points and directions of it.
struct WarpFrame {
    Vec3d centre, axis, side, third; ///< side: where bending goes; third: the side that the viewer sees
    double half = 0, half_side = 0, half_third = 0, diagonal = 0;
    std::unique_ptr<SpaceWarp> warp;

    WarpFrame(const Warps& warps, const Box& box, const Vec3d& towards_viewer)
        : centre(box.centre()), diagonal(box.diagonal()) {
        const int a = static_cast<int>(warps.axis), b = (a + 1) % 3, c = (a + 2) % 3;
        axis = Vec3d::Unit(a);
        side = Vec3d::Unit(b);
        third = (towards_viewer[c] < 0 ? -1 : 1) * Vec3d::Unit(c);
        half = box.size()[a] / 2;
        half_side = box.size()[b] / 2;
        half_third = box.size()[c] / 2;
        warp = make_warp(warps, box);
    }
    Vec3d place(const Vec3d& rest) const { return warp ? warp->position(rest) : rest; }
    Vec3d turn(const Vec3d& rest, const Vec3d& direction) const {
        const Vec3d turned = warp ? Vec3d(warp->warp(rest).gradient * direction) : direction;
        return turned.norm() > 0 ? turned.normalized() : direction;
    }
    Vec3d high() const { return centre + half * axis; }
    Vec3d low() const { return centre - half * axis; }
    Vec3d outer() const { return half_third * third; } ///< from the axis to the side that the viewer sees
};

std::vector<Vec3d> arc(const Vec3d& centre, const Vec3d& from, const Vec3d& towards, double radius, double begin,
                       double end) {
    const int steps = std::max(2, static_cast<int>(std::ceil(std::abs(end - begin) / (kPi / 32))));
    std::vector<Vec3d> points;
    for (int i = 0; i <= steps; ++i) {
        const double t = begin + (end - begin) * i / steps;
        points.push_back(centre + radius * (std::cos(t) * from + std::sin(t) * towards));
    }
    return points;
}

/// A direction made one of a right-handed pair with `axis`.
Vec3d across(const Vec3d& direction, const Vec3d& axis) {
    return (direction - direction.dot(axis) * axis).normalized();
}

GizmoShape arrow(WarpKind part, const Vec3d& from, const Vec3d& direction, double length) {
    return {part, {from, from + length * direction}, from + length * direction, true};
}

/// The circle that the bending handle moves on, in the plane of the side that the viewer sees: about its warped centre,
/// from the low end towards the side.
struct BendCircle {
    Vec3d centre, from, towards;
    double radius, angle;
    BendCircle(const WarpFrame& frame, const Warps& warps)
        : centre(frame.place(frame.centre + frame.outer())), from(-frame.axis), towards(frame.side),
          radius((frame.place(frame.low() + frame.outer()) - centre).norm() + 1.5 * kGap * frame.diagonal) {
        // Both ends tilt towards the side by half the angle; from the middle of the arc an end is seen at half of that.
        angle = warps.bend / 4 * kPi / 180;
    }
};

/// The ring about the high end that is turned for twist.
struct TwistRing {
    Vec3d centre, axis, from, towards;
    double radius;
    explicit TwistRing(const WarpFrame& frame) {
        const Vec3d rest = frame.high();
        centre = frame.place(rest);
        axis = frame.turn(rest, frame.axis);
        from = across(frame.turn(rest, frame.side), axis);
        towards = axis.cross(from);
        centre += kGap * frame.diagonal * axis;
        radius = std::clamp(0.8 * std::sqrt(frame.half_side * frame.half_third), 0.05 * frame.diagonal,
                            0.3 * frame.diagonal);
    }
};

} // namespace

std::vector<GizmoShape> gizmo_shapes(const Warps& warps, const Box& rest_box, const Vec3d& towards_viewer) {
    std::vector<GizmoShape> shapes;
    if (rest_box.empty() || !(rest_box.diagonal() > 0)) return shapes;
    const WarpFrame frame(warps, rest_box, towards_viewer);
    const double gap = kGap * frame.diagonal, length = kArrow * frame.diagonal;

    const Vec3d end = frame.turn(frame.high(), frame.axis);
    shapes.push_back(arrow(WarpKind::stretch, frame.place(frame.high()) + gap * end, end, length));

    const Vec3d middle = frame.centre + frame.outer();
    const Vec3d out = frame.turn(middle, frame.third);
    shapes.push_back(arrow(WarpKind::squeeze, frame.place(middle) + gap * out, out, length));

    const Vec3d corner = frame.high() + frame.outer();
    const Vec3d sideways = frame.turn(corner, frame.third);
    shapes.push_back(arrow(WarpKind::taper, frame.place(corner) + gap * sideways, sideways, length));

    const BendCircle bend(frame, warps);
    constexpr double kReach = 0.30; // of an arc to both sides of its knob, radians
    shapes.push_back(
        {WarpKind::bend,
         arc(bend.centre, bend.from, bend.towards, bend.radius, bend.angle - kReach, bend.angle + kReach),
         bend.centre + bend.radius * (std::cos(bend.angle) * bend.from + std::sin(bend.angle) * bend.towards), false});

    const TwistRing twist(frame);
    shapes.push_back({WarpKind::twist, arc(twist.centre, twist.from, twist.towards, twist.radius, 0, 2 * kPi),
                      twist.centre + twist.radius * twist.from, false});
    return shapes;
}

std::optional<WarpKind> gizmo_at(std::span<const GizmoShape> shapes, const Camera& camera, double x, double y,
                                 const PictureSize& size, double radius) {
    std::optional<WarpKind> found;
    double best = radius;
    for (const GizmoShape& shape : shapes) {
        const Vec3d at = camera.project(shape.knob, size.width, size.height);
        const double distance = std::hypot(at.x() - x, at.y() - y);
        if (at.z() <= 0 || distance > best) continue;
        best = distance;
        found = shape.part;
    }
    return found;
}

GizmoDrag::GizmoDrag(WarpKind part, const Warps& start, const Box& rest_box, const Camera& camera, double x, double y,
                     const PictureSize& size)
    : part_(part), start_(start), camera_(camera), size_(size), press_x_(x), press_y_(y) {
    const WarpFrame frame(start, rest_box, camera.eye - camera.target);
    const auto follow_line = [&](const Vec3d& rest, const Vec3d& from, const Vec3d& direction) {
        centre_ = frame.place(rest);
        along_ = frame.turn(rest, direction);
        length_ = std::max((centre_ - frame.place(from)).norm(), 1e-6 * frame.diagonal);
    };
    switch (part) {
    case WarpKind::stretch:
        follow_line(frame.high(), frame.centre, frame.axis);
        break;
    case WarpKind::squeeze:
        follow_line(frame.centre + frame.outer(), frame.centre, frame.third);
        break;
    case WarpKind::taper:
        follow_line(frame.high() + frame.outer(), frame.high(), frame.third);
        break;
    case WarpKind::bend: {
        const BendCircle circle(frame, start);
        centre_ = circle.centre;
        along_ = circle.from;
        across_ = circle.towards;
        look_at_circle(circle.angle, circle.radius);
        break;
    }
    case WarpKind::twist: {
        const TwistRing ring(frame);
        centre_ = ring.centre;
        along_ = ring.from;
        across_ = ring.towards;
        look_at_circle(0, ring.radius);
        break;
    }
    case WarpKind::random: // has no handle
        break;
    }
    if (part == WarpKind::bend || part == WarpKind::twist)
        last_angle_ = angle_at(x, y);
    else
        grabbed_ = distance_at(x, y);
}

double GizmoDrag::distance_at(double x, double y) const {
    return point_on_line(camera_, centre_, along_, x, y, size_).value_or(grabbed_);
}

double GizmoDrag::angle_at(double x, double y) const {
    if (is_seen_from_side_)
        return (tangent_.x() * (x - press_x_) + tangent_.y() * (y - press_y_)) / tangent_.squaredNorm();
    const Vec3d normal = along_.cross(across_).normalized();
    const Camera::Ray ray = camera_.ray(x, y, size_.width, size_.height);
    const Vec3d d =
        ray.origin + ray.direction * ((centre_ - ray.origin).dot(normal) / ray.direction.dot(normal)) - centre_;
    return std::atan2(d.dot(across_), d.dot(along_));
}

void GizmoDrag::look_at_circle(double angle, double radius) {
    constexpr double kLeastSlope = 0.35; // sine of the angle between the ray and the circle's plane
    const Vec3d knob = centre_ + radius * (std::cos(angle) * along_ + std::sin(angle) * across_);
    const Vec3d at = camera_.project(knob, size_.width, size_.height);
    const Camera::Ray ray = camera_.ray(at.x(), at.y(), size_.width, size_.height);
    is_seen_from_side_ = std::abs(ray.direction.dot(along_.cross(across_).normalized())) < kLeastSlope;
    const Vec3d forward = radius * (std::cos(angle) * across_ - std::sin(angle) * along_);
    constexpr double kStep = 1e-3;
    tangent_ = (camera_.project(knob + kStep * forward, size_.width, size_.height) - at) / kStep;
    tangent_.z() = 0;
    // A knob that moves towards the viewer: its way on screen is short, and would turn too fast.
    const double least = 0.4 * radius * pixels_a_unit(camera_, knob, size_);
    if (tangent_.norm() < least)
        tangent_ = tangent_.norm() > 0 ? Vec3d(least * tangent_.normalized()) : Vec3d(least * Vec3d::UnitX());
}

Warps GizmoDrag::moved_to(double x, double y) {
    Warps warps = start_;
    const auto factor = [](double value) { return std::clamp(value, Warps::kLeastFactor, Warps::kMostFactor); };
    if (part_ == WarpKind::bend || part_ == WarpKind::twist) {
        const double angle = angle_at(x, y);
        turned_ += std::remainder(angle - last_angle_, 2 * kPi); // step by step, so that it may go round
        last_angle_ = angle;
        const double degrees = turned_ * 180 / kPi;
        if (part_ == WarpKind::bend)
            warps.bend = std::clamp(std::round(start_.bend + 4 * degrees), -Warps::kMostBend, Warps::kMostBend);
        else
            warps.twist = std::clamp(std::round(start_.twist + 2 * degrees), -Warps::kMostTwist, Warps::kMostTwist);
        return warps;
    }
    const double scale = std::max(1 + (distance_at(x, y) - grabbed_) / length_, 0.05);
    const auto rounded = [](double value) { return std::round(100 * value) / 100; };
    if (part_ == WarpKind::stretch) warps.stretch = factor(rounded(start_.stretch * scale));
    if (part_ == WarpKind::squeeze) warps.squeeze = factor(rounded(start_.squeeze / (scale * scale)));
    if (part_ == WarpKind::taper) warps.taper = factor(rounded(start_.taper * scale));
    return warps;
}

} // namespace filigree
