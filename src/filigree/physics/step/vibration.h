// A body's motion beside its rigid part, and how it is damped. Private to the layer.
#pragma once

#include "filigree/physics/rigid/rigid_state.h"

namespace filigree {

/// A body's rigid motion, at any place.
struct MotionOf {
    Vec3d centre, velocity, spin; ///< m, m/s, rad/s

    explicit MotionOf(const RigidState& state)
        : centre(state.centre), velocity(state.linear / state.mass), spin(state.angular_velocity_of(state.angular)) {}
    Vec3d at(const Vec3d& place) const { return velocity + spin.cross(place - centre); }
};

/// J: kinetic energy of all that a body moves beside its rigid motion.
double vibration_energy(const BodyState& body);
/// Velocities beside the rigid motion, times `factor`. Momentum and angular momentum stay.
void scale_vibration(BodyState& body, double factor);
/// 1/s, about that of a body's slowest vibration: a shear wave goes there and back along its longest side.
double lowest_frequency(const Body& body);
/// The same along its shortest side.
double thickness_frequency(const Body& body);

/// After `seconds` of a frame. A body that rubs along something trembles by itself: friction grows with the load, and
/// feeds vibrations in which both swing in time. Then the body slides where it should stick, and too fast. What has
/// rubbed for two of its own vibrations is damped, as rubber is by itself; a hit is over before.
/// Whether it is; short waves are left to internal damping.
bool calm_rubbing(BodyState& body, bool touches, bool rubs, double seconds);

/// Energy that a body has got from nowhere: where cells are crushed, elastic forces change faster than steps follow,
/// and what is pushed out of matter is pressed together. It is taken from the body's vibration again.
class EnergyDebt {
public:
    /// At a substep's start. forces: elastic ones alone, N, at the positions now.
    void begin(const BodyState& body, const Vectors& forces, const RunContext& context);
    bool has_begun() const { return energy_.has_value(); }
    /// After the drift, with elastic forces there: their work so far is known.
    void moved(const BodyState& body, const Vectors& forces);
    /// At the substep's end, after particles were pushed out.
    void end(BodyState& body, const RunContext& context);
    /// Around a push, where no substep was begun.
    void before_push(const BodyState& body, const RunContext& context);

private:
    void pay(BodyState& body);

    std::optional<double> energy_; ///< J, elastic, at the substep's start
    Vectors positions_, forces_;   ///< there
    double work_ = 0;              ///< J, that elastic forces did in the substep
    double owed_ = 0;              ///< J; below 0: lost to damping
};

} // namespace filigree
