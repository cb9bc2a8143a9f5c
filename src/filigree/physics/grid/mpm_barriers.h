// Walls that nodes of the grid are too coarse for: sheets, thin boxes, the triangles of meshes. A particle does not see
// the nodes behind them. Private to the layer.
// Based on:
// [Hu 2018] compatible particle-in-cell: what lies on both sides of a sheet has velocities of its own
#pragma once

#include "filigree/physics/contact/obstacle_motion.h"
#include "filigree/physics/contact/obstacle_trace.h"
#include "filigree/physics/grid/mpm_grid.h"

#include <optional>

namespace filigree::mpm {

/// What stands between a point and the nodes around it.
struct Shadow {
    struct Wall {
        std::uint32_t obstacle;
        Vec3f normal, velocity; ///< towards the point; m/s
    };
    std::uint32_t hidden = 0;               ///< a bit for each node of the stencil that is behind a wall, x fastest
    std::uint32_t held = 0;                 ///< the same with nodes that are close before it
    std::array<std::uint8_t, 27> wall = {}; ///< of each node that is held
    std::array<Wall, 4> walls = {};
    std::uint8_t wall_count = 0;
    float clearance = 0; ///< m: as far as this there is no wall around the point

    bool hides(int node) const { return hidden >> node & 1; }
    bool holds(int node) const { return held >> node & 1; }
    const Wall& wall_before(int node) const { return walls[wall[std::size_t(node)]]; }
};

/// Obstacles that are walls for the grid, while a step is made.
class Barriers {
public:
    /// spacing: of particles. World: outlives this.
    Barriers(const World& world, float spacing);

    bool empty() const { return walls_.empty(); }
    /// Obstacles that are not are so thick that nodes inside of them hold matter.
    bool has(std::size_t obstacle) const { return is_wall_[obstacle]; }
    /// s, both ends of the step.
    void begin_step(double from, double until);

    using Near = std::vector<std::uint32_t>;
    /// Walls that a particle whose stencil begins in a block may meet in the step.
    void go_to(const BlockPlace& place, Near& near) const;
    /// Nothing: no wall is as near as the stencil's nodes. Where obstacles stand when the step begins.
    std::optional<Shadow> shadow(const Vec3f& point, const Near& near) const;
    /// Takes a point that moves `from` .. `to` back to the side that it came from. velocity: m/s of it, or null; what
    /// goes into the wall is taken from it, and friction with that.
    void hold(const Vec3f& from, Vec3f& to, float clearance, const Near& near, Vec3f* velocity) const;
    /// A velocity that a point reads from a node that a wall holds.
    Vec3f beside(const Vec3f& velocity, const Shadow::Wall& wall) const;
    float reach() const { return reach_; } ///< m: shadows are of walls nearer than this

private:
    struct Wall {
        std::size_t obstacle;
        ObstacleShape shape;
        const ObstacleSurface* mesh; ///< null: a ball or a box
        Vec3d offset;                ///< of the mesh
        Vec3d middle;                ///< of a ball or a box
        bool moves;
    };
    struct Pose { ///< of a wall, over the step
        Eigen::Isometry3d before, after;
    };
    struct Side { ///< in the obstacle's axes: the closest point, and the direction from there to a point
        Vec3d position, normal;
        double distance;
    };
    Side side_of(const Wall& wall, const Vec3d& own) const;
    void find_held(const Wall& wall, const Pose& pose, const Vec3f& point, Shadow& shadow) const;
    static std::uint8_t wall_of(Shadow& shadow, const Shadow::Wall& wall);
    std::optional<Vec3d> too_near(const Wall& wall, const Vec3d& own, double least) const;
    bool hold_at(const Wall& wall, const Pose& pose, const Vec3f& from, Vec3f& to, Vec3f* velocity) const;
    void stop(const Wall& wall, const Vec3f& at, const Vec3f& normal, Vec3f* velocity) const;

    const World& world_;
    std::vector<std::uint8_t> is_wall_;
    std::vector<Wall> walls_;
    std::vector<Pose> poses_;
    std::optional<ObstaclePoses> after_;
    float spacing_, grid_spacing_, reach_;
};

} // namespace filigree::mpm
