// What contacts remember, as values that are saved and put back.
#include "filigree/physics/contact/contact.h"

#include <algorithm>
#include <cmath>

namespace filigree {

Contacts::Memory Contacts::memory() const {
    Memory memory{.travelled = travelled_,
                  .reach = reach_,
                  .pairs = {},
                  .candidates = {},
                  .recovers = recovers_,
                  .touched = events_.memory()};
    for (const ContactPair& pair : pairs_) {
        memory.pairs.push_back({pair.points, pair.touched, Index(pair.candidates.size()),
                                std::uint32_t(pair.knows_side), pair.displacement, pair.reach, pair.since});
        for (const Candidate& at : pair.candidates)
            memory.candidates.push_back({at.point, at.place.cell, at.anchor.cell,
                                         Index(at.grasp.holds) + 2 * Index(at.grasp.slides) + 4 * Index(at.is_tangled),
                                         at.place.local, at.anchor.local, at.entry_normal, at.rigid_force,
                                         at.local_point});
    }
    return memory;
}

bool Contacts::is_sound(const Memory& memory, std::span<const BodyState> bodies) const {
    if (memory.recovers.size() != bodies.size() || !std::isfinite(memory.travelled) || !std::isfinite(memory.reach))
        return false;
    const auto exists = [&](ColliderId id) {
        return id.number() < (id.is_obstacle() ? shapes_.size() : bodies.size());
    };
    const auto has_matter = [&](ColliderId id) { return !id.is_obstacle() && matter_[id.number()]->matter; };
    std::size_t from = 0;
    const PairMemory* before = nullptr;
    for (const PairMemory& pair : memory.pairs) {
        if (!exists(pair.points) || !exists(pair.touched)) return false;
        if (before && std::pair(before->points, before->touched) >= std::pair(pair.points, pair.touched)) return false;
        before = &pair;
        const bool is_own = pair.points == pair.touched, is_of_matter = !pair.touched.is_obstacle();
        if (is_of_matter ? !has_matter(pair.touched) : pair.points.is_obstacle()) return false;
        if (is_own && !own_cells_[pair.points.number()]) return false; // nothing here would search for these
        if (!is_own && is_of_matter && !pair.points.is_obstacle() && !between_bodies_) return false;
        if (!std::isfinite(pair.displacement) || !std::isfinite(pair.reach) || !(pair.since >= 0)) return false;
        if (pair.candidates > memory.candidates.size() - from) return false;
        const std::size_t points = pair.points.is_obstacle() ? kNoIndex : bodies[pair.points.number()].surface.size();
        const std::size_t cells = is_of_matter ? bodies[pair.touched.number()].body->cells.cells.size() : 0;
        const auto is_rigid = [&](ColliderId id) { return id.is_obstacle() || bodies[id.number()].rigid; };
        const bool is_solved = is_rigid(pair.points) && is_rigid(pair.touched);    // by impulses
        if (is_solved && is_of_matter && !pair.points.is_obstacle()) return false; // two rigid bodies are RigidPairs'
        for (Index k = 0; k < pair.candidates; ++k, ++from) {
            const CandidateMemory& at = memory.candidates[from];
            if (at.point >= points || (is_of_matter && at.cell >= cells)) return false;
            const bool is_anchored = is_of_matter && (at.flags & 1) && !is_solved;
            if (is_anchored && at.anchor_cell >= cells) return false;
            if (!at.local.allFinite() || !at.anchor_local.allFinite() || !at.entry_normal.allFinite() ||
                !at.rigid_force.allFinite() || !at.local_point.allFinite())
                return false;
        }
    }
    return from == memory.candidates.size();
}

bool Contacts::set_memory(const Memory& memory, std::span<const BodyState> bodies) {
    if (!is_sound(memory, bodies)) return false;
    travelled_ = memory.travelled;
    reach_ = memory.reach;
    recovers_ = memory.recovers;
    time_.reset();
    pairs_.clear();
    auto from = memory.candidates.begin();
    for (const PairMemory& saved : memory.pairs) {
        ContactPair& pair = pairs_.emplace_back(make_pair(saved.points, saved.touched, bodies));
        pair.knows_side = (saved.knows_side & 1) != 0;
        pair.displacement = saved.displacement;
        pair.reach = saved.reach;
        pair.since = saved.since;
        for (Index k = 0; k < saved.candidates; ++k, ++from)
            pair.candidates.push_back({.point = from->point,
                                       .place = {from->cell, from->local},
                                       .grasp = {(from->flags & 1) != 0, (from->flags & 2) != 0},
                                       .anchor = {from->anchor_cell, from->anchor_local},
                                       .entry_normal = from->entry_normal,
                                       .is_tangled = (from->flags & 4) != 0,
                                       .rigid_force = from->rigid_force,
                                       .local_point = from->local_point});
        pair.pad();
    }
    list_work(bodies);
    events_.set_memory(memory.touched);
    return true;
}

} // namespace filigree
