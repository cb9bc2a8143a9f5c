#include "filigree/physics/step/simulation_state.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

SavedBody save_body(const BodyState& body) {
    if (body.is_absent) return {};
    SavedBody saved{.positions = body.positions,
                    .velocities = body.velocities,
                    .elasticity = body.elasticity->state(),
                    .rigid = body.rigid,
                    .flow = body.flow,
                    .surface = {},
                    .balls = {},
                    .attachments = {}};
    if (!body.has_flowed()) return saved;
    saved.surface = body.surface.rest;
    saved.balls = body.balls.rest;
    return saved;
}

/// Embeds points of the surface where they were saved. Those that are there already cost nothing. False where they are
/// not as many.
bool embed_again(Embedding& points, const std::vector<Vec3f>& places, const BodyState& body,
                 const RunContext& context) {
    if (places.size() != points.size()) return false;
    if (places != points.rest) points = embed(places, body.elasticity->reference(), body.body->spacing(), context);
    return true;
}

bool restore_attachment(Attachment& attachment, SavedPoints saved, const BodyState& body, const RunContext& context) {
    if (saved.gradients.size() != saved.places.size() || saved.places.size() != attachment.points.size()) return false;
    if (saved.places != attachment.embedding.rest)
        attachment.embedding =
            embed_to_follow(saved.places, body.elasticity->reference(), body.body->spacing(), nullptr, context);
    attachment.gradients = std::move(saved.gradients);
    return true;
}

/// False where saved points are not those of this body.
bool restore_points(BodyState& body, SavedBody& saved, std::span<Attachment* const> attachments, bool had_flowed,
                    const RunContext& context) {
    if (!body.has_flowed()) {
        if (!had_flowed) return true;
        embed_surface_at_rest(body, body.has_balls(), context);
        set_surface_stiffness(body);
        for (Attachment* attachment : attachments)
            *attachment = attach(body, attachment->body, std::vector(attachment->points), context);
        return true;
    }
    if (!embed_again(body.surface, saved.surface, body, context)) return false;
    if (!embed_again(body.balls, saved.balls, body, context)) return false;
    set_surface_stiffness(body);
    for (std::size_t a = 0; a < attachments.size(); ++a) {
        if (a >= saved.attachments.size()) // attached since
            *attachments[a] = attach(body, attachments[a]->body, std::vector(attachments[a]->points), context);
        else if (!restore_attachment(*attachments[a], std::move(saved.attachments[a]), body, context))
            return false;
    }
    return true;
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
    for (const Attachment& attachment : state.attachments)
        if (state.bodies[attachment.body].has_flowed())
            saved.bodies[attachment.body].attachments.push_back({attachment.embedding.rest, attachment.gradients});
    saved.contacts = state.contacts.memory();
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
    const RunContext context(1);
    for (std::size_t b = 0; b < state.bodies.size(); ++b) {
        BodyState& body = state.bodies[b];
        SavedBody& from = saved.bodies[b];
        if (body.is_absent) {
            if (from.positions.size() != 0 || from.velocities.size() != 0) return other;
            continue;
        }
        const std::size_t count = body.body->particle_count();
        if (from.positions.size() != count || from.velocities.size() != count) return other;
        if (!from.flow.empty() && from.flow.size() != count) return other;
        if (!from.flow.empty() && body.body->material.model != MaterialModel::meshfree) return damaged;
        for (const Mat3f& gradient : from.flow)
            if (!gradient.allFinite()) return damaged;
        if (!body.elasticity->restore_state(from.elasticity)) return other;
        if (from.rigid.has_value() != body.rigid.has_value()) return other;
        if (body.rigid && !restore_pose(*body.rigid, *from.rigid)) return damaged;
        body.positions = std::move(from.positions);
        body.velocities = std::move(from.velocities);
        const bool had_flowed = body.has_flowed();
        body.flow = std::move(from.flow);
        if (!restore_points(body, from, state.attachments_of(b), had_flowed, context)) return other;
    }
    if (!state.grid->restore_state(saved.grid)) return other;
    for (BodyState& body : state.bodies)
        if (body.is_on_grid) state.grid->read(body.actor, body.positions, body.velocities);
    for (const Cracks& cracks : state.cracks) cracks.show_whole(state.bodies);
    if (!state.contacts.set_memory(saved.contacts, state.bodies)) return damaged;
    state.frame = saved.frame;
    return Success{};
}

} // namespace filigree
