// The simulation: bodies in a world, frame after frame.
//
//     World world;                                         // gravity alone
//     world.obstacles.push_back({.shape = HalfSpace{}});   // and the ground
//     Simulation simulation = Simulation::create(world, {{.body = body}}).value();
//     const std::size_t driver = simulation.attach(0, points);
//     for (int frame = 0; frame < 60; ++frame) {
//         simulation.advance().value();
//         simulation.attached(driver, positions, gradients);
//     }
//
// Attach the driver of a model: restore.h then gives the detailed mesh from positions and gradients. `body` is a
// shared_ptr to a Body (physics/body.h). The world may change between frames: bodies come and go, obstacles are moved.
#pragma once

#include "filigree/physics/body.h"
#include "filigree/physics/world.h"
#include "filigree/types.h"

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

namespace filigree {

// ---------------------------------------------------------------------------------------------------------------------
// Contact events

/// Whether two things touched in the frame before as well: no, yes, or in that frame alone.
enum class ContactKind { began, stays, ended };

/// Two bodies, or a body and an obstacle, that touched in the last frame or stopped touching in it.
struct ContactEvent {
    ContactKind kind = ContactKind::began;
    std::size_t body = 0;
    std::optional<std::size_t> other;    ///< the other body, with a higher number; or
    std::optional<std::size_t> obstacle; ///< the obstacle
    Vec3d place = Vec3d::Zero();  ///< world, m: mean of the contact points, weighted by impulse; of `ended`: the last
    Vec3d normal = Vec3d::Zero(); ///< unit, towards `body`
    double impulse = 0;           ///< N s along the normal, summed over the frame
    double speed = 0;             ///< m/s: the largest approach speed of a contact point along the normal
};

// ---------------------------------------------------------------------------------------------------------------------
// Rays

struct RayOptions {
    double reach = std::numeric_limits<double>::infinity(); ///< m: length of the ray
    std::optional<std::size_t> ignore = std::nullopt;       ///< a body that the ray passes through
};

/// Where a ray first hits a body or an obstacle.
struct WorldHit {
    double distance = 0;                 ///< m, from the ray's origin
    Vec3d place = Vec3d::Zero();         ///< world, m
    Vec3d normal = Vec3d::Zero();        ///< unit, outward; of a wall with two sides: towards the origin of the ray
    std::optional<std::size_t> body;     ///< the body that was hit, or
    std::optional<std::size_t> obstacle; ///< the obstacle
    Vec3f rest = Vec3f::Zero();          ///< m: the same point on the body at rest; Hand::point takes it
};

// ---------------------------------------------------------------------------------------------------------------------
// Particles of bodies that flow

/// The particles of a body of mpm in the world: one entry a particle, always in the same order.
struct MatterParticles {
    std::vector<Vec3f> positions;    ///< m
    std::vector<float> volumes;      ///< m^3, compressed; never above the volume at rest
    std::vector<float> temperatures; ///< K
    std::vector<float> liquid;       ///< 0 solid .. 1 fluid
    std::vector<float> renewal;      ///< 0: as at the start .. 1: molten or kneaded through
    float spacing = 0;               ///< m, between particles at rest
};

// ---------------------------------------------------------------------------------------------------------------------
// Targets of an animation

/// How the particles of a body follow targets (Simulation::set_follow). Each particle is pulled to its target by a
/// damped spring. No spring shortens the substep: one that is too stiff for it is as stiff as the substep allows.
struct Follow {
    /// Hz, one a particle: of the spring between a particle and its target. 0: no spring. Infinite: the particle is
    /// held on its target.
    std::vector<float> frequency;
    /// 1/s, 0 or more, one a particle or one for all: rate at which a particle loses its speed beside the target's.
    std::vector<float> damping = {3};
    /// m, above 0, one a particle or one for all: further away from its target a particle is pulled harder, with
    /// leash_frequency from twice this distance on. Infinite: no leash. Empty: two spacings.
    std::vector<float> leash = {};
    double leash_frequency = 20; ///< Hz, 0 or more
    /// m/s^2, above 0: particles feel no more of their target's acceleration. The rest moves them with their target.
    double most_acceleration = 100;
    /// Limbs that pass through each other: the group of each particle; and pairs of groups between which there is no
    /// contact within the body. Empty: everything touches.
    std::vector<std::uint16_t> groups = {};
    std::vector<std::array<std::uint16_t, 2>> passing = {};
    /// m, 0 or more: how near parts of the body come before they push each other. What presses sinks in, and with this
    /// comes to lie beside what it presses. Unset: 0.08 spacings.
    std::optional<double> contact_gap = {};
};

/// Velocities of targets, m/s, from their places in three frames of one size: the mean of the ways before and after,
/// each weighted by the other's square [van Albada 1982], so that the cubic curve through the places does not overshoot
/// beside a jump. frames_per_second: above 0. Cost O(particles).
Vectors target_velocities(const Vectors& before, const Vectors& now, const Vectors& after, double frames_per_second);

// ---------------------------------------------------------------------------------------------------------------------
// The simulation

/// A body and how it starts.
struct Actor {
    std::shared_ptr<const Body> body;
    Eigen::Isometry3d placement = Eigen::Isometry3d::Identity(); ///< from the body's rest positions to the world
    Vec3d velocity = Vec3d::Zero();                              ///< m/s
    Vec3d spin = Vec3d::Zero();                                  ///< rad/s about the centre of mass
    std::shared_ptr<const Fracture> fracture = nullptr;          ///< how it breaks; null: it does not
    /// Whether a rigid body may sleep: it then stops while it rests on something, and costs nothing until it is
    /// touched.
    bool may_sleep = true;
};

/// automatic: a body that would need too many substeps becomes rigid (StepOptions::automatic_rigid). explicit_steps:
/// bodies of kFewestElasticCells cells and more stay elastic, whatever that costs.
enum class StepMode { automatic, explicit_steps };

struct StepOptions {
    double frames_per_second = 60;
    StepMode mode = StepMode::automatic;
    bool contacts_between_bodies = true, contacts_within_bodies = true;
    /// Whether bodies of fem and springs become rigid where they have fewer than kFewestElasticCells cells, or need
    /// more than most_substeps substeps a frame at rest. Bodies that are pinned, yield or break stay elastic.
    bool automatic_rigid = true;
    unsigned most_substeps = 500; ///< a frame
};
inline constexpr std::size_t kFewestElasticCells = 8;

/// Most substeps a frame. A body that needs more takes longer ones than are stable, and the FrameReport says so.
inline constexpr unsigned kMostSubsteps = 20000;

/// What happened in a frame.
struct FrameReport {
    unsigned substeps = 0;          ///< of velocity Verlet: as many as stability needs, up to kMostSubsteps
    unsigned unstable_substeps = 0; ///< of these, longer than is stable; do not trust the motion then
    std::size_t unstable_body = 0;  ///< the body that needed the shortest substep
    std::size_t contacts = 0;       ///< surface points in contact at the end of the frame
    double deepest_contact = 0;     ///< m: deepest point below the surface of an obstacle
    double deepest_in_matter = 0;   ///< m: deepest surface point inside another body or its own
    float least_volume_ratio = 1;   ///< smallest J (volume by volume at rest) of all cells; 0 or less: inverted
    std::size_t most_crushed = 0;   ///< the body that has this cell; cells below J = 0.3 are damped
    float most_stretch = 1;         ///< largest singular value of all deformation gradients
    /// Cells and particles of plastic fem and meshfree that flowed to seven times their length. They are elastic from
    /// there on; matter that flows further needs the model mpm.
    std::size_t flowed_out = 0;
    std::size_t most_flowed = 0; ///< the body with most of them
    double elastic_seconds = 0, contact_seconds = 0, other_seconds = 0;
    std::size_t clamped_particles = 0; ///< particles whose motion was not finite, or whose start was scaled down
    std::size_t clamped_body = 0;      ///< the body of the first of them
    Vec3f clamped_at = Vec3f::Zero();  ///< world, m: where the first of them is
};

/// The inverted cells of a body.
struct InvertedCells {
    std::size_t count = 0;
    float least = 1;             ///< smallest J of the cells of the body
    Vec3f place = Vec3f::Zero(); ///< world, m: middle of the cell with the smallest J
};

struct Energy {
    double kinetic = 0, elastic = 0, potential = 0; ///< J; potential: of gravity, relative to the world's origin
    double total() const { return kinetic + elastic + potential; }
};
struct Momentum {
    Vec3d linear = Vec3d::Zero();  ///< kg m/s
    Vec3d angular = Vec3d::Zero(); ///< kg m^2/s, about the world's origin
};

/// Checks a world and its bodies: bodies have particles, everything named exists, numbers are finite and in range, keys
/// ascend. Errors: usage; the sentence names the first wrong field ("world.obstacles[2].friction must be 0 or more.").
/// Cost O(keys and particles named).
Status check_world(const World& world, std::span<const Actor> actors);
/// Checks a body before it is added. Errors: usage ("actor.body is missing.").
Status check_actor(const Actor& actor);
/// Checks how an obstacle is set. Errors: usage.
Status check_obstacle_motion(const Eigen::Isometry3d& pose, const Vec3d& velocity, const Vec3d& spin);
/// Check what may be set between frames. body_count: the number of bodies. Errors: usage.
Status check_hands(std::span<const Hand> hands, std::size_t body_count);
Status check_air(const Keyed<double>& temperature, double heat_transfer);
Status check_heat_sources(std::span<const HeatSource> sources);

/// A body that starts inside an obstacle, or across its surface.
struct StartOverlap {
    std::size_t body = 0, obstacle = 0;
    double depth = 0;       ///< m: deepest surface point
    bool is_inside = false; ///< the whole body is inside a closed mesh, and stays there
    /// "body 'a' starts inside obstacle 'b', ...", without a full stop.
    std::string sentence(const std::string& body_name, const std::string& obstacle_name) const;
};

struct SimulationState;

/// Bodies in a world, moved frame by frame. Results are the same to the byte for any number of threads, and for a run
/// that was saved and restored on the way. Const functions may be called from several threads at a time.
///
/// `body`, `obstacle` and `attachment` are numbers. Functions that return a Status or a Result check them; others
/// expect numbers that exist. For a body that was removed they return nothing: no particles, zeros.
class Simulation {
public:
    /// Errors: usage (what check_world refuses; an option out of range).
    static Result<Simulation> create(World world, std::vector<Actor> actors, const StepOptions& options = {},
                                     const RunContext& context = RunContext());
    Simulation(Simulation&&) noexcept;
    Simulation& operator=(Simulation&&) noexcept;
    ~Simulation();

