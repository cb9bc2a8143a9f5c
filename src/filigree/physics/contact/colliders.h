// The two sides of a contact, each with one interface: points that touch, and what they touch. Private to the layer.
#pragma once

#include "filigree/physics/contact/contact_pair.h"
#include "filigree/physics/contact/obstacle_motion.h"
#include "filigree/physics/contact/obstacle_trace.h"

namespace filigree {

/// The matter of a body as contacts see it; of bodies of one kind all share it.
struct BodyMatter {
    std::shared_ptr<const Matter> matter; ///< null: of a body without a field
    std::vector<float> per_area;          ///< N/m^3 in each cell: what the body's surface has there, per area
};
/// Cost O(cells and surface points).
std::vector<float> stiffness_per_area(const BodyState& state);

/// A particle and its part in how a place in matter moves.
struct Carrier {
    Index particle;
    float weight;
};
/// The particles that move a place in matter, each once.
std::vector<Carrier> carriers_of(const BodyState& body, const Matter& matter, const Matter::Place& place);

/// Points of a body's surface.
class BodyPoints {
public:
    explicit BodyPoints(BodyState& body) : body_(body) {}
    Vec3f position(const Candidate& at) const { return embedded_point(body_.surface, at.point, body_.positions); }
    Vec3f velocity(const Candidate& at) const { return embedded_point(body_.surface, at.point, body_.velocities); }
    void read_ahead(const Candidate& at) const { filigree::read_ahead(body_.surface, at.point); }
    float stiffness(const Candidate& at) const { return body_.surface_stiffness[at.point]; }             ///< N/m
    std::optional<float> area(const Candidate& at) const { return body_.body->surface.areas[at.point]; } ///< m^2
    float squared_frequency() const { return body_.rest_squared_frequency; }
    void push(const Candidate& at, const Vec3f& force) const {
        add_to_particles(body_.surface, at.point, force, body_.forces);
    }
    float yielding(const Candidate& at) const {
        return filigree::yielding(body_.surface, at.point, body_.inverse_mass);
    }
    /// As push_particle, of all that carry the point.
    void move(const Candidate& at, const Vec3f& way, const Vec3f& velocity, float most) const {
        for (Index k = body_.surface.offsets[at.point]; k < body_.surface.offsets[at.point + 1]; ++k)
            push_particle(body_, body_.surface.particles[k], body_.surface.weights[k], way, velocity, most);
    }

private:
    BodyState& body_;
};

/// Points along the sharp edges of an obstacle: what is thinner than the distance between a body's surface points would
/// go in between these. Nothing moves them.
class EdgePoints {
public:
    EdgePoints(const ObstaclePoses& poses, std::size_t obstacle) : poses_(poses), obstacle_(obstacle) {}
    Vec3f position(const Candidate& at) const { return (poses_.at(obstacle_) * at.local_point).cast<float>(); }
    Vec3f velocity(const Candidate& at) const { return poses_.velocity(obstacle_, position(at)); }
    void read_ahead(const Candidate&) const {}
    float stiffness(const Candidate&) const { return std::numeric_limits<float>::max(); }
    std::optional<float> area(const Candidate&) const { return std::nullopt; }
    float squared_frequency() const { return 0; }
    void push(const Candidate&, const Vec3f&) const {}
    float yielding(const Candidate&) const { return 0; }
    void move(const Candidate&, const Vec3f&, const Vec3f&, float) const {}

private:
    const ObstaclePoses& poses_;
    std::size_t obstacle_;
};

/// How a point comes to what it may touch.
struct Approach {
    float margin = 0;           ///< m outside, at which a point of a rigid pair counts as touching
    Vec3f leap = Vec3f::Zero(); ///< m that a point of an edge went in the last substep; of others zero
    float dt = 0;               ///< s, of that substep
};
/// How a point meets what it may touch.
struct Meeting {
    Vec3f normal = Vec3f::Zero(); ///< unit, in the world, out of what it touches; zero: it touches nothing
    float depth = 0;              ///< m; where it touches nothing: below 0, how far it is from that
    /// Of the pair's speed, what the point may gain unasked beside its own; 1: all, as where nothing is known of it.
    float slowest = 1;
};

/// An obstacle at a moment.
class ObstacleCollider {
public:
    ObstacleCollider(const ObstacleShape& shape, const ObstaclePoses& poses, std::size_t obstacle)
        : shape_(shape), poses_(poses), obstacle_(obstacle) {}
    /// Finds how deep a point is; one that is followed goes on to there.
    Meeting meet(Candidate& at, const ContactPair& pair, const Vec3f& point, const Approach& approach) const;
    Vec3f velocity(const Candidate&, const Vec3f& point) const { return poses_.velocity(obstacle_, point); }
    Vec3f from_anchor(const Candidate& at, const Vec3f& point) const {
        return point - poses_.to_world(obstacle_, at.anchor.local);
    }
    void put_anchor(Candidate& at, const Vec3f& point, const Vec3f& offset) const {
        at.anchor.local = poses_.to_own_axes(obstacle_, point - offset);
    }
    float stiffness(const Candidate&, std::optional<float>) const { return std::numeric_limits<float>::max(); }
    float squared_frequency() const { return 0; }
    void push(const Candidate&, const Vec3f&) const {}
    float yielding(const Candidate&) const { return 0; }
    void move(const Candidate&, const Vec3f&, const Vec3f&, float) const {}

private:
    const ObstacleShape& shape_;
    const ObstaclePoses& poses_;
    std::size_t obstacle_;
};

/// The matter of a body: another's than the points', or the same's where that is far from a point at rest, or has
/// folded onto it.
class MatterCollider {
public:
    static constexpr float kOutside = 0.25f; ///< cells that a point may lie outside of the last one and still touch

