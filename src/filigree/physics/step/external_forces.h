// What acts on bodies from outside, beside gravity and contacts: forces on regions and on particles, wind, hands.
// Private to the layer.
#pragma once

#include "filigree/physics/body/body_state.h"
#include "filigree/physics/world.h"

#include <algorithm>

namespace filigree {

/// A hand and the particles it holds: those near its point, by mass, so that nothing is plucked out of the surface.
struct Grip {
    Hand hand; ///< of a body's slot
    Embedding region;
    Vec3f offset = Vec3f::Zero();     ///< from the region's middle to the point, when it was seized
    float stiffness = 0, damping = 0; ///< N/m, N s/m
    float squared_frequency = 0;      ///< bound on what it adds to the body's, 1/s^2

    bool pulls(std::size_t body, double time) const {
        return hand.body == body && hand.from <= time && time < hand.until;
    }
    /// Where the region's middle is pulled to.
    Vec3f target(double time) const { return hand.target.at(time).cast<float>() - offset; }
};

/// The particles around hand.point at rest are seized, wherever they are now.
Grip make_grip(const Hand& hand, const BodyState& body, const RunContext& context);

/// N, of wind that comes towards a surface of this area at `inwards` m/s. What weighs `mass` takes up no more than an
/// eighth of that speed in a part of a second: it may have several such surfaces.
inline float wind_push(double air_density, float inwards, float area, float mass, double parts_a_second) {
    return std::min(0.5f * float(air_density) * inwards * inwards * area, mass * inwards * float(parts_a_second) / 8);
}

class ExternalForces {
public:
    /// world: outlives this.
    ExternalForces(const World& world, std::size_t bodies) : world_(world), pushes_(bodies), wind_(bodies) {}
    /// So many bodies.
    void resize(std::size_t bodies) {
        pushes_.resize(bodies);
        wind_.resize(bodies);
    }
    /// What acts on a body ends; but for the world's forces.
    void remove_body(std::size_t body) {
        std::erase_if(grips_, [&](const Grip& grip) { return grip.hand.body == body; });
        pushes_[body] = wind_[body] = {};
    }

    void set_grips(std::vector<Grip> grips) { grips_ = std::move(grips); }
    const std::vector<Grip>& grips() const { return grips_; }
    bool pull(std::size_t body, double time) const; ///< whether a hand does

    /// N, one a particle of the whole body; none: no such forces.
    void set_pushes(std::size_t body, Vectors newtons) { pushes_[body] = std::move(newtons); }
    bool push(std::size_t body) const { return pushes_[body].size() > 0; } ///< whether such forces do

    /// Wind on the surfaces as they are now. Once a frame: what it moves in a frame is bounded.
    void find_wind(std::span<const BodyState> bodies, double time, double frames_per_second, const RunContext& context);

    /// Adds forces on regions and particles and of the wind to the bodies' forces; not of those on the grid.
    void add_forces(std::span<BodyState> bodies, double time, const RunContext& context) const;
    /// Adds forces on regions and particles, and the pull of hands, to the forces of bodies on the grid. The wind meets
    /// these where the grid has their surface.
    void add_forces_on_grid(std::span<BodyState> bodies, double time) const;
    /// Whether a hand, or a force on a region or on particles, acts on a body now.
    bool acts_on(std::size_t body, double time) const;
    /// Adds the pull of hands to a body's forces. Returns the bound on its squared frequency with that of hands added.
    double add_pulls(BodyState& body, std::size_t index, double time, double squared_frequency) const;
    bool has_wind() const { return world_.air_density > 0; }

private:
    /// Calls visit(body, index of the body, particle, acceleration) for all that forces on regions and particles move.
    template <class State, class Visit>
    void each_push(std::span<State> bodies, double time, const Visit& visit) const;

    const World& world_;
    std::vector<Grip> grips_;
    std::vector<Vectors> pushes_; ///< of each body
    std::vector<Vectors> wind_;   ///< N, of each body; empty without wind
};

} // namespace filigree
