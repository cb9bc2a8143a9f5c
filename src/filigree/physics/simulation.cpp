#include "filigree/physics/simulation.h"

#include "filigree/core/text.h"
#include "filigree/physics/rigid/rigid_body.h"
#include "filigree/physics/rigid/rigid_state.h"
#include "filigree/physics/rigid/sleep.h"
#include "filigree/physics/step/inverted_cells.h"
#include "filigree/physics/step/lost_particles.h"
#include "filigree/physics/step/simulation_state.h"
#include "filigree/physics/step/stiff_hits.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>

namespace filigree {

namespace {

Error usage(std::string sentence) { return {ErrorCode::usage, std::move(sentence)}; }

Status check_options(const StepOptions& options) {
    if (!(options.frames_per_second > 0 && std::isfinite(options.frames_per_second)))
        return usage("The number of frames a second must be above 0.");
    if (options.most_substeps == 0) return usage("Substeps are counted from 1.");
    return Success{};
}

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

/// Bodies that are too small or too stiff for explicit steps are made rigid; those of one kind go on sharing theirs.
class AutomaticRigid {
public:
    AutomaticRigid(const World& world, const StepOptions& options, std::span<const Actor> actors)
        : options_(options), may_be_rigid_(actors.size(), options.automatic_rigid ? 1 : 0) {
        for (const Pin& pin : world.pins) may_be_rigid_[pin.body] = 0;
        for (std::size_t a = 0; a < actors.size(); ++a)
            if (actors[a].fracture) may_be_rigid_[a] = 0;
    }

    /// "": it stays as it is.
    std::string reason(std::size_t number, const BodyState& state) const {
        const Body& body = *state.body;
        const MaterialModel model = body.material.model;
        if (!may_be_rigid_[number] || body.material.is_plastic() ||
            (model != MaterialModel::fem && model != MaterialModel::springs))
            return "";
        if (const std::size_t cells = body.cells.cells.size(); cells < kFewestElasticCells)
            return "it has only " + std::to_string(cells) + (cells == 1 ? " cell" : " cells");
        const double substeps = substeps_at_rest(state);
        if (options_.mode != StepMode::automatic || substeps <= options_.most_substeps) return "";
        return "elastic, it would need " + with_commas(std::uint64_t(substeps)) + " substeps a frame";
    }
    std::shared_ptr<const Body> rigid(const std::shared_ptr<const Body>& body) {
        std::shared_ptr<const Body>& found = made_[body];
        if (!found) found = std::make_shared<const Body>(as_rigid(*body));
        return found;
    }

private:
    double substeps_at_rest(const BodyState& state) const {
        return std::sqrt(double(state.rest_squared_frequency)) / (2 * options_.frames_per_second);
    }

