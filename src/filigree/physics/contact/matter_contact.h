// Surface points in the matter of other bodies, and of their own. Private to the layer.
#pragma once

#include "filigree/physics/body/body_state.h"
#include "filigree/physics/contact/contact_events.h"
#include "filigree/physics/contact/contact_law.h"
#include "filigree/physics/contact/extremes_kernel.h"
#include "filigree/physics/contact/matter.h"
#include "filigree/physics/contact/own_cells.h"
#include "filigree/physics/contact/pair_laws.h"
#include "filigree/physics/rigid/rigid_contacts.h"

#include <algorithm>
#include <limits>
#include <memory>

namespace filigree {

struct ContactReport {
    std::size_t contacts = 0; ///< points that touch
    float deepest = 0;        ///< m, in an obstacle
    float deepest_in_matter = 0;
};

/// A particle and its part in how a place in matter moves.
struct Carrier {
    Index particle;
    float weight;
};
/// The particles that move a place in matter, each once.
std::vector<Carrier> carriers_of(const BodyState& body, const Matter& matter, const Matter::Place& place);

class CellBoxes;

/// Each surface point that lies in a cell of another body, or of a far part of its own, is pushed out along the normal
/// of that matter's surface, and held by friction to the place in that matter where it landed. What pushes the point
/// pushes the cell's corners (BodyState::corners) back at the same place, so that momentum and angular momentum stay
/// what they were.
class MatterContacts {
public:
    static constexpr float kMostReach = 0.5f; ///< spacings that near bodies may go between two searches, at most
    static constexpr float kOutside = 0.25f;  ///< cells that a point may lie outside of the last one and still touch

    /// actors: that bodies belong to.
    MatterContacts(const World& world, std::size_t actors, bool between_bodies, bool within_bodies)
        : world_(world), laws_(world, actors), between_bodies_(between_bodies), within_bodies_(within_bodies) {}

    /// Once, when all bodies are there.
    void begin(std::span<const BodyState> bodies);
    /// As of Contacts.
    void add_body(std::span<const BodyState> bodies, std::size_t body);
    void remove_body(std::span<const BodyState> bodies, std::size_t body);
    template <class Visit>
    void each_beside(std::size_t body, const Visit& visit) const {
        for (const Side& side : sides_)
            if (!side.pairs.empty() && side.body != side.other && (side.body == body || side.other == body))
                visit(side.body == body ? side.other : side.body);
    }

    /// The next search finds everything again; what touches is remembered.
    void begin_anew();
    /// Before a frame: speeds, and which bodies meet themselves, as positions and velocities are now.
    void begin_frame(std::span<const BodyState> bodies, const RunContext& context);
    /// After a frame of explicit steps: what has moved since the last search, for the next frame and memory().
    void end_frame(std::span<const BodyState> bodies, const RunContext& context);
    /// Positions have changed by dt times velocities. Cost O(particles).
    void travel(std::span<const BodyState> bodies, float dt, const RunContext& context);
    /// m/s: bound on what particles of bodies that `counts` have beside each other, as of the last travel.
    template <class Counts>
    float relative_speed_of_all(const Counts& counts) const {
        std::optional<Extremes> all;
        for (std::size_t b = 0; b < speeds_.size(); ++b)
            if (counts(b)) all = all ? all->with(speeds_[b]) : speeds_[b];
        return all ? Extremes::between(*all, *all) : 0;
    }
    /// m/s: bound on how fast a body's particles go, as of the last travel ...
    float speed(std::size_t body) const {
        return speeds_[body].least.cwiseAbs().cwiseMax(speeds_[body].most.cwiseAbs()).norm();
    }
    /// ... and how fast along a direction of length 1.
    float speed_along(std::size_t body, const Vec3f& direction) const {
        const auto& [least, most] = speeds_[body];
        return least.cwiseProduct(direction).cwiseMax(most.cwiseProduct(direction)).sum();
    }
    /// A body's particles were moved by so much, m, beside their velocities.
    void was_moved(std::size_t body, float way);
    /// Finds which points might touch which cells, as far as what was found last does not hold any more. Sleeping
    /// bodies that something touches wake; returns whether any did. frame: s, for about so long
    /// what is found is to hold.
    bool search(std::span<BodyState> bodies, double frame, const RunContext& context);
    /// Which pairs forces are asked for, after bodies went to sleep or woke.
    void list_work(std::span<const BodyState> bodies);
    /// Calls visit(body, other) for each two different bodies that touch.
    template <class Visit>
    void each_holding(const Visit& visit) const {
        for (const Side& side : sides_)
            if (side.body != side.other &&
                std::ranges::any_of(side.pairs, [](const Pair& pair) { return pair.grasp.holds; }))
                visit(side.body, side.other);
    }
    /// s: in longer steps something could pass through something.
    double longest_step() const;

