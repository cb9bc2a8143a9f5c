// A world and everything that moves in it, and how a frame of it is made. Private to the layer.
#pragma once

#include "filigree/physics/breaking/cracks.h"
#include "filigree/physics/breaking/piece_followers.h"
#include "filigree/physics/contact/contact.h"
#include "filigree/physics/grid/mpm.h"
#include "filigree/physics/rigid/rigid_pairs.h"
#include "filigree/physics/simulation.h"
#include "filigree/physics/step/external_forces.h"
#include "filigree/physics/step/made_for.h"
#include "filigree/physics/step/saved_state.h"
#include "filigree/physics/step/set_motion.h"
#include "filigree/physics/step/targets.h"

#include <algorithm>
#include <map>

namespace filigree {

struct SimulationState {
    /// body_count: of the actors and all pieces that there are at first.
    SimulationState(World the_world, std::size_t body_count, std::size_t actor_count, const StepOptions& the_options)
        : world(std::move(the_world)), options(the_options), made_for(filigree::made_for(world, the_options)),
          contacts(world, actor_count, the_options.contacts_between_bodies, the_options.contacts_within_bodies),
          rigid_pairs(world, actor_count, the_options.contacts_between_bodies), external(world, body_count) {
        for (const Obstacle& obstacle : world.obstacles) made_motions.push_back(obstacle.motion);
    }
    SimulationState(const SimulationState&) = delete; // contacts and external refer to the world
    SimulationState& operator=(const SimulationState&) = delete;

    World world;
    const StepOptions options;
    MadeFor made_for;
    /// Slots. At first of the actors, then pieces; what comes later takes a slot that is free, or the next.
    std::vector<BodyState> bodies;
    // Of each actor, by the numbers that users know; they are given once.
    std::vector<Index> slot_of;         ///< its body's; kNoIndex: it was removed
    std::vector<std::uint64_t> made_of; ///< made_for.h; 0: it was removed
    std::vector<std::string> why_rigid; ///< Simulation::why_rigid

    std::vector<RigidMotion> made_motions; ///< of each obstacle, as the world was made
    std::vector<SetMotion> set_motions;    ///< of those that were set since, ascending
    /// By body: itself, made rigid.
    std::map<std::weak_ptr<const Body>, std::weak_ptr<const Body>, std::owner_less<>> rigid_copies;
    std::optional<std::pair<std::size_t, Vec3f>> first_lost; ///< of this frame: actor and place (lost_particles.h)
    std::vector<StartOverlap> start_overlaps;
    std::vector<Cracks> cracks; ///< of bodies that break
    Contacts contacts;
    RigidPairs rigid_pairs;
    RigidContacts rigid_contacts; ///< room that is used again; nothing is remembered
    ExternalForces external;
    std::vector<Targets> targets;           ///< of bodies that follow, ascending by actor
    std::unique_ptr<mpm::Bodies> grid;      ///< of bodies of mpm; never null
    std::vector<Attachment> attachments;    ///< of slots; of bodies that were removed kNobody
    std::vector<std::size_t> first_tracers; ///< of each attachment: its points on the grid, where it is of such a body
    std::vector<std::vector<PieceFollower>> followers; ///< of each attachment; empty: its body does not break
    std::vector<std::vector<Vec3f>> pinned_from;       ///< of each pin: where its particles were at the start
    std::size_t frame = 0;                             ///< frames done

    double frame_seconds() const { return 1 / options.frames_per_second; }
    double time() const { return double(frame) * frame_seconds(); }
    bool has(std::size_t actor) const { return actor < slot_of.size() && slot_of[actor] != kNoIndex; }
    /// Whether a slot, which is not free, holds a piece of a body that breaks.
    bool is_piece(std::size_t slot) const { return slot_of[bodies[slot].actor] != slot; }
    BodyState& body_of(std::size_t actor) { return bodies[slot_of[actor]]; }
    float part_of_frame(double now) const { return float(std::clamp((now - time()) / frame_seconds(), 0.0, 1.0)); }
    const BodyState& body_of(std::size_t actor) const; ///< of one that was removed: a free slot
    const Cracks* cracks_of(std::size_t slot) const;   ///< null: it does not break
};

/// Steps by velocity Verlet. Returns the time reached: before `until` where something is not finite any more, or the
/// work was cancelled.
double step_explicitly(SimulationState& state, double from, double until, FrameReport& report,
                       const RunContext& context);

/// Steps bodies of mpm. Breaks off when cancelled.
void step_on_grid(SimulationState& state, double from, double until, FrameReport& report, const RunContext& context);

// Parts of a substep.

/// What a body's elasticity met, into the frame's report.
void note_deformation(FrameReport& report, std::size_t body, const ElasticReport& met);

float least_spacing(std::span<const BodyState> bodies); ///< m
/// Puts pinned particles where their motion has them at `now`, with its velocity; dt: of the substep, 0 at the start.
/// Of bodies on the grid, or of the others.
void move_pins(SimulationState& state, double now, float dt, bool on_grid = false);
/// Targets that jump take their particles along, at the start of a frame.
void follow_jumps(SimulationState& state);
/// Half a kick by the springs to targets; dt: of the whole substep.
void pull_to_targets(SimulationState& state, double now, float dt, const RunContext& context);
/// Puts particles that are held where their targets are at `now`.
void hold_on_targets(SimulationState& state, double now);
/// Starts that no step can take: coincident particles are shaken apart, and what is stretched too far is scaled down.
/// Whether anything was done.
bool repair_start(SimulationState& state, std::span<const ElasticReport> elastic, FrameReport& report,
                  const RunContext& context);
/// Where a half-space, a ball or a cuboid jumps into an elastic body between two times, the body is moved out of it as
/// a whole, and gets no speed by it. Bodies with pins are left to push_out.
void make_way(SimulationState& state, double before, double now);
/// The same of one obstacle that stands elsewhere now.
void make_way(SimulationState& state, std::size_t obstacle, double now);
/// Moves out what contacts find too deep.
void push_out(SimulationState& state, double now, const RunContext& context);
/// Plastic flow.
void finish_substep(SimulationState& state, float dt, const RunContext& context);
/// What lets go after a substep. `forces`: anything did, and forces have to be found anew; `contacts`: and they, too.
struct Breaks {
    bool forces = false, contacts = false;
};
/// now: when the substep ended; before: when it began.
Breaks break_bodies(SimulationState& state, double before, double now, const RunContext& context);

/// Everything that moves, and back. Errors of restore_state: mismatch (of other bodies), bad_file (numbers out of
/// range); the state is then of no use.
SavedState save_state(const SimulationState& state);
Status restore_state(SimulationState& state, SavedState saved);

} // namespace filigree
