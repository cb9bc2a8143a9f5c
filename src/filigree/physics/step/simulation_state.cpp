#include "filigree/physics/step/simulation_state.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

SavedBody save_body(const BodyState& body) {
    if (body.is_absent) return {};
    return {.positions = body.positions,
            .velocities = body.velocities,
            .elasticity = body.elasticity->state(),
            .rigid = body.rigid};
}

/// What moves; the rest is the body's. False where it is no pose.
bool restore_pose(RigidPose& pose, const RigidPose& saved) {
    if (!saved.centre.allFinite() || !saved.velocity.allFinite() || !saved.angular.allFinite() ||
        !(std::abs(saved.turn.norm() - 1) < 1e-6) || !(saved.quiet_seconds >= 0))
        return false;
    pose.centre = saved.centre;
    pose.velocity = saved.velocity;
    pose.turn = saved.turn;
    pose.angular = saved.angular;
    pose.quiet_seconds = saved.quiet_seconds;
    pose.sleeps = saved.sleeps;
    pose.rests = saved.rests;
    return true;
}

} // namespace

SavedState save_state(const SimulationState& state) {
    SavedState saved;
    saved.made_for = state.made_for;
    saved.frame = state.frame;
    for (const BodyState& body : state.bodies) saved.bodies.push_back(save_body(body));
    saved.contacts = state.contacts.memory();
    saved.rigid_pairs = state.rigid_pairs.memory();
    saved.grid = state.grid->state();
    for (const Cracks& cracks : state.cracks) saved.cracks.push_back(cracks.memory());
    return saved;
}

Status restore_state(SimulationState& state, SavedState saved) {
    const Error damaged{ErrorCode::bad_file, "The saved state is damaged; start the simulation anew."};
    const Error other{ErrorCode::mismatch,
                      "The saved state is of other bodies; resume it with the scene it was saved from."};
    if (saved.bodies.size() != state.bodies.size() || saved.cracks.size() != state.cracks.size()) return other;
    for (std::size_t c = 0; c < saved.cracks.size(); ++c)
        if (!state.cracks[c].set_memory(saved.cracks[c], state.bodies)) return damaged;
    for (std::size_t b = 0; b < state.bodies.size(); ++b) {
        BodyState& body = state.bodies[b];
        SavedBody& from = saved.bodies[b];
        if (body.is_absent) {
            if (from.positions.size() != 0 || from.velocities.size() != 0) return other;
            continue;
        }
        const std::size_t count = body.body->particle_count();
        if (from.positions.size() != count || from.velocities.size() != count) return other;
        if (!body.elasticity->restore_state(from.elasticity)) return other;
        if (from.rigid.has_value() != body.rigid.has_value()) return other;
        if (body.rigid && !restore_pose(*body.rigid, *from.rigid)) return damaged;
        body.positions = std::move(from.positions);
        body.velocities = std::move(from.velocities);
    }
    if (!state.grid->restore_state(saved.grid)) return other;
    for (BodyState& body : state.bodies)
        if (body.is_on_grid) state.grid->read(body.actor, body.positions, body.velocities);
    for (const Cracks& cracks : state.cracks) cracks.show_whole(state.bodies);
    if (!state.contacts.set_memory(saved.contacts, state.bodies)) return damaged;
    if (!state.rigid_pairs.set_memory(saved.rigid_pairs, state.bodies)) return damaged;
    state.frame = saved.frame;
    return Success{};
}

} // namespace filigree
