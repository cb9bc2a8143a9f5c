#include "filigree/physics/simulation.h"

#include "filigree/physics/body/embedding.h"
#include "filigree/physics/rigid/rigid_body.h"
#include "filigree/physics/rigid/rigid_state.h"
#include "filigree/physics/rigid/sleep.h"
#include "filigree/physics/step/begin_bodies.h"
#include "filigree/physics/step/inverted_cells.h"
#include "filigree/physics/step/lost_particles.h"
#include "filigree/physics/step/simulation_state.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace filigree {

namespace {

Error usage(std::string sentence) { return {ErrorCode::usage, std::move(sentence)}; }

Status check_options(const StepOptions& options) {
    if (!(options.frames_per_second > 0 && std::isfinite(options.frames_per_second)))
        return usage("The number of frames a second must be above 0.");
    if (options.most_substeps == 0) return usage("Substeps are counted from 1.");
    return Success{};
}

/// All actors come first, then the pieces of those that break.
void begin_bodies(SimulationState& state, std::span<const Actor> actors, const RunContext& context) {
    std::vector<BodyState> bodies;
    for (std::size_t a = 0; a < actors.size(); ++a) {
        Beginning begun = begin_actor(state, actors[a], a, context);
        bodies.push_back(std::move(begun.body));
        state.why_rigid.push_back(std::move(begun.why_rigid));
        state.slot_of.push_back(Index(a));
    }
    take_slots(state, 0, std::move(bodies));
    for (std::size_t a = 0; a < actors.size(); ++a) {
        if (!actors[a].fracture) continue;
        const std::size_t first_piece = state.bodies.size();
        take_slots(state, first_piece, begin_pieces(actors[a], a, context));
        let_break(state, actors[a], a, first_piece);
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
        hand.body = state.slot_of[hand.body];
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

constexpr float kFollowingCrush = 0.02f; ///< of bodies that follow an animation: Elasticity::set_crush_share
constexpr double kContactGap = 0.08;     ///< spacings, Follow::contact_gap where it is unset

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
    state.contacts.events().begin_frame();
    follow_jumps(state);
    state.external.find_wind(state.bodies, from, state.options.frames_per_second, context);
    std::size_t held = step_bodies(state, from, until, report, context);
    if (context.is_cancelled()) return cancelled_error();
    step_on_grid(state, from, until, report, context);
    if (context.is_cancelled()) return cancelled_error();
    held += hold_lost_particles(state);
    report.clamped_particles += held;
    tell_first_lost(state, report);
    const BodyState& crushed = state.bodies[report.most_crushed];
    report.most_crushed = crushed.is_free() ? 0 : crushed.actor; // nothing was
    note_flow(state, report);
    for (const Cracks& cracks : state.cracks) cracks.show_whole(state.bodies);
    for (Targets& targets : state.targets) targets.end_frame();
    let_rest(state, from, until);
    state.contacts.events().end_frame(state.bodies);
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
    auto state = std::make_unique<SimulationState>(std::move(world), count, actors.size(), options);
    for (const Actor& actor : actors) state->made_of.push_back(made_of(actor));
    state->grid = std::make_unique<mpm::Bodies>(state->world, actors);
    begin_bodies(*state, actors, context);
    state->made_for.bodies = made_of_all(state->slot_of, state->made_of);
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
    state->start_overlaps = find_start_overlaps(state->world, state->contacts.shapes(), state->bodies);
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
std::size_t Simulation::body_count() const { return state_->slot_of.size(); }

const Body& Simulation::body(std::size_t body) const {
    assert(body < body_count());
    return *std::as_const(*state_).body_of(body).body;
}
const std::vector<StartOverlap>& Simulation::start_overlaps() const { return state_->start_overlaps; }
const std::string& Simulation::why_rigid(std::size_t body) const {
    assert(body < body_count());
    return state_->why_rigid[body];
}
const Vectors& Simulation::positions(std::size_t body) const {
    assert(body < body_count());
    return std::as_const(*state_).body_of(body).positions;
}
const Vectors& Simulation::velocities(std::size_t body) const {
    assert(body < body_count());
    return std::as_const(*state_).body_of(body).velocities;
}

Status Simulation::set_positions(std::size_t body, const Vectors& positions) {
    if (Status checked = check_vectors(body, positions, "positions"); !checked) return checked;
    BodyState& state = state_->body_of(body);
    state.positions = positions;
    fit_rigid(*state_, state);
    if (state.is_on_grid) state_->grid->set_positions(body, positions);
    state_->contacts.was_placed(state_->slot_of[body]);
    state_->contacts.begin_anew();
    return Success{};
}
Status Simulation::set_velocities(std::size_t body, const Vectors& velocities) {
    if (Status checked = check_vectors(body, velocities, "velocities"); !checked) return checked;
    BodyState& state = state_->body_of(body);
    state.velocities = velocities;
    fit_rigid(*state_, state);
    if (state.is_on_grid) state_->grid->set_velocities(body, velocities);
    return Success{};
}
Status Simulation::check_count(std::size_t body, const Vectors& vectors, const char* what) const {
    if (Status checked = check_body(body); !checked) return checked;
    const std::size_t count = state_->body_of(body).positions.size();
    if (vectors.size() != count)
        return usage("Body " + std::to_string(body) + " has " + std::to_string(count) + " particles and was given " +
                     std::to_string(vectors.size()) + " " + what + ".");
    return Success{};
}
Status Simulation::check_vectors(std::size_t body, const Vectors& vectors, const char* what) const {
    if (Status checked = check_count(body, vectors, what); !checked) return checked;
    if (state_->body_of(body).is_absent && !state_->body_of(body).is_on_grid)
        return usage("Body " + std::to_string(body) + " has broken.");
    return Success{};
}

/// what: of one particle.
Status Simulation::check_finite(std::size_t body, const Vectors& vectors, const char* what) const {
    for (std::size_t i = 0; i < vectors.size(); ++i)
        if (!vectors[i].allFinite())
            return usage("The " + std::string(what) + (what == std::string_view("force") ? " on" : " of") +
                         " particle " + std::to_string(i) + " of body " + std::to_string(body) + " is not finite.");
    return Success{};
}

Status Simulation::set_hands(std::vector<Hand> hands, const RunContext& context) {
    if (Status checked = check_hands(hands, body_count()); !checked) return checked;
    for (const Hand& hand : hands)
        if (Status checked = check_body(hand.body); !checked) return checked;
    for (const Cracks& cracks : state_->cracks)
        if (!cracks.is_open()) cracks.follow_whole(state_->bodies);
    state_->external.set_grips(make_grips(hands, *state_, context));
    state_->world.hands = std::move(hands);
    return Success{};
}

Status Simulation::set_forces(std::size_t body, const Vectors& newtons) {
    if (Status checked = newtons.size() > 0 ? check_count(body, newtons, "forces") : check_body(body); !checked)
        return checked;
    if (Status checked = check_finite(body, newtons, "force"); !checked) return checked;
    state_->external.set_pushes(state_->slot_of[body], newtons);
    return Success{};
}

namespace {

Status check_growth(const BodyState& state, std::size_t body, std::span<const Mat3f> stretches) {
    if (!stretches.empty() && !state.elasticity->can_grow())
        return usage("Body " + std::to_string(body) +
                     " yields or is not of the model fem, and only elastic bodies of fem grow.");
    const std::string wrong = check_stretches(stretches, state.body->particle_count());
    return wrong.empty() ? Status(Success{}) : Status(usage(wrong));
}

} // namespace

Status Simulation::set_follow(std::size_t body, Follow follow, const Vectors& positions, const Vectors& velocities,
                              std::span<const Mat3f> stretches) {
    if (Status checked = check_body(body); !checked) return checked;
    std::vector<Targets>& targets = state_->targets;
    const auto place = std::ranges::lower_bound(targets, body, {}, [](const Targets& t) { return t.memory.actor; });
    const bool follows = place != targets.end() && place->memory.actor == body;
    BodyState& state = state_->body_of(body);
    if (follow.frequency.empty()) {
        release_targets(*state_, state);
        state_->contacts.set_passing(state_->slot_of[body], nullptr);
        state_->contacts.set_own_gap(state_->slot_of[body], 0);
        if (follows) targets.erase(place);
        return Success{};
    }
    if (state.rigid || state.is_on_grid || state.broken)
        return usage("Body " + std::to_string(body) +
                     (state.rigid        ? " is rigid and has no particles that could follow targets; switch "
                                           "automatic_rigid off or make it of more particles."
                      : state.is_on_grid ? " is of the model mpm, which does not follow targets; make it of fem."
                                         : " breaks, and bodies that break do not follow targets."));
    if (Status checked = check_count(body, positions, "targets"); !checked) return checked;
    if (Status checked = check_count(body, velocities, "target velocities"); !checked) return checked;
    if (Status checked = check_finite(body, positions, "target"); !checked) return checked;
    if (Status checked = check_finite(body, velocities, "target velocity"); !checked) return checked;
    if (const std::string wrong = check_follow(follow, positions.size()); !wrong.empty()) return usage(wrong);
    if (Status checked = check_growth(state, body, stretches); !checked) return checked;
    release_targets(*state_, state);
    state_->contacts.set_passing(
        state_->slot_of[body],
        follow.passing.empty() ? nullptr
                               : std::make_shared<const OwnCells::Passing>(*state.body, follow.groups, follow.passing));
    state_->contacts.set_own_gap(state_->slot_of[body],
                                 float(follow.contact_gap.value_or(kContactGap * state.body->spacing())));
    Targets made(body, std::move(follow), positions, velocities, state.body->spacing());
    made.memory.from_stretches = rest_stretches(stretches);
    state.elasticity->set_rest_stretches(made.memory.from_stretches, made.memory.from_stretches);
    state.follows = true;
    state.elasticity->set_crush_share(kFollowingCrush);
    for (const Index i : made.held) {
        state.fixed[i] = 1;
        state.inverse_mass[i] = 0;
    }
    if (follows)
        *place = std::move(made);
    else
        targets.insert(place, std::move(made));
    return Success{};
}

Status Simulation::set_targets(std::size_t body, const Vectors& positions, const Vectors& velocities,
                               const Vectors& accelerations, std::span<const Mat3f> stretches) {
    if (Status checked = check_count(body, positions, "targets"); !checked) return checked;
    if (Status checked = check_count(body, velocities, "target velocities"); !checked) return checked;
    if (accelerations.size() > 0)
        if (Status checked = check_count(body, accelerations, "accelerations"); !checked) return checked;
    if (Status checked = check_finite(body, positions, "target"); !checked) return checked;
    if (Status checked = check_finite(body, velocities, "target velocity"); !checked) return checked;
    if (Status checked = check_finite(body, accelerations, "acceleration"); !checked) return checked;
    const auto found = std::ranges::find(state_->targets, body, [](const Targets& t) { return t.memory.actor; });
    if (found == state_->targets.end())
        return usage("Body " + std::to_string(body) + " follows no targets; call set_follow first.");
    if (Status checked = check_growth(state_->body_of(body), body, stretches); !checked) return checked;
    found->set(positions, velocities, accelerations, rest_stretches(stretches));
    return Success{};
}

Status Simulation::set_gravity(const Vec3d& gravity) {
    if (!gravity.allFinite()) return usage("The gravity must be three finite numbers.");
    if (gravity == state_->world.gravity) return Success{};
    state_->world.gravity = gravity;
    state_->rigid_pairs.set_gravity(gravity);
    for (BodyState& body : state_->bodies)
        if (body.rigid) filigree::wake(body);
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
    const Cracks* cracks = has_body(body) ? state_->cracks_of(state_->slot_of[body]) : nullptr;
    return cracks ? cracks->report() : FractureReport{};
}

std::size_t Simulation::attach(std::size_t body, std::span<const Vec3f> points, const RunContext& context) {
    assert(body < body_count());
    const BodyState& state = std::as_const(*state_).body_of(body);
    std::vector<Index> numbers;
    if (state.broken)
        for (const Vec3f& point : points) numbers.push_back(state.broken->partition.piece_at(point.cast<double>()));
    return attach(body, points, numbers, context);
}

/// Points go on from where the particles that were around them at rest have them now.
std::size_t Simulation::attach_on_grid(std::size_t body, std::span<const Vec3f> points, const RunContext& context) {
    const BodyState& state = state_->body_of(body);
    const Embedding around = embed(points, state.body->rest, state.body->spacing(), context);
    std::vector<Vec3f> places(points.size());
    std::vector<Mat3f> gradients(points.size());
    fit_embedded(around, state.body->rest, state.positions, places, gradients, context);
    state_->first_tracers.push_back(state_->grid->add_tracers(body, places, gradients));
    state_->attachments.push_back({state_->slot_of[body], {points.begin(), points.end()}, {}});
    state_->followers.emplace_back();
    return state_->attachments.size() - 1;
}

std::size_t Simulation::attach(std::size_t body, std::span<const Vec3f> points, std::span<const Index> pieces,
                               const RunContext& context) {
    assert(body < body_count());
    const BodyState& state = std::as_const(*state_).body_of(body);
    if (state.is_on_grid) return attach_on_grid(body, points, context);
    state_->attachments.push_back(has_body(body) ? filigree::attach(state, state_->slot_of[body], points, context)
                                                 : Attachment{BodyState::kNobody, {}, {}});
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
    if (has_attachment(attachment) && state_->bodies[state_->attachments[attachment].body].is_on_grid)
        state_->grid->read_renewal(state_->first_tracers[attachment], renewal);
    else
        std::ranges::fill(renewal, 0.0f);
}

MatterParticles Simulation::matter(std::size_t body) const {
    assert(body < body_count());
    return std::as_const(*state_).body_of(body).is_on_grid ? state_->grid->matter(body) : MatterParticles{};
}
double Simulation::heat() const { return state_->grid->heat(); }

void Simulation::attached(std::size_t attachment, std::span<Vec3f> points, std::span<Mat3f> gradients,
                          const RunContext& context) const {
    assert(attachment < state_->attachments.size());
    if (!has_attachment(attachment)) return;
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
        return restored;
    }
    state_->contacts.events().forget_frame();
    return restored;
}

} // namespace filigree