    /// Moves everything by one frame. Errors: cancelled; the state is then that of the start of the frame. The same
    /// holds when memory runs out (std::bad_alloc).
    Result<FrameReport> advance(const RunContext& context = RunContext());

    std::size_t frame() const; ///< frames done
    double time() const;       ///< s
    const World& world() const;
    std::size_t body_count() const; ///< of all bodies that ever were: numbers are not used again
    bool has_body(std::size_t body) const;
    /// Errors: usage (no such body, or it was removed).
    Status check_body(std::size_t body) const;
    const Body& body(std::size_t body) const; ///< rigid where automatic_rigid made it rigid
    /// Why automatic_rigid made a body rigid ("it has only 5 cells"); "" where it did not.
    const std::string& why_rigid(std::size_t body) const;
    /// Bodies that started deeper in an obstacle than 3/4 of their spacing: tell the user before the run.
    const std::vector<StartOverlap>& start_overlaps() const;
    const Vectors& positions(std::size_t body) const;  ///< world, m; of a broken body: the heaviest copy of each corner
    const Vectors& velocities(std::size_t body) const; ///< m/s
    /// Moves particles by hand, to start a body in another shape. Any values may be given: a particle without a finite
    /// position returns to its place beside the others in the next frame. Errors: usage (no such body, another number
    /// of particles).
    Status set_positions(std::size_t body, const Vectors& positions);
    Status set_velocities(std::size_t body, const Vectors& velocities);
    /// Replaces all hands. Each hand takes hold of the particles around its point on the body at rest. Errors: usage
    /// (what check_hands refuses); the old hands then stay.
    Status set_hands(std::vector<Hand> hands, const RunContext& context = RunContext());
    /// Sets a force on every particle of a body, N, from now on. Empty: no forces. A body with forces does not sleep.
    /// In a broken body the copies of a particle share its force by mass. save() does not keep forces and hands.
    /// Errors: usage (no such body, another number of particles, a force that is not finite).
    Status set_forces(std::size_t body, const Vectors& newtons);

