#include "filigree/physics/world.h"

#include "filigree/core/math.h"

#include <algorithm>

namespace filigree {

namespace {

DistanceField::Sample distance_in_own_axes(const HalfSpace& ground, const Vec3d& point) {
    const Vec3d normal = ground.normal.normalized();
    return {float(normal.dot(point - ground.point)), normal.cast<float>()};
}

DistanceField::Sample distance_in_own_axes(const Ball& ball, const Vec3d& point) {
    const Vec3d out = point - ball.centre;
    const double length = out.norm();
    return {float(length - ball.radius), length > 0 ? Vec3f((out / length).cast<float>()) : Vec3f::UnitY()};
}

DistanceField::Sample distance_in_own_axes(const Cuboid& box, const Vec3d& point) {
    const Vec3d from_centre = point - box.centre;
    const Vec3d beyond = from_centre.cwiseAbs() - 0.5 * box.size; // positive: outside of that pair of sides
    const Vec3d side = from_centre.unaryExpr([](double x) { return x < 0 ? -1.0 : 1.0; });
    Eigen::Index axis;
    if (const double inside = beyond.maxCoeff(&axis); inside <= 0)
        return {float(inside), Vec3f(Vec3f::Unit(axis) * float(side[axis]))};
    const Vec3d outside = beyond.cwiseMax(0);
    const double distance = outside.norm();
    return {float(distance), (outside.cwiseProduct(side) / distance).cast<float>()};
}

DistanceField::Sample distance_in_own_axes(const MeshObstacle& mesh, const Vec3d& point) {
    return mesh.field->at((point - mesh.offset).cast<float>());
}

} // namespace

Eigen::Isometry3d RigidMotion::at(double time) const {
    const Vec3d turned = angle.at(time);
    const double radians = turned.norm();
    const Mat3d turn =
        radians > 0 ? math::matrix(Eigen::AngleAxisd(radians, turned / radians)) : Mat3d(Mat3d::Identity());
    Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
    motion.linear() = turn;
    motion.translation() = centre - turn * centre + move.at(time);
    return motion * start;
}

Vec3d pivot_of(const Obstacle& obstacle) {
    if (const auto* ground = std::get_if<HalfSpace>(&obstacle.shape)) return ground->point;
    if (const auto* ball = std::get_if<Ball>(&obstacle.shape)) return ball->centre;
    if (const auto* box = std::get_if<Cuboid>(&obstacle.shape)) return box->centre;
    return std::get<MeshObstacle>(obstacle.shape).offset;
}

DistanceField::Sample distance_to(const Obstacle& obstacle, const Eigen::Isometry3d& motion, const Vec3f& point) {
    const Vec3d own = motion.linear().transpose() * (point.cast<double>() - motion.translation());
    DistanceField::Sample sample =
        std::visit([&](const auto& shape) { return distance_in_own_axes(shape, own); }, obstacle.shape);
    sample.normal = (motion.linear() * sample.normal.cast<double>()).cast<float>();
    return sample;
}

PairContact World::contact_of(std::size_t body, std::size_t other) const {
    for (const BodyPair& pair : body_pairs)
        if ((pair.first == body && pair.second == other) || (pair.first == other && pair.second == body))
            return pair.contact;
    const auto has = [](const std::vector<std::size_t>& group, std::size_t member) {
        return std::ranges::find(group, member) != group.end();
    };
    for (const GroupPair& pair : group_pairs)
        if ((has(pair.first, body) && has(pair.second, other)) || (has(pair.first, other) && has(pair.second, body)))
            return pair.contact;
    return {body_friction, body_restitution};
}

} // namespace filigree
