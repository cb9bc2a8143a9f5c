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
            .rubbed_seconds = body.rubbed_seconds,
            .hit = body.hit,
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

bool is_sound(const ContactEvents::PairMemory& pair, const SimulationState& state) {
    const std::size_t actors = state.slot_of.size(), others = pair.is_body ? actors : state.world.obstacles.size();
    return pair.body < actors && pair.other < others && pair.place.allFinite() && pair.normal.allFinite();
}

/// False where they are of other bodies, or no targets.
bool restore_targets(SimulationState& state, std::vector<TargetsMemory>& saved) {
    if (saved.size() != state.targets.size()) return false;
    for (std::size_t t = 0; t < saved.size(); ++t)
        if (!state.targets[t].takes(saved[t])) return false;
    for (std::size_t t = 0; t < saved.size(); ++t) {
        TargetsMemory& memory = state.targets[t].memory;
        memory = std::move(saved[t]);
        state.body_of(memory.actor).elasticity->set_rest_stretches(memory.from_stretches, memory.from_stretches);
    }
    return true;
}

/// Those that were not set go as the world was made.
bool restore_obstacles(SimulationState& state, const std::vector<SetMotion>& saved) {
    const auto sound = [&](const SetMotion& set) { return is_sound(set, state.world.obstacles.size()); };
    if (!std::ranges::all_of(saved, sound)) return false;
    std::vector<std::size_t> changed;
    for (const SetMotion& set : state.set_motions) {
        state.world.obstacles[set.obstacle].motion = state.made_motions[set.obstacle];
        changed.push_back(set.obstacle);
    }
    for (const SetMotion& set : saved) {
        state.world.obstacles[set.obstacle].motion = motion_of(set, state.world.obstacles[set.obstacle]);
        changed.push_back(set.obstacle);
    }
    state.set_motions = saved;
    for (const std::size_t obstacle : changed) state.contacts.set_obstacle(obstacle, false);
    return true;
}

} // namespace

SavedState save_state(const SimulationState& state) {
    SavedState saved;
    saved.made_for = state.made_for;
    saved.frame = state.frame;
    saved.set_motions = state.set_motions;
    for (const BodyState& body : state.bodies) saved.bodies.push_back(save_body(body));
    saved.contacts = state.contacts.memory();
    saved.rigid_pairs = state.rigid_pairs.memory();
    saved.grid = state.grid->state();
    for (const Targets& targets : state.targets) saved.targets.push_back(targets.memory);
    for (const Cracks& cracks : state.cracks) saved.cracks.push_back(cracks.memory());
    return saved;
}

Status restore_state(SimulationState& state, SavedState saved) {
    const Error damaged{ErrorCode::bad_file, "The saved state is damaged; start the simulation anew."};
    const Error other{
        ErrorCode::mismatch,
        "The saved state is of other bodies; resume it with the bodies that there were when it was saved."};
    if (saved.bodies.size() != state.bodies.size() || saved.cracks.size() != state.cracks.size()) return other;
    if (!restore_targets(state, saved.targets))
        return Error{ErrorCode::mismatch, "The saved state is of bodies that follow other targets; let them follow as "
                                          "they did when it was saved, then resume it."};
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
        if (!(from.rubbed_seconds >= 0)) return damaged;
        body.rubbed_seconds = from.rubbed_seconds;
        if (from.hit.pushed.other >= double(state.bodies.size())) return damaged;
        body.hit = from.hit;
    }
    for (const ContactEvents::PairMemory& pair : saved.contacts.touched)
        if (!is_sound(pair, state)) return damaged;
    if (!restore_obstacles(state, saved.set_motions)) return damaged;
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