    /// Lets a body follow targets, from now on. positions (m, world) and velocities (m/s): where the targets are now
    /// and how they move. Particles stay where they are; set_positions puts them on the targets. A Follow without
    /// frequency lets the body go. While a body of fem follows, its cells that are crushed below 0.4 of their volume
    /// resist with 2 % of what they would: the targets hold them. The state of the targets is part of save(), the
    /// Follow is not: before restore() call this again as it was called before save(). stretches: as those of
    /// set_targets, now. Errors: usage (no such body; a body that is rigid, breaks or is of mpm; lists of another
    /// length; a number out of range; stretches that set_targets refuses).
    Status set_follow(std::size_t body, Follow follow, const Vectors& positions, const Vectors& velocities,
                      std::span<const Mat3f> stretches = {});
    /// Says where the targets of a body are at the end of the next frame. Within the frame they move along a cubic
    /// curve. Without this call they stop where they are. A way that is too long for the velocities (a teleport, a turn
    /// within a frame) is not travelled: the particles are put where their targets jump to, as far as they jump.
    /// positions: m. velocities: m/s, as target_velocities makes them. accelerations: m/s^2, what particles feel during
    /// the frame in addition to gravity; or empty. stretches: the rest shape of the matter at each particle at the end
    /// of the frame, a symmetric matrix relative to the body at rest (1.5 times the identity: half as large again), to
    /// which it grows evenly; the mass stays. Empty: as at rest. Cost O(particles). Errors: usage (no such body; it
    /// does not follow; another number of particles; a number that is not finite; stretches of a body that yields or is
    /// not of fem; a stretch that is not symmetric, or shrinks or grows anything by more than eight times).
    Status set_targets(std::size_t body, const Vectors& positions, const Vectors& velocities,
                       const Vectors& accelerations = {}, std::span<const Mat3f> stretches = {});

