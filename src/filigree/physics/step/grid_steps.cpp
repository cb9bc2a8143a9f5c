// Bodies on the grid take steps of their own; what acts on them from outside is what acts on all bodies.
#include "filigree/physics/step/simulation_state.h"
#include "filigree/physics/step/stopwatch.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

constexpr double kMostGridSteps = 20'000; ///< a frame

template <class Visit>
void each_on_grid(SimulationState& state, const Visit& visit) {
    for (std::size_t slot = 0; slot < state.bodies.size(); ++slot)
        if (state.bodies[slot].is_on_grid) visit(state.bodies[slot], slot);
}

/// Forces at the step's end, as momentum of the particles that the grid takes up.
void push_on_grid(SimulationState& state, double now, float dt) {
    bool any = false;
    each_on_grid(state, [&](BodyState& body, std::size_t slot) {
        if (!state.external.acts_on(slot, now)) return;
        any = true;
        state.grid->read(body.actor, body.positions, body.velocities);
        body.forces = Vectors(body.positions.size());
    });
    if (!any) return;
    state.external.add_forces_on_grid(state.bodies, now);
    each_on_grid(state, [&](const BodyState& body, std::size_t slot) {
        if (state.external.acts_on(slot, now)) state.grid->kick(body.actor, body.forces, dt);
    });
}

void hold_on_grid(SimulationState& state, double now, float dt) {
    if (state.world.pins.empty()) return;
    move_pins(state, now, dt, true);
    each_on_grid(state, [&](const BodyState& body, std::size_t) {
        state.grid->move_fixed(body.actor, body.positions, body.velocities);
    });
}

} // namespace

void step_on_grid(SimulationState& state, double from, double until, FrameReport& report, const RunContext& context) {
    mpm::Bodies& grid = *state.grid;
    if (grid.empty()) return;
    const Stopwatch watch(report.elastic_seconds);
    double now = from;
    unsigned steps = 0;
    while (until - now > 1e-9 * (until - from) && !context.is_cancelled()) {
        const double longest = std::max(double(grid.longest_step(now, context)), (until - from) / kMostGridSteps);
        const double left = until - now, count = std::max(1.0, std::ceil(left / longest));
        const auto dt = float(left / count);
        const double before = now;
        now = count <= 1 ? until : now + double(dt);
        push_on_grid(state, now, dt);
        grid.step(before, now, context);
        hold_on_grid(state, now, dt);
        ++steps;
    }
    report.substeps = std::max(report.substeps, steps);
    each_on_grid(state, [&](BodyState& body, std::size_t slot) {
        note_deformation(report, slot, {.least_volume_ratio = grid.least_volume_ratio(body.actor)});
        grid.read(body.actor, body.positions, body.velocities);
    });
}

} // namespace filigree
