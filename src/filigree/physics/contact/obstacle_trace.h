// How a point is followed beside an obstacle, so that it is known from which side it came. Private to the layer.
#pragma once

#include "filigree/physics/contact/obstacle_surface.h"

namespace filigree {

/// An obstacle as something that points are followed beside. Coordinates are the obstacle's own, before its motion.
class ObstacleShape {
public:
    /// obstacle: outlives this.
    explicit ObstacleShape(const Obstacle& obstacle);

    /// False of half-spaces, which are below a plane however deep a point is, and of meshes that have a field alone.
    bool is_traced() const { return surface_ || ball_; }
    /// As ObstacleSurface::follow, and clearance.
    WallTouch follow(Vec3d& place, const Vec3d& target) const;
    double clearance(const Vec3d& point, double reach) const;
    /// The wall that is the closest to a point, no further than `reach`: m, and unit from it to the point; or none.
    std::optional<std::pair<double, Vec3d>> closest(const Vec3d& point, double reach) const;
    /// Whether a way meets the obstacle.
    bool is_between(const Vec3d& from, const Vec3d& to) const;
    /// Whether a point lies inside of what is solid: a ball, a cuboid, or a closed mesh.
    bool is_inside(const Vec3d& point) const;
    /// Whether what starts inside has to come out: of a ball or a cuboid. A mesh is a room for what lies in it.
    bool is_solid() const { return !is_mesh_; }
    bool is_closed() const { return ball_ || surface_->is_closed(); }
    bool looked_inwards() const { return surface_ && surface_->looked_inwards(); }
    using Edge = ObstacleSurface::Edge;
    std::span<const Edge> sharp_edges() const { return sharp_edges_; }
    /// m: the obstacle at `motion` is no nearer to a box of the world than this; below 0 where it is in a half-space.
    double gap(const Box& box, const Eigen::Isometry3d& motion) const;
    /// The closest place that stands free, outside.
    Vec3d exit(const Vec3d& point) const;

private:
    std::shared_ptr<const ObstacleSurface> surface_;
    const Ball* ball_ = nullptr;
    Vec3d offset_ = Vec3d::Zero();
    std::vector<Edge> sharp_edges_;
    const HalfSpace* ground_ = nullptr;
    Box box_; ///< empty: it has no end, or that is not known
    bool is_mesh_ = false;
};

} // namespace filigree