    /// Replaces the gravity of the world, m/s^2, from now on; what sleeps wakes where it changes. save() does not keep
    /// it. Errors: usage (a number that is not finite).
    Status set_gravity(const Vec3d& gravity);
    /// Replace the air and the heat sources of the world, which bodies of mpm feel. Errors: usage (what check_air and
    /// check_heat_sources refuse); the old values then stay.
    Status set_air(const Keyed<double>& temperature, double heat_transfer);
    Status set_heat_sources(std::vector<HeatSource> sources);

    // A world that changes between frames, also while bodies break.

    /// Adds a body and returns its number. World::body_friction and body_restitution say how it touches others. Cost:
    /// the set-up of that body, and O(bodies). Errors: usage (what check_actor refuses; a body of mpm that is coarser
    /// than the grid that other bodies of mpm share), cancelled; nothing has changed then. When memory runs out,
    /// destroy the simulation.
    Result<std::size_t> add_body(const Actor& actor, const RunContext& context = RunContext());
    /// Removes a body with its pieces, pins, forces, hands and attachments. Bodies that lay on it wake. Its number is
    /// not used again. Errors: usage (no such body).
    Status remove_body(std::size_t body);

    /// Puts an obstacle at `pose` (from the axes of the shape to the world). It then moves with `velocity` (m/s, of its
    /// pivot_of) and `spin` (rad/s about the pivot) until it is set again; bodies that touch it feel this velocity. A
    /// pose closer than a quarter of the finest body's spacing is reached evenly during the next frame. A pose further
    /// away is a jump: it pushes only the bodies that the obstacle now overlaps. Errors: usage (no such obstacle; a
    /// value that is not finite; a pose that is not a rotation and a shift).
    Status set_obstacle(std::size_t obstacle, const Eigen::Isometry3d& pose, const Vec3d& velocity = Vec3d::Zero(),
                        const Vec3d& spin = Vec3d::Zero());
    /// Moves an obstacle to `pose` evenly during the next frame; it pushes what is in its way and then stands. Errors:
    /// usage, for the reasons of set_obstacle.
    Status move_obstacle(std::size_t obstacle, const Eigen::Isometry3d& pose);
    Eigen::Isometry3d obstacle_pose(std::size_t obstacle) const; ///< where it stands now

