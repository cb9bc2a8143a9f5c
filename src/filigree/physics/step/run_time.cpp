#include "filigree/physics/step/run_time.h"

#include "filigree/physics/rigid/rigid_body.h"
#include "filigree/physics/step/begin_bodies.h"

#include <algorithm>
#include <limits>

namespace filigree {

namespace {

/// The first of so many slots in a row that are free, or follow the last one.
std::size_t find_slots(const SimulationState& state, std::size_t count) {
    std::size_t first = 0;
    for (std::size_t slot = 0; slot < state.bodies.size() && slot - first < count; ++slot)
        if (!state.bodies[slot].is_free()) first = slot + 1;
    return first;
}

/// Puts a body of mpm on the grid. Without matter on it the grid becomes that of this body.
Status add_to_grid(SimulationState& state, const Actor& actor) {
    constexpr double kSame = 1 + 1e-5; // spacings that differ by rounding
    const Body& body = *actor.body;
    const bool is_of_mpm = body.material.model == MaterialModel::mpm;
    if (is_of_mpm && state.grid->empty()) {
        state.grid = std::make_unique<mpm::Bodies>(state.world, std::span(&actor, 1), state.slot_of.size());
        return Success{};
    }
    const auto most = double(state.grid->spacing());
    if (is_of_mpm && body.spacing() > kSame * most)
        return Error{ErrorCode::usage, "actor.body has particles " + std::to_string(body.spacing()) +
                                           " m apart, and the grid of the bodies of mpm that are there is for no more "
                                           "than " +
                                           std::to_string(most) + " m; make it of more particles."};
    state.grid->add(actor);
    return Success{};
}

void note_start_overlaps(SimulationState& state, std::size_t actor, std::size_t slot) {
    for (StartOverlap& overlap :
         find_start_overlaps(state.world, state.contacts.shapes(), std::span(&state.bodies[slot], 1), state.time())) {
        overlap.body = actor;
        state.start_overlaps.push_back(overlap);
    }
}

/// A body that came, and its pieces.
void meet_others(SimulationState& state, std::size_t slot, const RunContext& context) {
    BodyState& body = state.bodies[slot];
    if (state.external.has_wind()) body.is_held = true;
    if (body.corners) body.corners->place(body.positions, body.velocities, context);
    state.contacts.add_body(state.bodies, slot);
}

void wake_if_asleep(SimulationState& state, std::size_t slot) {
    if (BodyState& body = state.bodies[slot]; body.rigid && body.rigid->sleeps) wake(body);
}

/// What lies on a body has nothing to lie on any more.
void wake_beside(SimulationState& state, std::size_t slot) {
    const auto wake_other = [&](std::size_t other) { wake_if_asleep(state, other); };
    state.contacts.each_beside(slot, wake_other);
    state.rigid_pairs.each_beside(slot, wake_other);
}

void end_attachments(SimulationState& state, std::size_t slot) {
    const bool is_on_grid = state.bodies[slot].is_on_grid;
    for (std::size_t k = 0; k < state.attachments.size(); ++k) {
        Attachment& attachment = state.attachments[k];
        if (attachment.body != slot) continue;
        const std::size_t first = state.first_tracers[k], count = attachment.points.size();
        if (is_on_grid) {
            state.grid->remove_tracers(first, count);
            for (std::size_t& other : state.first_tracers)
                if (other > first) other -= count;
        }
        attachment = {.body = BodyState::kNobody, .points = {}, .embedding = {}};
        state.followers[k] = {};
        state.first_tracers[k] = 0;
    }
}

/// What the world holds of a body.
void end_holds(SimulationState& state, std::size_t actor) {
    World& world = state.world;
    for (std::size_t p = world.pins.size(); p-- > 0;) {
        if (world.pins[p].body != actor) continue;
        world.pins.erase(world.pins.begin() + std::ptrdiff_t(p));
        state.pinned_from.erase(state.pinned_from.begin() + std::ptrdiff_t(p));
    }
    std::erase_if(world.forces, [&](const RegionForce& force) { return force.body == actor; });
    std::erase_if(world.hands, [&](const Hand& hand) { return hand.body == actor; });
}

void free_one(SimulationState& state, std::size_t slot) {
    wake_beside(state, slot);
    state.contacts.remove_body(state.bodies, slot);
    state.rigid_pairs.remove_body(state.bodies, slot);
    state.external.remove_body(slot);
    state.bodies[slot] = free_slot();
}

/// Whether a body may feel that an obstacle goes from one pose to the other.
bool is_in_reach(const SimulationState& state, const BodyState& body, std::size_t obstacle,
                 const std::array<Eigen::Isometry3d, 2>& poses) {
    const Box box = box_of(body.positions);
    const double way = way_between(poses[0], poses[1], std::span(&body, 1));
    const double reach = 0.5 * box.diagonal() + way + body.body->spacing();
    const ObstacleShape& shape = state.contacts.shapes()[obstacle];
    return std::ranges::any_of(poses, [&](const Eigen::Isometry3d& pose) {
        const Vec3d own = pose.inverse() * box.centre();
        if (shape.is_traced()) return shape.clearance(own, reach) < reach;
        const auto distance = distance_to(state.world.obstacles[obstacle], pose, box.centre().cast<float>()).distance;
        return double(distance) < reach;
    });
}

} // namespace

double way_between(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to, std::span<const BodyState> bodies) {
    Box box;
    for (const BodyState& body : bodies)
        if (body.positions.size() > 0 && is_finite(body.positions)) {
            const Box of = box_of(body.positions);
            box.extend(of.min);
            box.extend(of.max);
        }
    if (box.empty()) return std::numeric_limits<double>::infinity();
    const Eigen::Isometry3d change = to * from.inverse();
    double most = 0;
    for (int corner = 0; corner < 8; ++corner) {
        Vec3d at = box.min;
        for (int axis = 0; axis < 3; ++axis)
            if (corner >> axis & 1) at[axis] = box.max[axis];
        most = std::max(most, (change * at - at).norm());
    }
    return most;
}

Result<std::size_t> add_body(SimulationState& state, const Actor& actor, const RunContext& context) {
    const std::size_t number = state.slot_of.size();
    const std::uint64_t made = made_of(actor);
    std::vector<BodyState> pieces = begin_pieces(actor, number, context);
    if (const Status added = add_to_grid(state, actor); !added) return added.error();
    Beginning begun = begin_actor(state, actor, number, context);
    const std::size_t slot = find_slots(state, 1);
    std::vector<BodyState> alone;
    alone.push_back(std::move(begun.body));
    take_slots(state, slot, std::move(alone));
    state.slot_of.push_back(Index(slot));
    state.made_of.push_back(made);
    state.why_rigid.push_back(std::move(begun.why_rigid));
    const std::size_t count = pieces.size(), first_piece = count > 0 ? find_slots(state, count) : 0;
    take_slots(state, first_piece, std::move(pieces));
    if (actor.fracture) let_break(state, actor, slot, first_piece);
    state.external.resize(state.bodies.size());
    state.made_for.bodies = made_of_all(state.slot_of, state.made_of);
    meet_others(state, slot, context);
    for (std::size_t piece = 0; piece < count; ++piece) meet_others(state, first_piece + piece, context);
    if (actor.fracture) state.cracks.back().set_memory(state.cracks.back().memory(), state.bodies);
    note_start_overlaps(state, number, slot);
    return number;
}

void remove_body(SimulationState& state, std::size_t actor) {
    const std::size_t slot = state.slot_of[actor];
    const BodyState& body = state.bodies[slot];
    const std::size_t first_piece = body.first_piece, pieces = body.broken ? body.broken->pieces.size() : 0;
    end_attachments(state, slot);
    end_holds(state, actor);
    std::erase_if(state.targets, [&](const Targets& targets) { return targets.memory.actor == actor; });
    state.grid->remove(actor);
    std::erase_if(state.cracks, [&](const Cracks& cracks) { return cracks.whole() == slot; });
    for (std::size_t piece = 0; piece < pieces; ++piece) free_one(state, first_piece + piece);
    free_one(state, slot);
    std::erase_if(state.start_overlaps, [&](const StartOverlap& overlap) { return overlap.body == actor; });
    state.slot_of[actor] = kNoIndex;
    state.made_of[actor] = 0;
    state.why_rigid[actor].clear();
    state.made_for.bodies = made_of_all(state.slot_of, state.made_of);
}

void set_obstacle(SimulationState& state, const SetMotion& set, bool is_jump) {
    const std::size_t number = set.obstacle;
    Obstacle& obstacle = state.world.obstacles[number];
    const Eigen::Isometry3d stood = obstacle.motion.at(state.time());
    obstacle.motion = motion_of(set, obstacle);
    std::erase_if(state.set_motions, [&](const SetMotion& other) { return other.obstacle == set.obstacle; });
    const auto after = std::ranges::upper_bound(state.set_motions, set.obstacle, {}, &SetMotion::obstacle);
    state.set_motions.insert(after, set);
    if (is_jump || obstacle.motion.moves()) {
        const std::array<Eigen::Isometry3d, 2> poses = {stood, obstacle.motion.at(set.reached)};
        for (std::size_t b = 0; b < state.bodies.size(); ++b) {
            const BodyState& body = state.bodies[b];
            if (!body.rigid || !body.rigid->sleeps || body.is_absent) continue;
            if (state.contacts.is_beside_obstacle(b, number) || is_in_reach(state, body, number, poses))
                wake(state.bodies[b]);
        }
    }
    state.contacts.set_obstacle(number, is_jump);
    if (is_jump) make_way(state, number, state.time());
}

} // namespace filigree
