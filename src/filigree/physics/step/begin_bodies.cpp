#include "filigree/physics/step/begin_bodies.h"

#include "filigree/core/text.h"
#include "filigree/physics/body/fields.h"
#include "filigree/physics/rigid/rigid_body.h"
#include "filigree/physics/rigid/rigid_state.h"
#include "filigree/physics/step/stiff_hits.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

/// Everything that is the same for a body whether it is stepped by itself or on the grid.
BodyState place_body(const Actor& actor, std::size_t number) {
    BodyState state;
    state.body = actor.body;
    state.actor = number;
    state.placement = actor.placement;
    state.may_sleep = actor.may_sleep;
    const Body& body = *actor.body;
    const std::size_t count = body.particle_count();
    state.positions = state.velocities = Vectors(count);
    for (std::size_t i = 0; i < count; ++i)
        state.positions.set(i, (actor.placement * body.rest[i].cast<double>()).cast<float>());
    const Vec3d centre = rigid_state(state).centre;
    for (std::size_t i = 0; i < count; ++i)
        state.velocities.set(
            i, (actor.velocity + actor.spin.cross(state.positions[i].cast<double>() - centre)).cast<float>());
    return state;
}

BodyState begin_body(const Actor& actor, std::size_t number, const RunContext& context) {
    BodyState state = place_body(actor, number);
    const Body& body = *actor.body;
    const std::size_t count = body.particle_count();
    state.elasticity = make_elasticity(body, context);
    state.forces = Vectors(count);
    state.rest_squared_frequency = state.elasticity->forces(body.rest, state.forces, context).squared_frequency;
    state.fixed.assign(count, 0);
    state.inverse_mass.resize(count);
    for (std::size_t i = 0; i < count; ++i) state.inverse_mass[i] = 1 / body.mass[i];
    if (!body.fields.damping.empty()) {
        state.damping = at_corners(body.cells, body.fields.damping);
        state.mean_damping = mean_at(state.damping, body.mass);
    }

    if (body.material.model == MaterialModel::rigid) {
        fit_pose(state);
        state.rest_squared_frequency = kRigidSquaredFrequency;
        state.surface_stiffness = rigid_surface_stiffness(state);
    }
    state.surface = body.surface.points;
    if (body.corners.size() != 0) state.corners.emplace(body.corners, count);
    if (!state.rigid) set_surface_stiffness(state);
    state.is_stiff = is_stiff(body.material) && !actor.fracture;
    return state;
}

BodyState begin_on_grid(SimulationState& state, const Actor& actor, std::size_t number) {
    BodyState body = place_body(actor, number);
    body.is_on_grid = body.is_absent = true;
    body.fixed.assign(body.positions.size(), 0);
    body.inverse_mass.assign(body.positions.size(), 0);
    body.forces = Vectors(body.positions.size());
    body.rest_squared_frequency = state.grid->rest_squared_frequency(number);
    state.grid->set_positions(number, body.positions);
    state.grid->set_velocities(number, body.velocities);
    Mat3f turning;
    turning << 0, -float(actor.spin.z()), float(actor.spin.y()), float(actor.spin.z()), 0, -float(actor.spin.x()),
        -float(actor.spin.y()), float(actor.spin.x()), 0;
    state.grid->set_velocity_gradient(number, turning);
    return body;
}

/// Whether particles are corners of cells that deform.
bool are_corners(MaterialModel model) { return model == MaterialModel::fem || model == MaterialModel::springs; }

/// Why a body that is too small or too stiff for explicit steps is made rigid. "": it stays as it is.
std::string why_made_rigid(const SimulationState& state, const Actor& actor, const BodyState& body) {
    const StepOptions& options = state.options;
    const bool is_pinned = std::ranges::find(state.world.pins, body.actor, &Pin::body) != state.world.pins.end();
    const Material& material = body.body->material;
    if (!options.automatic_rigid || is_pinned || actor.fracture || material.is_plastic() ||
        !are_corners(material.model))
        return "";
    if (const std::size_t cells = body.body->cells.cells.size(); cells < kFewestElasticCells)
        return "it has only " + std::to_string(cells) + (cells == 1 ? " cell" : " cells");
    const double substeps = std::sqrt(double(body.rest_squared_frequency)) / (2 * options.frames_per_second);
    if (options.mode != StepMode::automatic || substeps <= options.most_substeps) return "";
    return "elastic, it would need " + with_commas(std::uint64_t(substeps)) + " substeps a frame";
}

/// Those of one kind share theirs.
std::shared_ptr<const Body> rigid_copy(SimulationState& state, const std::shared_ptr<const Body>& body) {
    std::erase_if(state.rigid_copies, [](const auto& known) { return known.second.expired(); });
    std::weak_ptr<const Body>& known = state.rigid_copies[body];
    std::shared_ptr<const Body> copy = known.lock();
    if (!copy) known = copy = std::make_shared<const Body>(as_rigid(*body));
    return copy;
}

} // namespace

Beginning begin_actor(SimulationState& state, const Actor& actor, std::size_t number, const RunContext& context) {
    if (state.grid->has(number)) return {begin_on_grid(state, actor, number), ""};
    BodyState body = begin_body(actor, number, context);
    std::string why = why_made_rigid(state, actor, body);
    if (!why.empty()) {
        Actor rigid = actor;
        rigid.body = rigid_copy(state, actor.body);
        body = begin_body(rigid, number, context);
    }
    if (are_corners(body.body->material.model)) find_light_corners(body);
    return {std::move(body), std::move(why)};
}

std::vector<BodyState> begin_pieces(const Actor& actor, std::size_t number, const RunContext& context) {
    std::vector<BodyState> pieces;
    if (!actor.fracture) return pieces;
    for (const std::shared_ptr<const Body>& piece : actor.fracture->body->pieces) {
        Actor of_piece;
        of_piece.body = piece;
        of_piece.placement = actor.placement;
        pieces.push_back(begin_body(of_piece, number, context));
        pieces.back().is_absent = true;
        find_light_corners(pieces.back());
    }
    return pieces;
}

void take_slots(SimulationState& state, std::size_t first, std::vector<BodyState> bodies) {
    if (first + bodies.size() > state.bodies.size()) state.bodies.resize(first + bodies.size());
    std::ranges::move(bodies, state.bodies.begin() + std::ptrdiff_t(first));
}

void let_break(SimulationState& state, const Actor& actor, std::size_t slot, std::size_t first_piece) {
    state.bodies[slot].broken = actor.fracture->body;
    state.bodies[slot].first_piece = first_piece;
    state.cracks.emplace_back(actor.fracture, slot, first_piece);
}

} // namespace filigree