    /// Contacts of the last frame, and contacts that ended in it: one event a pair, ascending by body, obstacles first.
    /// There are no events for parts of one body and for bodies of mpm. A pair that sleeps has `stays` with impulse 0.
    /// Contacts of a removed body end with the next frame. Empty after restore.
    const std::vector<ContactEvent>& contact_events() const;

    /// The first body or obstacle that a ray hits; empty where there is none, or the ray is not finite. direction: any
    /// length above 0. A ray that starts inside something hits it at distance 0. The ray sees the surfaces that contact
    /// sees: detail smaller than half a spacing is not there, and bodies of mpm are balls around their particles. Cost
    /// O(cells) for each body whose box the ray hits.
    std::optional<WorldHit> cast_ray(const Vec3d& origin, const Vec3d& direction, const RayOptions& options = {}) const;

    /// Whether a rigid body may sleep, from now on. save() does not keep it. Errors: usage (no such body).
    Status set_may_sleep(std::size_t body, bool may_sleep);
    bool is_asleep(std::size_t body) const;
    /// Wakes a body. Bodies that lie on it wake when it moves. Errors: usage (no such body).
    Status wake(std::size_t body);

    Energy energy(const RunContext& context = RunContext()) const;
    Momentum momentum() const;
    FractureReport fracture(std::size_t body) const;
    /// The inverted cells of a body and of its pieces. Rigid bodies and models without cells have none. Cost O(cells).
    InvertedCells inverted(std::size_t body) const;

    /// Attaches points to a body, such as the driver of a model. points: on the body at rest, m. Returns a number for
    /// `attached`. Cost O(points log particles).
    std::size_t attach(std::size_t body, std::span<const Vec3f> points, const RunContext& context = RunContext());
    /// Whether the body of an attachment is still there; if not, `attached` does nothing.
    bool has_attachment(std::size_t attachment) const;
    /// Attaches points of a body that breaks, each to a piece: pieces[i] is the number of point i's piece in the
    /// partition. Use it where several pieces have a copy of one point. Copies move as one, to the byte, while their
    /// pieces hold together; then each follows its own piece. A point whose piece does not exist or has no matter
    /// follows the piece that it lies in, and so do all points of the function above.
    std::size_t attach(std::size_t body, std::span<const Vec3f> points, std::span<const Index> pieces,
                       const RunContext& context = RunContext());
    /// Where attached points are now (world, m), and the deformation gradients there. points: as many as were attached;
    /// gradients: as many, or empty when not wanted.
    void attached(std::size_t attachment, std::span<Vec3f> points, std::span<Mat3f> gradients,
                  const RunContext& context = RunContext()) const;

    /// How far the matter around attached points has changed: 0 as at the start, 1 molten or kneaded through. It never
    /// falls, and is 0 for bodies that are not of mpm. renewal: as many numbers as points were attached.
    void renewal(std::size_t attachment, std::span<float> renewal) const;
    /// The particles of a body of mpm; none for other bodies.
    MatterParticles matter(std::size_t body) const;
    double heat() const; ///< J: heat in all bodies of mpm, counted from 0 K

    /// Save the state of everything that moves as bytes, and load it again; obstacles that were set are part of it. A
    /// state fits only the bodies, the world and the options that it was saved with. Bodies that were added or removed
    /// before save() have to be added and removed again, in the same order, before restore(). Errors: bad_file
    /// (damaged), mismatch (a state of other bodies, world or options); nothing has changed then.
    std::string save() const;
    Status restore(std::string_view bytes);

private:
    explicit Simulation(std::unique_ptr<SimulationState> state);
    Status check_obstacle(std::size_t obstacle) const;
    Status check_count(std::size_t body, const Vectors& vectors, const char* what) const;
    std::size_t attach_on_grid(std::size_t body, std::span<const Vec3f> points,
                               const RunContext& context = RunContext());
    Status check_vectors(std::size_t body, const Vectors& vectors, const char* what) const;
    Status check_finite(std::size_t body, const Vectors& vectors, const char* what) const;
    std::unique_ptr<SimulationState> state_;
};

} // namespace filigree