    /// How much harder parts of one body push each other than two bodies do: it took a dragon that falls on itself from
    /// 0.34 spacings deep to 0.29.
    static constexpr float kWithinOneBody = 1.5f;
    static constexpr float kDeepestWithin = 0.25f; ///< as kDeepest, of parts of one body
    static constexpr std::uint8_t kTouched = 2, kTouchedItself = 4;
    /// As Contacts::add_forces. touched: of each body; kTouched or kTouchedItself is set where it touches.
    ContactReport add_forces(std::span<BodyState> bodies, float dt, std::span<std::uint8_t> touched,
                             RigidContacts& rigid, ContactEvents& events, const RunContext& context);
    /// As Contacts::push_out.
    void push_out(std::span<BodyState> bodies, ContactEvents& events);

    /// A surface point in or near a cell of `other`.
    struct Pair {
        Index point = 0;
        Matter::Place place;
        float clear_until = 0;        ///< way of the side until which this cannot touch
        float depth = 0;              ///< now
        float approach = 0;           ///< m/s, along the normal, where it touches ...
        Vec3f normal = Vec3f::Zero(); ///< ... of the other there
        contact_law::Grasp grasp;
        Matter::Place anchor;
        Vec3f entry = Vec3f::Zero();       ///< normal at rest on the side where the point came in; zero outside
        bool tangled = false;              ///< it did not come in from outside, and is left alone until it is out
        Vec3f rigid_force = Vec3f::Zero(); ///< N, of two rigid bodies: of the last substep
    };
    struct PairMemory {
        Index point, cell, anchor_cell;
        std::uint32_t flags; ///< 1: holds, 2: slides, 4: tangled
        Vec3f local, anchor_local, entry, rigid_force;
    };
    struct SideMemory {
        Index body, other, pairs; ///< how many
        float moved, until, since;
    };
    /// All that was found and what friction remembers.
    struct Memory {
        float way = 0, until = -1;     ///< of find_sides
        std::vector<SideMemory> sides; ///< ascending by bodies
        std::vector<PairMemory> pairs; ///< of one side after the other, ascending by point
        std::vector<std::uint8_t> recovers;
    };
    Memory memory() const;
    bool is_sound(const Memory& memory, std::span<const BodyState> bodies) const;
    void set_memory(const Memory& memory, std::span<const BodyState> bodies);

