#include "filigree/physics/rigid/sleep.h"

#include "filigree/core/disjoint_sets.h"
#include "filigree/physics/rigid/rigid_body.h"

namespace filigree {

namespace {

/// What rigid bodies lie on, by what touched at last.
class Support {
public:
    explicit Support(const SimulationState& state)
        : groups_(state.bodies.size()), on_obstacle_(state.bodies.size(), 0), beside_soft_(state.bodies.size(), 0) {
        const auto is_rigid = [&](std::size_t b) { return state.bodies[b].rigid.has_value(); };
        state.contacts.each_holding([&](Index a, Index b) {
            if (state.bodies[a].is_absent || state.bodies[b].is_absent) return;
            beside_soft_[a] |= !is_rigid(b);
            beside_soft_[b] |= !is_rigid(a);
        });
        state.rigid_pairs.each_holding([&](Index a, Index b) {
            if (!state.bodies[a].is_absent && !state.bodies[b].is_absent) groups_.join(a, b);
        });
        state.contacts.each_on_obstacle([&](Index b) {
            if (is_rigid(b)) on_obstacle_[groups_.root(b)] = 1;
        });
    }
    /// Whether an obstacle carries a body, by others or itself.
    bool carries(std::size_t b) { return on_obstacle_[groups_.root(Index(b))] != 0; }
    /// Whether something touches it that never sleeps.
    bool is_beside_soft(std::size_t b) const { return beside_soft_[b] != 0; }
    /// Of its island: the rigid bodies that touch it, those that touch these, and so on.
    Index island(std::size_t b) { return groups_.root(Index(b)); }

private:
    DisjointSets groups_;                                 ///< of rigid bodies that touch
    std::vector<std::uint8_t> on_obstacle_, beside_soft_; ///< at each group's root; of each body
};

} // namespace

void let_rest(SimulationState& state, double from, double until) {
    const bool disturbed = state.external.has_wind() || obstacle_way(state.world, state.bodies, from, until) > 0;
    Support support(state);
    std::vector<std::uint8_t> is_awake(state.bodies.size(), 0); // at each island's root
    for (std::size_t b = 0; b < state.bodies.size(); ++b) {
        BodyState& body = state.bodies[b];
        if (!body.rigid || body.is_absent) continue;
        const bool is_moved = disturbed || body.is_held || state.external.pull(b, until) ||
                              state.external.push(state.slot_of[body.actor]);
        body.rigid->rests = !is_moved && support.carries(b);
        const bool may_sleep = body.rigid->rests && !support.is_beside_soft(b) && body.may_sleep;
        const bool is_tired = body.rigid->sleeps || grow_tired(body, state.frame_seconds());
        if (!(may_sleep && is_tired)) is_awake[support.island(b)] = 1;
    }
    for (std::size_t b = 0; b < state.bodies.size(); ++b) {
        BodyState& body = state.bodies[b];
        if (!body.rigid || body.is_absent || body.rigid->sleeps != (is_awake[support.island(b)] != 0)) continue;
        if (body.rigid->sleeps)
            wake(body);
        else
            fall_asleep(body);
    }
}

} // namespace filigree