    const StepOptions& options_;
    std::vector<std::uint8_t> may_be_rigid_;
    std::map<std::shared_ptr<const Body>, std::shared_ptr<const Body>> made_;
};

/// Whether particles are corners of cells that deform.
bool has_cells(MaterialModel model) { return model == MaterialModel::fem || model == MaterialModel::springs; }

void begin_bodies(SimulationState& state, std::vector<Actor>& actors, const RunContext& context) {
    AutomaticRigid automatic(state.world, state.options, actors);
    for (Actor& actor : actors) {
        const std::size_t number = state.bodies.size();
        if (state.grid->has(number)) {
            state.bodies.push_back(begin_on_grid(state, actor, number));
            state.why_rigid.emplace_back();
            continue;
        }
        BodyState body = begin_body(actor, number, context);
        state.why_rigid.push_back(automatic.reason(number, body));
        if (!state.why_rigid.back().empty()) {
            actor.body = automatic.rigid(actor.body);
            body = begin_body(actor, number, context);
        }
        if (has_cells(body.body->material.model)) find_light_corners(body);
        state.bodies.push_back(std::move(body));
    }
}

/// Bodies for the pieces of those that break; they wait.
void begin_pieces(SimulationState& state, std::span<const Actor> actors, const RunContext& context) {
    for (std::size_t a = 0; a < actors.size(); ++a) {
        if (!actors[a].fracture) continue;
        const std::size_t first = state.bodies.size();
        state.bodies[a].broken = actors[a].fracture->body;
        state.bodies[a].first_piece = first;
        for (const std::shared_ptr<const Body>& piece : actors[a].fracture->body->pieces) {
            state.bodies.push_back(begin_body({piece, actors[a].placement}, a, context));
            state.bodies.back().is_absent = true;
            find_light_corners(state.bodies.back());
        }
        state.cracks.emplace_back(actors[a].fracture, a, first);
    }
}

void begin_pins(SimulationState& state) {
    for (const Pin& pin : state.world.pins) {
        BodyState& body = state.bodies[pin.body];
        std::vector<Vec3f>& from = state.pinned_from.emplace_back();
        for (const Index particle : pin.particles) {
            body.fixed[particle] = 1;
            body.inverse_mass[particle] = 0;
            from.push_back(body.positions[particle]);
            if (!body.broken) continue;
            for (const CornerCopy& copy : body.broken->copies_of(particle)) {
                BodyState& piece = state.bodies[body.first_piece + copy.piece];
                piece.fixed[copy.corner] = 1;
                piece.is_held = true;
            }
        }
        body.is_held = true;
    }
    for (const BodyState& body : state.bodies)
        if (body.is_on_grid) state.grid->set_fixed(body.actor, body.fixed);
    for (const bool on_grid : {false, true}) move_pins(state, 0, 0, on_grid);
    for (const BodyState& body : state.bodies)
        if (body.is_on_grid) state.grid->move_fixed(body.actor, body.positions, body.velocities);
}

std::vector<Grip> make_grips(std::span<const Hand> hands, const SimulationState& state, const RunContext& context) {
    std::vector<Grip> grips;
    for (Hand hand : hands) {
        const BodyState& body = state.bodies[hand.body];
        grips.push_back(make_grip(hand, body, context));
        if (!body.broken) continue; // else it holds on to the piece that its point is of
        hand.body = body.first_piece + body.broken->piece_at(hand.point.cast<double>());
        grips.push_back(make_grip(hand, state.bodies[hand.body], context));
    }
    return grips;
}

/// Where plastic strain has come to its limit.
void note_flow(const SimulationState& state, FrameReport& report) {
    std::size_t most = 0;
    for (const BodyState& body : state.bodies) {
        if (body.is_absent) continue;
        const std::size_t count = body.elasticity->flowed_out();
        report.flowed_out += count;
        if (count <= most) continue;
        most = count;
        report.most_flowed = body.actor;
    }
}

/// Substeps until the frame ends. What is not finite is held on the way, and the rest of the frame goes on from there;
/// a state that is lost again and again stays as it is until the next frame. Returns how many particles were held.
std::size_t step_bodies(SimulationState& state, double from, double until, FrameReport& report,
                        const RunContext& context) {
    constexpr int kMostRepairs = 4;
    std::size_t held = 0;
    const auto hold_lost = [&] {
        const std::size_t more = hold_lost_particles(state);
        for (std::size_t b = 0; b < state.bodies.size() && more > 0; ++b) state.contacts.was_placed(b);
        if (more > 0) state.contacts.begin_anew();
        held += more;
    };
    hold_lost();
    for (int repairs = 0; from < until && repairs <= kMostRepairs && !context.is_cancelled(); ++repairs) {
        from = step_explicitly(state, from, until, report, context);
        hold_lost();
    }
    return held;
}

/// One frame. Cancelled work leaves the state half done.
Result<FrameReport> step_frame(SimulationState& state, const RunContext& context) {
    const double from = state.time(), until = double(state.frame + 1) * state.frame_seconds();
    FrameReport report;
    state.contacts.clear_touches();
    state.external.find_wind(state.bodies, from, state.options.frames_per_second, context);
    std::size_t held = step_bodies(state, from, until, report, context);
    if (context.is_cancelled()) return cancelled_error();
    step_on_grid(state, from, until, report, context);
    if (context.is_cancelled()) return cancelled_error();
    held += hold_lost_particles(state);
    report.clamped_particles += held;
    tell_first_lost(state, report);
    report.most_crushed = state.bodies[report.most_crushed].actor;
    note_flow(state, report);
    for (const Cracks& cracks : state.cracks) cracks.show_whole(state.bodies);
    let_rest(state, from, until);
    ++state.frame;
    return report;
}

/// After particles were moved one by one. A pose is of finite ones alone.
void fit_rigid(SimulationState& state, BodyState& body) {
    if (!body.rigid) return;
    hold_lost_particles(state, body);
    fit_pose(body);
    body.rigid->rests = false;
}

/// Puts the state back to what it was, unless all went well: also where memory ran out on the way.
class UnlessWhole {
public:
    explicit UnlessWhole(SimulationState& state) : state_(state), start_(save_state(state)) {}
    UnlessWhole(const UnlessWhole&) = delete;
    UnlessWhole& operator=(const UnlessWhole&) = delete;
    ~UnlessWhole() {
        if (is_whole_) return;
        [[maybe_unused]] const Status undone = restore_state(state_, std::move(start_));
        assert(undone.ok());
    }
    void keep() { is_whole_ = true; }

private:
    SimulationState& state_;
    SavedState start_;
    bool is_whole_ = false;
};

} // namespace

Simulation::Simulation(std::unique_ptr<SimulationState> state) : state_(std::move(state)) {}
Simulation::Simulation(Simulation&&) noexcept = default;
Simulation& Simulation::operator=(Simulation&&) noexcept = default;
Simulation::~Simulation() = default;

Result<Simulation> Simulation::create(World world, std::vector<Actor> actors, const StepOptions& options,
                                      const RunContext& context) {
    if (Status checked = check_options(options); !checked) return checked.error();
    if (Status checked = check_world(world, actors); !checked) return checked.error();
    std::size_t count = actors.size();
    for (const Actor& actor : actors)
        if (actor.fracture) count += actor.fracture->body->pieces.size();
    const MadeFor made = made_for(world, actors, options);
    auto state = std::make_unique<SimulationState>(std::move(world), count, actors.size(), options, made);
    state->grid = std::make_unique<mpm::Bodies>(state->world, actors);
    begin_bodies(*state, actors, context);
    begin_pieces(*state, actors, context);
    for (const RegionForce& force : state->world.forces)
        for (BodyState& body : state->bodies)
            if (body.actor == force.body) body.is_held = true;
    if (state->external.has_wind())
        for (BodyState& body : state->bodies) body.is_held = true;
    state->external.set_grips(make_grips(state->world.hands, *state, context));
    begin_pins(*state);
    for (Cracks& cracks : state->cracks)
        if (!cracks.set_memory(cracks.memory(), state->bodies)) assert(false); // works out what follows from it
    place_corners(state->bodies, context);
    state->contacts.begin(state->bodies);
    state->start_overlaps = find_start_overlaps(state->world, state->bodies);
    return Simulation(std::move(state));
}

Result<FrameReport> Simulation::advance(const RunContext& context) {
    if (context.is_cancelled()) return cancelled_error();
    UnlessWhole start(*state_);
    Result<FrameReport> report = step_frame(*state_, context);
    if (report) start.keep();
    return report;
}

std::size_t Simulation::frame() const { return state_->frame; }
double Simulation::time() const { return state_->time(); }
const World& Simulation::world() const { return state_->world; }
std::size_t Simulation::body_count() const { return state_->actor_count; }

const Body& Simulation::body(std::size_t body) const {
    assert(body < body_count());
    return *state_->bodies[body].body;
}
const std::vector<StartOverlap>& Simulation::start_overlaps() const { return state_->start_overlaps; }
const std::string& Simulation::why_rigid(std::size_t body) const {
    assert(body < body_count());
    return state_->why_rigid[body];
}
const Vectors& Simulation::positions(std::size_t body) const {
    assert(body < body_count());
    return state_->bodies[body].positions;
}
const Vectors& Simulation::velocities(std::size_t body) const {
    assert(body < body_count());
    return state_->bodies[body].velocities;
}

Status Simulation::set_positions(std::size_t body, const Vectors& positions) {
    if (Status checked = check_vectors(body, positions, "positions"); !checked) return checked;
    state_->bodies[body].positions = positions;
    fit_rigid(*state_, state_->bodies[body]);
    if (state_->bodies[body].is_on_grid) state_->grid->set_positions(body, positions);
    state_->contacts.was_placed(body);
    state_->contacts.begin_anew();
    return Success{};
}
Status Simulation::set_velocities(std::size_t body, const Vectors& velocities) {
    if (Status checked = check_vectors(body, velocities, "velocities"); !checked) return checked;
    state_->bodies[body].velocities = velocities;
    fit_rigid(*state_, state_->bodies[body]);
    if (state_->bodies[body].is_on_grid) state_->grid->set_velocities(body, velocities);
    return Success{};
}
Status Simulation::check_count(std::size_t body, const Vectors& vectors, const char* what) const {
    if (body >= body_count())
        return usage("There is no body " + std::to_string(body) + "; there are " + std::to_string(body_count()) +
                     ", counted from 0.");
    const std::size_t count = state_->bodies[body].positions.size();
    if (vectors.size() != count)
        return usage("Body " + std::to_string(body) + " has " + std::to_string(count) + " particles and was given " +
                     std::to_string(vectors.size()) + " " + what + ".");
    return Success{};
}
Status Simulation::check_vectors(std::size_t body, const Vectors& vectors, const char* what) const {
    if (Status checked = check_count(body, vectors, what); !checked) return checked;
    if (state_->bodies[body].is_absent && !state_->bodies[body].is_on_grid)
        return usage("Body " + std::to_string(body) + " has broken.");
    return Success{};
}

Status Simulation::set_hands(std::vector<Hand> hands, const RunContext& context) {
    if (Status checked = check_hands(hands, body_count()); !checked) return checked;
    for (const Cracks& cracks : state_->cracks)
        if (!cracks.is_open()) cracks.follow_whole(state_->bodies);
    state_->external.set_grips(make_grips(hands, *state_, context));
    state_->world.hands = std::move(hands);
    return Success{};
}

Status Simulation::set_forces(std::size_t body, const Vectors& newtons) {
    if (newtons.size() > 0 || body >= body_count())
        if (Status checked = check_count(body, newtons, "forces"); !checked) return checked;
    for (std::size_t i = 0; i < newtons.size(); ++i)
        if (!newtons[i].allFinite())
            return usage("The force on particle " + std::to_string(i) + " of body " + std::to_string(body) +
                         " is not finite.");
    state_->external.set_pushes(body, newtons);
    return Success{};
}

Status Simulation::set_air(const Keyed<double>& temperature, double heat_transfer) {
    if (Status checked = check_air(temperature, heat_transfer); !checked) return checked;
    state_->world.air_temperature = temperature;
    state_->world.air_heat_transfer = heat_transfer;
    return Success{};
}
Status Simulation::set_heat_sources(std::vector<HeatSource> sources) {
    if (Status checked = check_heat_sources(sources); !checked) return checked;
    state_->world.heat_sources = std::move(sources);
    return Success{};
}

Energy Simulation::energy(const RunContext& context) const {
    Energy energy;
    for (const BodyState& body : state_->bodies) {
        if (body.is_absent && !body.is_on_grid) continue;
        if (!body.is_on_grid) energy.elastic += body.elasticity->energy(body.positions, context);
        for (std::size_t i = 0; i < body.positions.size(); ++i) {
            const double mass = double(body.body->mass[i]);
            energy.kinetic += 0.5 * mass * body.velocities[i].cast<double>().squaredNorm();
            energy.potential -= mass * state_->world.gravity.dot(body.positions[i].cast<double>());
        }
    }
    energy.elastic += state_->grid->elastic_energy();
    energy.kinetic += state_->grid->affine_energy();
    return energy;
}

Momentum Simulation::momentum() const {
    Momentum momentum;
    for (const BodyState& body : state_->bodies) {
        if (body.is_absent && !body.is_on_grid) continue;
        const RigidState state = rigid_state(body);
        momentum.linear += state.linear;
        momentum.angular += state.angular + state.centre.cross(state.linear);
    }
    momentum.angular += state_->grid->affine_momentum();
    return momentum;
}

InvertedCells Simulation::inverted(std::size_t body) const {
    assert(body < body_count());
    return inverted_cells(*state_, body);
}

FractureReport Simulation::fracture(std::size_t body) const {
    assert(body < body_count());
    const Cracks* cracks = state_->cracks_of(body);
    return cracks ? cracks->report() : FractureReport{};
}

std::size_t Simulation::attach(std::size_t body, std::span<const Vec3f> points, const RunContext& context) {
    assert(body < body_count());
    const BodyState& state = state_->bodies[body];
    std::vector<Index> numbers;
    if (state.broken)
        for (const Vec3f& point : points) numbers.push_back(state.broken->partition.piece_at(point.cast<double>()));
    return attach(body, points, numbers, context);
}

/// Points go on from where the particles that were around them at rest have them now.
std::size_t Simulation::attach_on_grid(std::size_t body, std::span<const Vec3f> points, const RunContext& context) {
    const BodyState& state = state_->bodies[body];
    const Embedding around = embed(points, state.body->rest, state.body->spacing(), context);
    std::vector<Vec3f> places(points.size());
    std::vector<Mat3f> gradients(points.size());
    fit_embedded(around, state.body->rest, state.positions, places, gradients, context);
    state_->first_tracers.push_back(state_->grid->add_tracers(body, places, gradients));
    state_->attachments.push_back({body, {points.begin(), points.end()}, {}});
    state_->followers.emplace_back();
    return state_->attachments.size() - 1;
}

std::size_t Simulation::attach(std::size_t body, std::span<const Vec3f> points, std::span<const Index> pieces,
                               const RunContext& context) {
    assert(body < body_count());
    const BodyState& state = state_->bodies[body];
    if (state.is_on_grid) return attach_on_grid(body, points, context);
    state_->attachments.push_back(filigree::attach(state, body, points, context));
    state_->first_tracers.push_back(0);
    std::vector<PieceFollower>& followers = state_->followers.emplace_back();
    if (state.broken) {
        std::vector<Index> numbers;
        for (std::size_t p = 0; p < points.size(); ++p) {
            const std::vector<Index>& known = state.broken->piece_of_number;
            const Index number = p < pieces.size() ? pieces[p] : kNoIndex;
            const Index piece = number < known.size() ? known[number] : kNoIndex;
            numbers.push_back(piece != kNoIndex ? piece : state.broken->piece_at(points[p].cast<double>()));
        }
        followers = make_followers(*state.broken, state_->attachments.back().embedding, numbers);
    }
    return state_->attachments.size() - 1;
}

void Simulation::renewal(std::size_t attachment, std::span<float> renewal) const {
    assert(attachment < state_->attachments.size());
    if (state_->bodies[state_->attachments[attachment].body].is_on_grid)
        state_->grid->read_renewal(state_->first_tracers[attachment], renewal);
    else
        std::ranges::fill(renewal, 0.0f);
}

MatterParticles Simulation::matter(std::size_t body) const {
    assert(body < body_count());
    return state_->bodies[body].is_on_grid ? state_->grid->matter(body) : MatterParticles{};
}
double Simulation::heat() const { return state_->grid->heat(); }

void Simulation::attached(std::size_t attachment, std::span<Vec3f> points, std::span<Mat3f> gradients,
                          const RunContext& context) const {
    assert(attachment < state_->attachments.size());
    const Attachment& which = state_->attachments[attachment];
    const BodyState& body = state_->bodies[which.body];
    if (body.is_on_grid)
        state_->grid->read_tracers(state_->first_tracers[attachment], points, gradients);
    else if (body.is_absent)
        move_followers(state_->followers[attachment], *state_->cracks_of(which.body), state_->bodies, points, gradients,
                       context);
    else
        move_attached(body, which, points, gradients, context);
}

std::string Simulation::save() const { return write_saved_state(save_state(*state_)); }

Status Simulation::restore(std::string_view bytes) {
    Result<SavedState> saved = read_saved_state(bytes);
    if (!saved) return saved.error();
    if (Status same = check_same(saved->made_for, state_->made_for); !same) return same;
    SavedState before = save_state(*state_);
    Status restored = restore_state(*state_, std::move(saved).value());
    if (!restored) {
        [[maybe_unused]] const Status undone = restore_state(*state_, std::move(before));
        assert(undone.ok());
    }
    return restored;
}

} // namespace filigree
