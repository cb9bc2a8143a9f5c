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

namespace filigree {

struct SimulationState {
    /// body_count: with pieces.
    SimulationState(World the_world, std::size_t body_count, std::size_t the_actor_count,
                    const StepOptions& the_options, const MadeFor& what_for)
        : world(std::move(the_world)), options(the_options), actor_count(the_actor_count), made_for(what_for),
          contacts(world, body_count, the_actor_count, the_options.contacts_between_bodies,
                   the_options.contacts_within_bodies),
          rigid_pairs(world, the_actor_count, the_options.contacts_between_bodies), external(world, body_count) {}
    SimulationState(const SimulationState&) = delete; // contacts and external refer to the world
    SimulationState& operator=(const SimulationState&) = delete;

    World world;
    const StepOptions options;
    const std::size_t actor_count;
    const MadeFor made_for;
    std::vector<BodyState> bodies;                           ///< of the actors, then pieces
    std::vector<std::string> why_rigid;                      ///< of each actor: Simulation::why_rigid
    std::optional<std::pair<std::size_t, Vec3f>> first_lost; ///< of this frame: actor and place (lost_particles.h)
    std::vector<StartOverlap> start_overlaps;
    std::vector<Cracks> cracks; ///< of bodies that break
    Contacts contacts;
    RigidPairs rigid_pairs;
    RigidContacts rigid_contacts; ///< room that is used again; nothing is remembered
    ExternalForces external;
    std::unique_ptr<mpm::Bodies> grid; ///< of bodies of mpm; never null
    std::vector<Attachment> attachments;
    std::vector<std::size_t> first_tracers; ///< of each attachment: its points on the grid, where it is of such a body
    std::vector<std::vector<PieceFollower>> followers; ///< of each attachment; empty: its body does not break
    std::vector<std::vector<Vec3f>> pinned_from;       ///< of each pin: where its particles were at the start
    std::size_t frame = 0;                             ///< frames done

    double frame_seconds() const { return 1 / options.frames_per_second; }
    double time() const { return double(frame) * frame_seconds(); }
    const Cracks* cracks_of(std::size_t body) const; ///< null: it does not break
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

float least_spacing(std::span<const BodyState> bodies);
/// Puts pinned particles where their motion has them at `now`, with its velocity; dt: of the substep, 0 at the start.
/// Of bodies on the grid, or of the others.
void move_pins(SimulationState& state, double now, float dt, bool on_grid = false);
/// Starts that no step can take: coincident particles are shaken apart, and what is stretched too far is scaled down.
/// Whether anything was done.
bool repair_start(SimulationState& state, std::span<const ElasticReport> elastic, FrameReport& report,
                  const RunContext& context);
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
