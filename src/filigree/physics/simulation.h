// Bodies in a world, moved frame by frame.
#pragma once

#include "filigree/physics/body.h"
#include "filigree/physics/contact_event.h"
#include "filigree/physics/fracture.h"
#include "filigree/physics/matter_particles.h"
#include "filigree/physics/world.h"
#include "filigree/physics/world_hit.h"

namespace filigree {

/// A body and how it starts.
struct Actor {
    std::shared_ptr<const Body> body;
    Eigen::Isometry3d placement = Eigen::Isometry3d::Identity(); ///< from the body's rest positions to the world
    Vec3d velocity = Vec3d::Zero();                              ///< m/s
    Vec3d spin = Vec3d::Zero();                                  ///< rad/s about the centre of mass
    std::shared_ptr<const Fracture> fracture = nullptr;          ///< of this body; null: it does not break
    /// A rigid body that hardly moves while something holds it sleeps, and costs nothing until something touches it.
    bool may_sleep = true;
};

/// automatic: bodies that would need too many substeps become rigid, StepOptions::automatic_rigid. explicit_steps:
/// those of 8 cells and more stay elastic, whatever they cost.
enum class StepMode { automatic, explicit_steps };

struct StepOptions {
    double frames_per_second = 60;
    StepMode mode = StepMode::automatic;
    bool contacts_between_bodies = true, contacts_within_bodies = true;
    /// Whether bodies of fem and springs become rigid that have fewer than kFewestElasticCells cells, or that would
    /// need more than most_substeps a frame at rest. Those that are pinned, that yield or that break stay elastic.
    bool automatic_rigid = true;
    unsigned most_substeps = 500;
};
inline constexpr std::size_t kFewestElasticCells = 8;

inline constexpr unsigned kMostSubsteps = 20000; ///< a frame: what asks for more takes longer ones than are stable

/// What a frame took and met.
struct FrameReport {
    unsigned substeps = 0;          ///< of velocity Verlet, as many as stability asked for, up to kMostSubsteps
    unsigned unstable_substeps = 0; ///< of them longer than was stable: the motion is then not to be trusted
    std::size_t unstable_body = 0;  ///< the body that asked for the shortest
    std::size_t contacts = 0;       ///< surface points that touch something, at the frame's end
    double deepest_contact = 0;     ///< m below an obstacle's surface
    double deepest_in_matter = 0;   ///< m that a point of a surface lay inside another body, or its own
    float least_volume_ratio = 1;   ///< smallest J of all cells; 0 or less: inverted
    std::size_t most_crushed = 0;   ///< the body that has it; below 0.3 such cells are damped
    float most_stretch = 1;
    /// Cells and particles of plastic fem and meshfree that have flowed to seven times their length, and are elastic
    /// from there on: what flows further is mpm's.
    std::size_t flowed_out = 0;
    std::size_t most_flowed = 0; ///< the body that has most of them
    double elastic_seconds = 0, contact_seconds = 0, other_seconds = 0;
    std::size_t clamped_particles = 0; ///< whose motion was not finite, or whose start was scaled down
    std::size_t clamped_body = 0;      ///< that the first of them is of
    Vec3f clamped_at = Vec3f::Zero();  ///< world, m: where that one stands
};

/// Cells that are inside out.
struct InvertedCells {
    std::size_t count = 0;
    float least = 1;             ///< the smallest volume of all of the body's cells, as a part of that at rest
    Vec3f place = Vec3f::Zero(); ///< world, m: the middle of that one
};

struct Energy {
    double kinetic = 0, elastic = 0, potential = 0; ///< J; potential: of gravity, relative to the world's origin
    double total() const { return kinetic + elastic + potential; }
};
struct Momentum {
    Vec3d linear = Vec3d::Zero();  ///< kg m/s
    Vec3d angular = Vec3d::Zero(); ///< kg m^2/s, about the world's origin
};

/// Errors: usage, with the place of the first thing that is wrong, as in "world.obstacles[2].friction must be 0 or
/// more." Everything is checked: that there are bodies with particles, that what is named is there, that numbers are
/// finite and in their ranges, that keys ascend. Cost O(keys and particles named).
Status check_world(const World& world, std::span<const Actor> actors);
/// The same for a body that is added ("actor.body is missing."), and for how an obstacle is set.
Status check_actor(const Actor& actor);
Status check_obstacle_motion(const Eigen::Isometry3d& pose, const Vec3d& velocity, const Vec3d& spin);
/// The same for hands that pull some of so many bodies, for the air and for heat sources.
Status check_hands(std::span<const Hand> hands, std::size_t body_count);
Status check_air(const Keyed<double>& temperature, double heat_transfer);
Status check_heat_sources(std::span<const HeatSource> sources);

/// A body that starts inside of an obstacle, or across its surface.
struct StartOverlap {
    std::size_t body = 0, obstacle = 0;
    double depth = 0;       ///< m, most that a surface point lies beyond
    bool is_inside = false; ///< all of it lies inside of a closed mesh, and stays there
    /// As in "body 'a' starts inside obstacle 'b', ...", without a full stop.
    std::string sentence(const std::string& body_name, const std::string& obstacle_name) const;
};

struct SimulationState;

/// Same bytes for any number of threads, and for a run that was saved and restored in between. Const functions may be
/// called from several threads at a time. `body`, `obstacle` and `attachment` are numbers of what there is; only
/// functions that return a Status check them. Of a body that was removed the others have nothing: no particles, zeros.
class Simulation {
public:
    /// Errors: as check_world; usage (an option out of its range).
    static Result<Simulation> create(World world, std::vector<Actor> actors, const StepOptions& options,
                                     const RunContext& context);
    Simulation(Simulation&&) noexcept;
    Simulation& operator=(Simulation&&) noexcept;
    ~Simulation();

