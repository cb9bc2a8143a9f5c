// Sharp edges and points of obstacles in the matter of bodies: what is thinner than the distance between a body's
// surface points would go in between these. Private to the layer.
#pragma once

#include "filigree/physics/contact/matter_contact.h"
#include "filigree/physics/contact/obstacle_motion.h"
#include "filigree/physics/contact/obstacle_trace.h"

namespace filigree {

/// Points along the sharp edges of obstacles, as far apart as a body's spacing, are pushed out of the body's matter;
/// the body takes the force. Of all bodies that have cells: not of those on the grid.
class FeatureContacts {
public:
    explicit FeatureContacts(const World& world) : world_(world) {}

    /// Finds points near the bodies, for as long as `way` stays below `reach`.
    void search(std::span<const BodyState> bodies, std::span<const ObstacleShape> shapes, const MatterContacts& matter,
                const ObstaclePoses& poses, float reach);
    /// way: m that anything may have come nearer to obstacles since the search. touched: as Contacts::add_forces.
    ContactReport add_forces(std::span<BodyState> bodies, std::span<const ObstacleShape> shapes,
                             const MatterContacts& matter, const ObstaclePoses& poses, float dt, float way,
                             std::span<std::uint8_t> touched);
    /// Of what add_forces found too deep.
    void push_out(std::span<BodyState> bodies, const MatterContacts& matter) const;

    /// A point near a body. Saved as it is.
    struct Near {
        Index body, obstacle, edge, part; ///< `part` of so many that the edge has for this body
        Index cell;                       ///< where it was found last
        Vec3f local;
        float clear_until; ///< way until which it cannot touch
    };
    const std::vector<Near>& near() const { return near_; }
    bool is_near(std::size_t body) const {
        return std::ranges::binary_search(near_, Index(body), {}, &Near::body);
    }
    void set_near(std::vector<Near> near) { near_ = std::move(near); }
    bool is_sound(std::span<const Near> near, std::span<const BodyState> bodies, std::span<const ObstacleShape> shapes,
                  const MatterContacts& matter) const;

private:
    struct Deep { ///< to be pushed out
        Index body;
        Matter::Place place;
        Vec3f normal, velocity; ///< outwards; of the obstacle's point
        float depth;
    };
    float stiffness(const BodyState& body, const Matter& matter, const Matter::Place& place) const;

    const World& world_;
    std::vector<Near> near_; ///< ascending
    std::vector<Deep> deep_;
};

} // namespace filigree
