// What the stepper asks of a material: forces, the 3x3 blocks of a descent sweep, gradients.
#pragma once

#include "filigree/core/run_context.h"
#include "filigree/physics/vectors.h"

#include <memory>
#include <span>
#include <string>

namespace filigree {

struct Body;
struct PlasticCell;

/// A symmetric 3x3 matrix.
struct Symmetric3 {
    float xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;
    void add_scaled_identity(float s) {
        xx += s;
        yy += s;
        zz += s;
    }
    /// += s v v^T
    void add_outer(const Vec3f& v, float s) {
        xx += s * v.x() * v.x();
        yy += s * v.y() * v.y();
        zz += s * v.z() * v.z();
        xy += s * v.x() * v.y();
        xz += s * v.x() * v.z();
        yz += s * v.y() * v.z();
    }
    /// The solution of (this + 1e-6 trace I) d = b by LDL^T; zero where that cannot be computed (not finite). For
    /// positive semidefinite matrices. Inline in vertex_block.h.
    Vec3f solve(const Vec3f& b) const;
};

/// Force and block (minus its derivative, made positive semidefinite) of everything that acts on single particles from
/// outside: contacts, hands. Asked from many threads.
class BlockTerms {
public:
    virtual ~BlockTerms() = default;
    virtual void add(Index particle, const Vectors& positions, Vec3f& force, Symmetric3& block) const = 0;
};

/// One time step's minimisation, E(x) = sum m / (2 dt^2) |x - target|^2 + elastic energy + external.
struct Descent {
    const Vectors& target;                 ///< inertial positions x + dt v + dt^2 g
    std::span<const float> inertia;        ///< m / dt^2 of each particle
    std::span<const std::uint8_t> fixed;   ///< 1: not to be moved
    std::span<const std::uint8_t> touched; ///< 1: external terms are to be asked
    const BlockTerms* external = nullptr;
};

/// What one look at all elements found, beside forces.
struct ElasticReport {
    /// Bound on the largest eigenvalue of M^-1 K at these positions, 1/s^2: explicit steps up to
    /// 2 / sqrt(squared_frequency) are stable. A maximum over elements, so the same whatever order they are visited in.
    /// Infinite or NaN where positions are not fit for explicit steps.
    float squared_frequency = 0;
    float least_volume_ratio = 1; ///< smallest J; 0 or less: inverted
    float most_stretch = 1;       ///< largest |F| / sqrt(3)
};

/// Elastic behaviour of one body: the body's arrays in the order its loops want, plus what is stored inside (plastic
/// strain). The body must outlive it. Const functions may run at the same time; others use scratch.
class Elasticity {
public:
    virtual ~Elasticity() = default;

    /// Elastic forces, N, into `forces` (overwritten). Same bytes for any thread count and vector width.
    virtual ElasticReport forces(const Vectors& positions, Vectors& forces, const RunContext& context) = 0;

    /// One sweep of vertex block descent [Chen 2024] over all particles, colour by colour:
    /// x += (inertia I + H)^-1 (inertia (target - x) + f), f and H of the elastic energy at the current positions.
    virtual void sweep(Vectors& positions, const Descent& descent, const RunContext& context) = 0;

    /// Adds the elastic force on one particle and its block, as a sweep has them; prepare_blocks comes first, once. For
    /// fem alone; others add nothing.
    virtual void prepare_blocks();
    virtual void add_block(Index particle, const Vectors& positions, Vec3f& force, Symmetric3& block) const;

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
