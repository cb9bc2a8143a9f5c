// Bodies of the material point method: matter that flows, parts and joins. Private to the layer.
// Based on:
// [Hu 2018] as mpm_particle.h
// [Jiang 2015] The affine particle-in-cell method
// [Bardenhagen 2000] The material-point method for granular materials: contact of fields
#pragma once

#include "filigree/physics/contact/obstacle_motion.h"
#include "filigree/physics/contact/pair_laws.h"
#include "filigree/physics/grid/mpm_barriers.h"
#include "filigree/physics/grid/mpm_grid.h"
#include "filigree/physics/grid/mpm_kernel.h"
#include "filigree/physics/simulation.h"

#include <string>
#include <string_view>

namespace filigree::mpm {

/// All bodies of one simulation that are of the model mpm; they share a grid of twice their coarsest spacing.
class Bodies {
public:
    /// actors: numbered from `first` on, with none before them. spacing: m, of the coarsest particles that may come.
    Bodies(const World& world, std::span<const Actor> actors, std::size_t first = 0, float spacing = 0);
    /// The next actor, of any model; of mpm no coarser than `spacing`. Cost O(its particles).
    void add(const Actor& actor);
    /// Cost O(particles).
    void remove(std::size_t actor);
    float spacing() const { return spacing_; } ///< m, of the coarsest particles

    bool empty() const { return particles_.empty(); }
    bool has(std::size_t actor) const { return field_of_[actor] != kNoIndex; }
    std::size_t particle_count(std::size_t actor) const;

    /// s: the longest step that is stable, and in which nothing goes far, from this time on.
    float longest_step(double now, const RunContext& context) const;
    void step(double from, double until, const RunContext& context); ///< s
    float least_volume_ratio(std::size_t actor) const;               ///< smallest J of its particles

    /// Where the particles of a body are, and how fast.
    void read(std::size_t actor, Vectors& positions, Vectors& velocities) const;
    /// Instead; with their matter as it was.
    void set_positions(std::size_t actor, const Vectors& positions);
    void set_velocities(std::size_t actor, const Vectors& velocities);
    void set_velocity_gradient(std::size_t actor, const Mat3f& gradient); ///< 1/s, of all its particles
    /// Adds forces, N, one a particle, for so long, s.
    void kick(std::size_t actor, const Vectors& forces, float dt);
    /// Particles that go as they are told and not as the grid has it: those whose byte is not 0. Once.
    void set_fixed(std::size_t actor, std::span<const std::uint8_t> fixed);
    void move_fixed(std::size_t actor, const Vectors& positions, const Vectors& velocities); ///< these alone
    /// 1/s^2, of the body's stiffness on the grid: ElasticReport::squared_frequency at rest, as it were.
    float rest_squared_frequency(std::size_t actor) const;
    /// Takes lost particles from these, and makes whatever else a particle of the body carries finite. is_lost: of
    /// each. Returns how many particles were changed.
    std::size_t repair(std::size_t actor, const Vectors& positions, const Vectors& velocities,
                       std::span<const std::uint8_t> is_lost);
    MatterParticles matter(std::size_t actor) const;
    double elastic_energy() const; ///< J
    // Of what particles carry beside their velocities: J, and kg m^2/s.
    double affine_energy() const;
    Vec3d affine_momentum() const;
    double heat() const; ///< J, from 0 K

    /// Points that go along from where they are now, with gradients from rest to there. Returns the first's number.
    std::size_t add_tracers(std::size_t actor, std::span<const Vec3f> points, std::span<const Mat3f> gradients);
    void remove_tracers(std::size_t first, std::size_t count);
    void read_tracers(std::size_t first, std::span<Vec3f> points, std::span<Mat3f> gradients) const;
    void read_renewal(std::size_t first, std::span<float> renewal) const;

    std::string state() const;
    bool restore_state(std::string_view bytes); ///< false, and nothing changed, for bytes of other bodies

private:
    struct Tracer {
        Vec3f x;
        Mat3f gradient;
        float renewal;
        std::uint32_t field;
    };

    Vec3f emptiness(const AtParticle& found, std::size_t field) const;
    Particle at_rest(float mass, float volume, std::size_t field) const; ///< at the origin
    void find_surfaces(std::span<const Actor> actors, std::size_t first);
    float longest_step_beside_obstacles(double now) const; ///< s
    void find_shadows(const RunContext& context);
    void scatter(float dt, const RunContext& context);
    void update_nodes(float dt, double time, const RunContext& context);
    void hold_nodes();
    void gather(float dt, double time, const RunContext& context);
    bool is_held(std::uint32_t number) const {
        return shadow_of_[number] != kNoIndex && shadows_[shadow_of_[number]].held;
    }
    AtParticle gather_beside(std::uint32_t number, const Node* tile, const Node* behind) const;
    void move(std::uint32_t number, const Vec3f& way, const Barriers::Near& walls);
    void move_tracers(float dt, const RunContext& context);
    void move_tracer(Tracer& tracer, float dt, const Barriers::Near& walls) const;
    void blow(Particle& particle, const Vec3f& emptiness, float surface, const Vec3f& wind, float dt) const;

    const World& world_;
    const PairLaws laws_;
    std::vector<Index> field_of_;             ///< of each actor; kNoIndex: not of this model
    std::vector<Matter> matter_;              ///< of each field
    std::vector<std::size_t> actor_of_field_; ///< the way back
    std::vector<std::size_t> first_;          ///< particle of each field, and their number
    std::vector<Particle> particles_;
    std::vector<std::uint32_t> field_;  ///< of each particle
    std::vector<float> start_enthalpy_; ///< J/kg, by field
    std::vector<float> grid_mass_;      ///< kg, of a full node, by field
    std::vector<float> surface_;        ///< by field: area of the body at rest, in parts of what its particles tell
    std::vector<Tracer> tracers_;
    std::vector<std::uint32_t> fixed_; ///< particles
    const float spacing_;              ///< of particles, m
    Grid grid_;
    Barriers barriers_;
    std::vector<Shadow> shadows_;
    /// By particle: what walls hide from it, and the number of its shadow. Empty: there are no walls.
    std::vector<std::uint32_t> hidden_, shadow_of_;
    float approach_ = 0; ///< m/s, of bodies at nodes in the last step
    bool has_heat_ = false;
    std::vector<Float4> pinned_; ///< momentum and mass that are pinned, of each node
};

} // namespace filigree::mpm