    MatterCollider(BodyState& body, const BodyMatter& of, bool recovers)
        : body_(body), matter_(*of.matter), per_area_(of.per_area), recovers_(recovers) {}
    /// Finds where a point lies in the matter.
    Meeting meet(Candidate& at, const ContactPair& pair, const Vec3f& point, const Approach& approach) const;
    Vec3f velocity(const Candidate& at, const Vec3f&) const {
        return matter_.mean(at.place, body_.corner_velocities());
    }
    Vec3f from_anchor(const Candidate& at, const Vec3f&) const {
        return matter_.mean(at.place, body_.corner_positions()) - matter_.mean(at.anchor, body_.corner_positions());
    }
    void put_anchor(Candidate& at, const Vec3f& point, const Vec3f& offset) const;
    float stiffness(const Candidate& at, std::optional<float> area) const; ///< N/m of a point with so much area
    float squared_frequency() const { return body_.rest_squared_frequency; }
    void push(const Candidate& at, const Vec3f& force) const { matter_.add(at.place, force, body_.corner_forces()); }
    float yielding(const Candidate& at) const;
    void move(const Candidate& at, const Vec3f& way, const Vec3f& velocity, float most) const;

private:
    Meeting meet_rigid(Candidate& at, const ContactPair& pair, const Vec3f& point, const Approach& approach) const;
    std::optional<Matter::Depth> find_other(Candidate& at, const Vec3f& point, const Approach& approach) const;
    std::optional<Matter::Depth> find_own(Candidate& at, const Vec3f& point, bool is_beside) const;
    std::optional<Matter::Depth> find_fold(const Candidate& at, const Vec3f& point, Matter::Place& place) const;
    bool locate_roughly(const Vec3f& point, Matter::Place& place, Mat3f& inverse) const;
    bool is_elsewhere(const Candidate& at, const Matter::Place& place) const {
        return matter_.is_elsewhere(at.point, place,
                                    at.entry_normal.isZero(0) ? Matter::kElsewhere : Matter::kStillElsewhere);
    }

    BodyState& body_;
    const Matter& matter_;
    const std::vector<float>& per_area_;
    const bool recovers_; ///< of a body beside itself: what it is in, it is out of first
};

} // namespace filigree