    /// One frame. Errors: cancelled. The state is then that of the frame's start, as it is where memory runs out.
    Result<FrameReport> advance(const RunContext& context);

    std::size_t frame() const; ///< frames done
    double time() const;       ///< s
    const World& world() const;
    std::size_t body_count() const; ///< of all that ever were: a number is given once
    bool has_body(std::size_t body) const;
    /// Errors: usage (there is no such body, or it was removed).
    Status check_body(std::size_t body) const;
    const Body& body(std::size_t body) const; ///< as it is moved: rigid where automatic_rigid made it so
    /// Why automatic_rigid made a body rigid, as in "it has only 5 cells"; "" where it did not.
    const std::string& why_rigid(std::size_t body) const;
    /// What should be told before the run: bodies deeper in obstacles than 3/4 of their spacing when they were created.
    const std::vector<StartOverlap>& start_overlaps() const;
    const Vectors& positions(std::size_t body) const;  ///< world, m; broken: of the heaviest of each corner's copies
    const Vectors& velocities(std::size_t body) const; ///< m/s
    /// For tests, and for whoever starts a body in another shape. Values may be anything; the next frame repairs what
    /// no step can take: what is no number returns to where it was at rest beside the others. Errors: usage (no such
    /// body, another number of particles).
    Status set_positions(std::size_t body, const Vectors& positions);
    Status set_velocities(std::size_t body, const Vectors& velocities);
    /// Hands may come and go while it runs, and take the place of those there were. Each seizes the particles that were
    /// around its point at rest. Errors: as check_hands; the old hands then stay.
    Status set_hands(std::vector<Hand> hands, const RunContext& context);
    /// Forces on a body's particles, N, from now on and in place of those set before; none at all: no such forces. A
    /// body that is pushed does not sleep. Of a body that broke the copies of a particle share its force by mass. Like
    /// hands they are no part of what save() keeps. Errors: usage (no such body, another number of particles, a force
    /// that is not finite).
    Status set_forces(std::size_t body, const Vectors& newtons);

    /// The air around bodies of mpm and what warms them (World), from now on and in place of those before; hands' rules
    /// hold. Errors: as check_world; what was set before then stays.
    Status set_air(const Keyed<double>& temperature, double heat_transfer);
    Status set_heat_sources(std::vector<HeatSource> sources);

    // A world that changes: between frames, also while bodies break. Same bytes for any number of threads.

    /// One more body, from now on. It touches others as body_friction and body_restitution say. Returns its number, the
    /// next. Cost: as for that body in create, and O(bodies). Errors: usage (as check_actor; a body of mpm that is
    /// coarser than the grid that others of mpm share), cancelled; nothing has changed then. Where memory runs out on
    /// the way, the simulation may only be destroyed.
    Result<std::size_t> add_body(const Actor& actor, const RunContext& context);
    /// A body is gone, with its pieces and with pins, forces, hands and attachments of it; what lay on it wakes. Its
    /// number is not given again. Errors: as check_body.
    Status remove_body(std::size_t body);