    bool has_matter(std::size_t body) const { return matter_[body] != nullptr; }
    const Matter& matter(std::size_t body) const { return *matter_[body]; }
    const PairLaws& laws() const { return laws_; }

private:
    /// Points of one body against the matter of another, or of its own.
    struct Side {
        Index body, other;
        float way = 0;    ///< m, bound on how far either has gone beside the other, there and back, since way was 0
        float moved = 0;  ///< m, bound on how far either is from where it was beside the other at the last search ...
        float until = -1; ///< ... until which the pairs hold
        float since = std::numeric_limits<float>::max(); ///< s since the last search
        float speed = 0;                                 ///< m/s, the same bound's
        float spacing = 0;                               ///< m, the smaller of both
        bool is_rigid = false;                           ///< both bodies are
        PairContact law;
        std::vector<Pair> pairs;
    };
    static float most_depth(const Side& side) {
        return (side.body == side.other ? kDeepestWithin : contact_law::kDeepest) * side.spacing;
    }
    static std::uint8_t touch_of(const Side& side) { return side.body == side.other ? kTouchedItself : kTouched; }
    float relative_speed(Index a, Index b) const { return Extremes::between(speeds_[a], speeds_[b]); }
    /// m: bound on how far two bodies are from where they were beside each other at the last search.
    float moved(const Side& side) const {
        return side.moved + Extremes::between(shifts_[side.body], shifts_[side.other]);
    }
    void make_ready(const BodyState& state, std::size_t body, std::size_t like);
    void count_from_here(std::span<const BodyState> bodies);
    void find_shifts(std::span<const BodyState> bodies, const RunContext& context);
    Side make_side(Index body, Index other, std::span<const BodyState> bodies) const;
    template <class Find>
    static void take_pairs(Side& side, const BodyState& body, std::size_t points, const Find& find);
    /// m that a side may go until a point that lies so far outside might touch.
    static float safe_way(const Side& side, float distance) {
        constexpr float kClearer = 0.8f;   // part of a distance that is safe to go
        constexpr float kTouching = 0.05f; // spacings; later would be too late: the way in would cost no energy
        return distance < kTouching * side.spacing ? 0 : kClearer * distance;
    }
    class Surroundings;
    static bool both_sleep(const Side& side, std::span<const BodyState> bodies) {
        return bodies[side.body].sleeps() && bodies[side.other].sleeps();
    }
    void find_own_pairs(Side& side, const BodyState& body, float frame, const RunContext& context) const;
    static bool begin_side(Side& side, const Surroundings& around, float frame);
    void find_other_pairs(Side& side, const Surroundings& around, const BodyState& body,
                          const RunContext& context) const;
    void find_pairs(std::span<const Index> due, std::span<const BodyState> bodies, float frame,
                    const RunContext& context);
    bool wake_touched(std::span<BodyState> bodies) const;
    void find_sides(std::span<const BodyState> bodies, double frame, const RunContext& context);
    std::optional<Vec3f> enter(Pair& pair, const Side& side, std::span<const BodyState> bodies) const;
    static bool is_elsewhere(const Pair& pair, const Matter::Place& place, const Matter& matter) {
        return matter.is_elsewhere(pair.point, place,
                                   pair.entry.isZero(0) ? Matter::kElsewhere : Matter::kStillElsewhere);
    }
    static std::optional<Matter::Depth> find_fold(const Pair& pair, const Vec3f& point, const Matter& matter,
                                                  const Vectors& positions, Matter::Place& place);
    float crushed_part(const BodyState& body, const Matter& matter) const;
    void find_recovering(std::span<const BodyState> bodies);
    float clearance(const Pair& pair, const Side& side, float distance, float slowest,
                    std::span<const BodyState> bodies) const;
    void leave(Pair& pair, const Side& side, float clearance) const;
    float stiffness(const Side& side, const Pair& pair, std::span<const BodyState> bodies) const;
    void anchor_at(Pair& pair, const Side& side, const BodyState& other, const Vec3f& offset) const;
    Vec3f force(Pair& pair, const Side& side, std::span<const BodyState> bodies, float dt) const;
    /// Spacings: the most of margin_of.
    static constexpr float kMostMargin = 0.5f;
    static float margin_of(const Side& side) { ///< m, of two rigid bodies
        return std::min(touching_margin(side.spacing, side.speed), kMostMargin * side.spacing);
    }
    Vec3f probe(Pair& pair, const Side& side, std::span<const BodyState> bodies) const;
    static void add_contact_point(Pair& pair, const Side& side, std::span<const BodyState> bodies, const Vec3f& normal,
                                  RigidContacts& rigid);
    void push_out(Pair& pair, const Side& side, std::span<BodyState> bodies, ContactEvents& events) const;

    const World& world_;
    const PairLaws laws_;
    bool between_bodies_, within_bodies_;
    std::vector<std::shared_ptr<const Matter>> matter_;      ///< null: of bodies without a field
    std::vector<std::vector<float>> per_area_;               ///< N/m^3 in each cell of each body
    std::vector<std::shared_ptr<const OwnCells>> own_cells_; ///< null: of bodies that do not meet themselves
    std::vector<std::uint8_t> recovers_;                     ///< of each body: 1 while it does not meet itself
    struct Followed {              ///< the corners of a body's cells whose motion says when to search again
        std::vector<float> counts; ///< of each, as extremes_of wants them
        Index heaviest = 0;
        std::vector<Index> corners;      ///< of a rigid body, instead: those that all others lie between
        bool has_points_outside = false; ///< of the cells' box at rest; unknown of a rigid body
    };
    static Followed followed(const BodyState& body);
    Extremes extremes(std::size_t body, const Vectors& values, const Vectors* from) const;
    Box extent(const BodyState& body, std::size_t number) const;
    std::vector<std::shared_ptr<const Followed>> followed_;
    std::vector<Extremes> speeds_;
    std::vector<Vectors> places_;  ///< of the corners of each body's cells, where its shifts are counted from
    std::vector<Extremes> shifts_; ///< m
    std::vector<Side> sides_;      ///< ascending by bodies
    float way_ = 0, sides_until_ = -1;
    std::vector<std::pair<Index, Index>> work_; ///< side and pair of each force
    /// Beside how deep its pair touches, so that those that do not are passed over fast. Of two rigid bodies the
    /// normal, or zero far from each other.
    struct PairForce {
        Vec3f force = Vec3f::Zero();
        float depth = 0;
    };
    std::vector<PairForce> forces_; ///< of work_
    bool is_too_deep_ = false;      ///< something touches deeper than push_out lets it, as add_forces saw
};

} // namespace filigree
