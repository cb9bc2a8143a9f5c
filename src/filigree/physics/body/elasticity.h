// What the stepper asks of a material: forces, energy, gradients.
#pragma once

#include "filigree/context.h"
#include "filigree/physics/body.h"

#include <algorithm>
#include <array>
#include <memory>
#include <span>
#include <string>

namespace filigree {

struct Body;
struct PlasticCell;

/// What one look at all elements found, beside forces.
struct ElasticReport {
    /// Bound on the largest eigenvalue of M^-1 K at these positions, 1/s^2: explicit steps up to
    /// 2 / sqrt(squared_frequency) are stable. A maximum over elements, so the same whatever order they are visited in.
    /// Infinite or NaN where positions are not fit for explicit steps.
    float squared_frequency = 0;
    float least_volume_ratio = 1; ///< smallest J; 0 or less: inverted
    float most_stretch = 1;       ///< largest |F| / sqrt(3)
    float damping_rate = 0;       ///< the same bound of internal damping's M^-1 C, 1/s
};

/// Damping inside of a body: forces at positions ahead, f(x + seconds v) = f(x) - seconds K v, which is Kelvin-Voigt's
/// to first order. Steps dt are stable with squared_frequency dt^2 / 4 + damping_rate dt / 2 <= 1.
struct InternalDamping {
    static constexpr float kDampedBelow = 0.3f;

    Vectors velocities; ///< m/s, less the body's rigid motion
    float seconds = 0;
    /// s, of a cell that is flat: from kDampedBelow of its volume on down it grows to this.
    float crushed_seconds = 0;
    /// 1/s^2: what is stiffer than this is damped for less time, so that it does not ask for shorter steps by damping
    /// as well. Infinite: all is damped as long.
    float stiffest = 0;
    ElasticReport before; ///< that the forces before these came with

    float crushed_at(float volume_ratio) const {
        return crushed_seconds * std::clamp(1 - volume_ratio / kDampedBelow, 0.0f, 1.0f);
    }
};

/// A symmetric matrix that the rest shape is stretched by: xx, yy, zz, xy, xz, yz.
using RestStretch = std::array<float, 6>;

/// Elastic behaviour of one body: the body's arrays in the order its loops want, plus what is stored inside (plastic
/// strain). The body must outlive it. Const functions may run at the same time; others use scratch.
class Elasticity {
public:
    virtual ~Elasticity() = default;

    /// Elastic forces, N, into `forces` (overwritten). Same bytes for any thread count and vector width.
    virtual ElasticReport forces(const Vectors& positions, Vectors& forces, const RunContext& context) = 0;

    /// The same, damped. Unless a material knows which of its parts are crushed or stiff, all of it is damped as its
    /// worst part was before.
    virtual ElasticReport damped_forces(const Vectors& positions, const InternalDamping& damping, Vectors& forces,
                                        const RunContext& context);

    /// Elastic energy, J; 0 at rest.
    virtual double energy(const Vectors& positions, const RunContext& context) const = 0;

    /// Deformation gradients at the particles, from the body at rest.
    virtual void gradients(const Vectors& positions, std::span<Mat3f> gradients, const RunContext& context) const = 0;

    /// After each substep: plastic flow. Does nothing for elastic materials.
    virtual void finish_substep(const Vectors& positions, float dt, const RunContext& context);
    /// Cells or particles that have flowed as far as they may (kMostFlowed), and are elastic from there on.
    virtual std::size_t flowed_out() const;

    /// fem that yields: what its cells remember; of other materials empty. A piece takes over that of `cells` of its
    /// whole.
    virtual std::span<const PlasticCell> plastic_cells() const;
    virtual void take_over(std::span<const PlasticCell> of_whole, std::span<const Index> cells);

    /// How strongly crushed matter resists to be crushed further, of 1; materials without such a law do nothing. What
    /// an animation crushes would take ten times as many substeps, and comes back by itself.
    virtual void set_crush_share(float share);

    /// Rest shapes at the particles at the start and at the end of a frame; empty: as the body is. Only materials that
    /// can_grow take them. Between the two the rest shape is what set_part_of_frame says, at first the start's.
    virtual bool can_grow() const;
    virtual void set_rest_stretches(std::span<const RestStretch> from, std::span<const RestStretch> to);
    virtual void set_part_of_frame(float part);

    /// Stored state as bytes, and back; empty for elastic materials. restore_state is false for bytes of another body.
    virtual std::string state() const;
    virtual bool restore_state(std::string_view bytes);
};

/// The elasticity of the body's material model.
std::unique_ptr<Elasticity> make_elasticity(const Body& body, const RunContext& context);

// One a model, in the file of its name.
std::unique_ptr<Elasticity> make_cell_elasticity(const Body& body, const RunContext& context);
std::unique_ptr<Elasticity> make_plastic_elasticity(const Body& body, const RunContext& context);
std::unique_ptr<Elasticity> make_spring_elasticity(const Body& body, const RunContext& context);
std::unique_ptr<Elasticity> make_meshfree_elasticity(const Body& body, const RunContext& context);

} // namespace filigree
