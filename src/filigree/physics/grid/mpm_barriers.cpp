#include "filigree/physics/grid/mpm_barriers.h"

#include "filigree/physics/grid/mpm_contact.h"

#include <algorithm>
#include <cmath>

namespace filigree::mpm {

namespace {

constexpr double kThickCells = 4;     ///< of the grid: thinner than this an obstacle is a wall
constexpr float kApart = 0.02f;       ///< spacings that particles stay off walls
constexpr float kTooNear = 0.01f;     ///< spacings, from which on they are put so far off
constexpr float kFarthestMove = 2.5f; ///< cells, in a step
constexpr float kHeldBefore = 0.25f;  ///< cells
constexpr float kSameWall = 0.95f;    ///< cosine between normals that count as one
constexpr int kBarrierRounds = 3;     ///< where several walls meet

Vec3d to_own(const Eigen::Isometry3d& pose, const Vec3f& point) {
    return pose.linear().transpose() * (point.cast<double>() - pose.translation());
}

bool is_thin(const Obstacle& obstacle, double grid_spacing) {
    if (const auto* ball = std::get_if<Ball>(&obstacle.shape)) return 2 * ball->radius < kThickCells * grid_spacing;
    if (const auto* box = std::get_if<Cuboid>(&obstacle.shape))
        return box->size.minCoeff() < kThickCells * grid_spacing;
    const auto* mesh = std::get_if<MeshObstacle>(&obstacle.shape);
    return mesh && mesh->surface;
}

Vec3d middle_of(const Obstacle& obstacle) {
    if (const auto* ball = std::get_if<Ball>(&obstacle.shape)) return ball->centre;
    const auto* box = std::get_if<Cuboid>(&obstacle.shape);
    return box ? box->centre : Vec3d(Vec3d::Zero());
}

} // namespace

Barriers::Barriers(const World& world, float spacing)
    : world_(world), spacing_(spacing), grid_spacing_(2 * spacing), reach_(1.5f * std::sqrt(3.0f) * grid_spacing_) {
    for (std::size_t o = 0; o < world.obstacles.size(); ++o) {
        const Obstacle& obstacle = world.obstacles[o];
        is_wall_.push_back(is_thin(obstacle, double(grid_spacing_)));
        if (!is_wall_.back()) continue;
        const auto* mesh = std::get_if<MeshObstacle>(&obstacle.shape);
        walls_.push_back({o, ObstacleShape(obstacle), mesh ? mesh->surface.get() : nullptr,
                          mesh ? mesh->offset : Vec3d(Vec3d::Zero()), middle_of(obstacle), obstacle.motion.moves()});
    }
    poses_.resize(walls_.size());
}

void Barriers::begin_step(double from, double until) {
    if (empty()) return;
    after_.emplace(world_, until);
    for (std::size_t w = 0; w < walls_.size(); ++w) {
        const RigidMotion& motion = world_.obstacles[walls_[w].obstacle].motion;
        walls_[w].moves = motion.moves(); // it may have been set
        poses_[w].after = motion.at(until);
        // What jumps is where it is, and sweeps over nothing.
        poses_[w].before = walls_[w].moves && !jumps_between(motion, from, until) ? motion.at(from) : poses_[w].after;
    }
}

void Barriers::go_to(const BlockPlace& place, Near& near) const {
    near.clear();
    const float h = grid_spacing_;
    const Vec3f middle = h * (Vec3f(float(place.x), float(place.y), float(place.z)) * kBlockSide +
                              Vec3f::Constant(0.5f * kBlockSide + 0.5f));
    const double around = double(h) * (0.5 * kBlockSide) * std::sqrt(3.0);
    for (std::size_t w = 0; w < walls_.size(); ++w) {
        const Vec3d own = to_own(poses_[w].before, middle);
        double reach = around + double(reach_) + double(kFarthestMove * h);
        if (walls_[w].moves) {
            const Mat3d turned = poses_[w].after.linear() - poses_[w].before.linear();
            reach += (poses_[w].after * own - middle.cast<double>()).norm() + turned.norm() * reach;
        }
        const ObstacleShape& shape = walls_[w].shape;
        if (shape.clearance(own, reach) < reach || (shape.is_solid() && shape.is_inside(own)))
            near.push_back(std::uint32_t(w));
    }
}

std::uint8_t Barriers::wall_of(Shadow& shadow, const Shadow::Wall& wall) {
    std::uint8_t best = 0;
    float most = -2;
    for (std::uint8_t k = 0; k < shadow.wall_count; ++k) {
        const float cosine = shadow.walls[k].normal.dot(wall.normal);
        if (shadow.walls[k].obstacle == wall.obstacle && cosine > kSameWall) return k;
        if (cosine > most) best = k;
        most = std::max(most, cosine);
    }
    if (shadow.wall_count == shadow.walls.size()) return best;
    shadow.walls[shadow.wall_count] = wall;
    return shadow.wall_count++;
}

Barriers::Side Barriers::side_of(const Wall& wall, const Vec3d& own) const {
    if (!wall.mesh) {
        const DistanceField::Sample sample =
            distance_to(world_.obstacles[wall.obstacle], Eigen::Isometry3d::Identity(), own.cast<float>());
        const Vec3d normal = sample.normal.cast<double>();
        return {own - double(sample.distance) * normal, normal, double(sample.distance)};
    }
    const ClosestWall closest = wall.mesh->closest(own - wall.offset, double(reach_));
    const Vec3d away = own - wall.offset - closest.position;
    if (closest.triangle == kNoIndex) return {own, Vec3d::UnitY(), double(reach_)};
    return {closest.position + wall.offset, away.norm() > 0 ? Vec3d(away.normalized()) : closest.normal, away.norm()};
}

/// Nodes that are hidden, and those so close before a wall that matter between them and it would be a soft gap.
void Barriers::find_held(const Wall& wall, const Pose& pose, const Vec3f& point, Shadow& shadow) const {
    const Vec3d own = to_own(pose.before, point);
    const Side side = side_of(wall, own);
    if (side.distance < 0 || side.distance >= double(reach_)) return; // what is inside comes out
    shadow.clearance = std::min(shadow.clearance, float(side.distance));
    const Mat3d turn = pose.before.linear();
    const Vec3f velocity = after_->velocity(wall.obstacle, point);
    const Vec3d ahead = double(kHeldBefore * grid_spacing_) * side.normal;
    // A node that lies in a sheet is on the same side for both.
    const Vec3d aside = 1e-3 * double(grid_spacing_) * (turn.transpose() * Vec3d(0.61, 0.79, 0.57));
    const Stencil at(point.data(), grid_spacing_);
    for (int n = 0; n < 27; ++n) {
        if (shadow.holds(n)) continue;
        const Vec3f way(at.first_way[0] + float(n % 3) * grid_spacing_,
                        at.first_way[1] + float(n / 3 % 3) * grid_spacing_,
                        at.first_way[2] + float(n / 9) * grid_spacing_);
        const Vec3d node = own + turn.transpose() * way.cast<double>(), beyond = node - ahead;
        Vec3d normal = side.normal;
        double height = 0;
        if (wall.mesh) {
            if ((beyond - own).norm() < side.distance) continue;
            const auto met = wall.mesh->first_crossing(own - wall.offset, beyond - wall.offset);
            if (!met) continue;
            normal = met->normal;
            height = normal.dot(node + aside - wall.offset) - met->plane;
        } else { // a box and a ball lie behind the plane through their closest point; each half has its side
            if (side.normal.dot(beyond - side.position) >= 0 || !wall.shape.is_between(own, beyond)) continue;
            height = normal.dot(node + aside - wall.middle);
        }
        shadow.held |= 1u << n;
        if (height < 0) shadow.hidden |= 1u << n;
        const Vec3f outward = (turn * normal).cast<float>();
        shadow.wall[std::size_t(n)] = wall_of(shadow, {std::uint32_t(wall.obstacle), outward, velocity});
    }
}

std::optional<Shadow> Barriers::shadow(const Vec3f& point, const Near& near) const {
    Shadow shadow;
    shadow.clearance = reach_;
    for (const std::uint32_t w : near) find_held(walls_[w], poses_[w], point, shadow);
    if (shadow.clearance >= reach_) return std::nullopt;
    return shadow;
}

Vec3f Barriers::beside(const Vec3f& velocity, const Shadow::Wall& wall) const {
    return wall.velocity +
           after_contact(velocity - wall.velocity, wall.normal, float(world_.obstacles[wall.obstacle].friction));
}

/// The direction away from a wall that a point stands too near to.
std::optional<Vec3d> Barriers::too_near(const Wall& wall, const Vec3d& own, double least) const {
    if (wall.mesh && wall.shape.clearance(own, least) >= least) return std::nullopt;
    const Side side = side_of(wall, own);
    if (!(side.distance < least)) return std::nullopt;
    return side.normal;
}

void Barriers::stop(const Wall& wall, const Vec3f& at, const Vec3f& normal, Vec3f* velocity) const {
    if (velocity)
        *velocity = beside(*velocity, {std::uint32_t(wall.obstacle), normal, after_->velocity(wall.obstacle, at)});
}

bool Barriers::hold_at(const Wall& wall, const Pose& pose, const Vec3f& from, Vec3f& to, Vec3f* velocity) const {
    Vec3d free = to_own(pose.before, from);
    const Vec3d target = to_own(pose.after, to);
    Vec3d normal;
    if (wall.shape.is_solid() && wall.shape.is_inside(free)) {
        free = wall.shape.exit(target);
        normal = too_near(wall, free, double(spacing_)).value_or(Vec3d::Zero());
    } else {
        const WallTouch touch = wall.shape.follow(free, target);
        normal = touch.normal;
        if (free == target) {
            const auto away = too_near(wall, free, double(kTooNear * spacing_));
            if (!away) return false;
            normal = *away;
        }
    }
    wall.shape.follow(free, free + double(kApart * spacing_) * normal);
    to = (pose.after * free).cast<float>();
    stop(wall, to, (pose.after.linear() * normal).cast<float>(), velocity);
    return true;
}

void Barriers::hold(const Vec3f& from, Vec3f& to, float clearance, const Near& near, Vec3f* velocity) const {
    const float farthest = kFarthestMove * grid_spacing_, moved = (to - from).norm();
    if (moved > farthest) to = from + farthest / moved * (to - from);
    bool held = false;
    for (int round = 0; round < kBarrierRounds; ++round) {
        bool again = false;
        for (const std::uint32_t w : near)
            if (held || walls_[w].moves || std::min(moved, farthest) + kApart * spacing_ >= clearance)
                again |= hold_at(walls_[w], poses_[w], from, to, velocity);
        held |= again;
        if (!again) return;
    }
    // Walls that leave no room, and what rounding makes of a place: it stays beside the wall where it was.
    for (const std::uint32_t w : near) {
        const Vec3d own = to_own(poses_[w].before, from);
        const bool began_inside = walls_[w].shape.is_solid() && walls_[w].shape.is_inside(own);
        if (began_inside || !walls_[w].shape.is_between(own, to_own(poses_[w].after, to))) continue;
        to = (poses_[w].after * own).cast<float>();
        if (velocity) *velocity = after_->velocity(walls_[w].obstacle, to);
    }
}

} // namespace filigree::mpm