    /// From now on an obstacle stands at `pose`, from the shape's own axes to the world, and goes on at `velocity`
    /// (m/s, of its pivot_of) and `spin` (rad/s about that), until it is set again. What touches it feels this
    /// velocity. A pose that is within a quarter of the finest body's spacing of where it stands is reached evenly in
    /// the next frame; further it is a jump, which sweeps over nothing and pushes nothing but what it now lies in.
    /// Errors: usage (no such obstacle; not finite, no turn and shift).
    Status set_obstacle(std::size_t obstacle, const Eigen::Isometry3d& pose, const Vec3d& velocity = Vec3d::Zero(),
                        const Vec3d& spin = Vec3d::Zero());
    /// In the next frame it goes to `pose` evenly, pushing what is in the way, and stands there. Errors: the same.
    Status move_obstacle(std::size_t obstacle, const Eigen::Isometry3d& pose);
    Eigen::Isometry3d obstacle_pose(std::size_t obstacle) const; ///< where it stands now

    /// What touched in the last frame, and what no longer did: one event for each two, ascending by body, obstacles
    /// first. Parts of one body do not count, nor what bodies of mpm touch. What sleeps stays, without an impulse. Of a
    /// body that was removed all end with the next frame. None after restore.
    const std::vector<ContactEvent>& contact_events() const;

    /// The first thing that a ray meets. direction: any length above 0. Bodies as they are now, by their surface at
    /// rest that goes along with their cells, as contacts have it: meshes' details of less than half a spacing are not
    /// seen. Bodies without a field (of mpm) by their particles, as balls. A ray that starts inside of something meets
    /// it at once. Cost O(cells) of bodies whose box it meets. Nothing: it meets nothing, or is no ray.
    std::optional<WorldHit> cast_ray(const Vec3d& origin, const Vec3d& direction, const RayOptions& options = {}) const;

    /// Whether a rigid body may sleep, from now on. No part of what save() keeps. Errors: as check_body.
    Status set_may_sleep(std::size_t body, bool may_sleep);
    bool is_asleep(std::size_t body) const;
    /// What lies on it wakes as it moves. Errors: as check_body.
    Status wake(std::size_t body);

    Energy energy(const RunContext& context) const;
    Momentum momentum() const;
    FractureReport fracture(std::size_t body) const;
    /// As a body's cells are now, pieces' included; of models without cells, and of rigid bodies, none. Cost O(cells).
    InvertedCells inverted(std::size_t body) const;

    /// Points that go along with a body: its driver, or all of a mesh. Positions on the body at rest, m.
    /// Returns a number for `attached`. Cost: as embed.
    std::size_t attach(std::size_t body, std::span<const Vec3f> points, const RunContext& context);
    /// False once its body was removed; `attached` does nothing then.
    bool has_attachment(std::size_t attachment) const;
    /// The same, each point with a piece, by the partition's number: what several pieces' copies of one point are
    /// carried by. Until the body breaks copies have the same bytes, and where pieces hold together also afterwards;
    /// then each goes with its own piece, also where that ends before it. Of a body that breaks; above, each point goes
    /// with the piece it lies in, as do points here of a piece that there is none of, or without matter.
    std::size_t attach(std::size_t body, std::span<const Vec3f> points, std::span<const Index> pieces,
                       const RunContext& context);
    /// Where they are now (world, m) and the gradients from rest to there: as many as were attached. `gradients` may be
    /// empty: not wanted.
    void attached(std::size_t attachment, std::span<Vec3f> points, std::span<Mat3f> gradients,
                  const RunContext& context) const;

    /// How far the matter around attached points is new: 0 as it was at the start, 1 molten or kneaded through; it
    /// never falls. Of bodies that are not of mpm 0. As many as were attached.
    void renewal(std::size_t attachment, std::span<float> renewal) const;
    /// The particles of a body of mpm; of others none.
    MatterParticles matter(std::size_t body) const;
    double heat() const; ///< J in bodies of mpm, from 0 K

    /// Everything that moves, as bytes (docs/scenes.md), and back; obstacles that were set, too. A state goes on only
    /// with the bodies, the world and the options that it was saved with, but for what the functions above may set:
    /// the same bodies have to have come and gone, in the same order. Errors: bad_file (damaged), mismatch (of others);
    /// nothing has changed then.
    std::string save() const;
    Status restore(std::string_view bytes);

private:
    explicit Simulation(std::unique_ptr<SimulationState> state);
    Status check_obstacle(std::size_t obstacle) const;
    Status check_count(std::size_t body, const Vectors& vectors, const char* what) const;
    std::size_t attach_on_grid(std::size_t body, std::span<const Vec3f> points, const RunContext& context);
    Status check_vectors(std::size_t body, const Vectors& vectors, const char* what) const;
    std::unique_ptr<SimulationState> state_;
};

} // namespace filigree
