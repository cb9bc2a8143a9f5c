// On which side of an obstacle a body begins. Private to the layer.
#pragma once

#include "filigree/physics/body/body_state.h"
#include "filigree/physics/contact/obstacle_trace.h"
#include "filigree/physics/simulation.h"

namespace filigree {

/// Of a body that an obstacle's surface passes through, the particles that stand on the right side: those that hang
/// together without going through the surface, and are most of the body. Of closed meshes whose faces look outwards,
/// and of what is solid, outside is right as soon as a tenth of the body lies there.
class StartSides {
public:
    /// motion: of the obstacle, now. Cost O(1) for a body that is far, else O(particles log F).
    StartSides(const BodyState& body, const ObstacleShape& shape, const Eigen::Isometry3d& motion);

    bool all_right() const { return right_.empty() && !is_inside_; } ///< the surface does not pass through the body
    /// Whether all of the body starts inside of something closed.
    bool is_inside() const { return is_inside_; }
    /// In the obstacle's axes, the place on the right side from which a surface point gets to where it is.
    Vec3d start_of(std::size_t point) const;

private:
    void find_groups(std::span<const double> clearances);

    const BodyState& body_;
    const ObstacleShape& shape_;
    std::vector<Vec3d> places_;       ///< of the particles, in the obstacle's axes; empty: not needed
    std::vector<std::uint8_t> right_; ///< of each particle; empty: all are
    bool is_inside_ = false;
    Eigen::Isometry3d to_own_;
};

/// Cost O(bodies * obstacles), and O(points log F) for those near each other.
/// shapes: of the obstacles. time: s, of the world. Bodies count from 0 in what is found.
std::vector<StartOverlap> find_start_overlaps(const World& world, std::span<const ObstacleShape> shapes,
                                              std::span<const BodyState> bodies, double time = 0);

} // namespace filigree
