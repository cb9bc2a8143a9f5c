// Bodies touching obstacles, each other and themselves: penalty forces at surface points with friction and restitution,
// and contact points between what does not deform. Private to the layer.
#pragma once

#include "filigree/physics/contact/colliders.h"
#include "filigree/physics/contact/contact_events.h"
#include "filigree/physics/contact/crushed_particles.h"
#include "filigree/physics/contact/motion_bounds.h"
#include "filigree/physics/contact/own_cells.h"
#include "filigree/physics/contact/pair_laws.h"
#include "filigree/physics/contact/start_sides.h"
#include "filigree/physics/rigid/rigid_contacts.h"

#include <algorithm>
#include <memory>

namespace filigree {

struct ContactReport {
    std::size_t contacts = 0;    ///< points that touch
    float deepest = 0;           ///< m, in an obstacle
    float deepest_in_matter = 0; ///< m
};

/// All contacts of a scene. A broad phase finds pairs that are near each other, a search the points of each that may
/// touch, and forces are asked of these alone; each holds until what it goes by has moved too far.
class Contacts {
public:
    /// actors: that bodies belong to.
    Contacts(const World& world, std::size_t actors, bool between_bodies, bool within_bodies);
    /// Once, when all bodies are there.
    void begin(std::span<const BodyState> bodies);

    // Between frames the world may change.
    /// A body came into a slot: one that was free, or the next. Cost O(slots), and what the body itself takes; nothing
    /// about the others is made anew but the next search.
    void add_body(std::span<const BodyState> bodies, std::size_t body);
    /// Forgets a body that is still there; its slot will be free.
    void remove_body(std::span<const BodyState> bodies, std::size_t body);
    /// An obstacle's motion was replaced. is_jump: it stands elsewhere, so that what was on its other side is where it
    /// is, and nothing holds on to it; else points are followed to where it stands.
    void set_obstacle(std::size_t obstacle, bool is_jump);
    /// Between which limbs of a body there is no contact; null: everything touches.
    void set_passing(std::size_t body, std::shared_ptr<const OwnCells::Passing> passing);
    /// m: from how far on a body's parts push each other.
    void set_own_gap(std::size_t body, float gap);
    /// Calls visit(other) for bodies that touch a body, or may soon.
    template <class Visit>
    void each_beside(std::size_t body, const Visit& visit) const {
        const ColliderId id = ColliderId::body(body);
        for (const ContactPair& pair : pairs_)
            if (pair.is_of_bodies() && !pair.is_own() && !pair.candidates.empty() &&
                (pair.points == id || pair.touched == id))
                visit((pair.points == id ? pair.touched : pair.points).number());
    }
    /// Whether a body's surface touches an obstacle, or may soon.
    bool is_beside_obstacle(std::size_t body, std::size_t obstacle) const {
        return std::ranges::any_of(pairs_, [&](const ContactPair& pair) {
            return pair.points == ColliderId::body(body) && pair.touched == ColliderId::obstacle(obstacle) &&
                   !pair.candidates.empty();
        });
    }
    /// The cells of a body as matter that points are inside of; null of bodies without a field.
    const Matter* matter(std::size_t body) const { return matter_[body]->matter.get(); }
    std::span<const ObstacleShape> shapes() const { return shapes_; }
    /// What touches in a frame.
    ContactEvents& events() { return events_; }
    const ContactEvents& events() const { return events_; }

    struct Search {
        double time;  ///< s
        double frame; ///< s: for about so long what is found is to hold
        double step;  ///< s, of the next substep, about: what may touch in it is found before
    };
    /// Finds what may touch, as far as what was found last does not hold any more. Sleeping bodies that something
    /// touches wake.
    void search(std::span<BodyState> bodies, const Search& search, const RunContext& context);
    /// Before a frame of substeps, and after it.
    void begin_frame(std::span<BodyState> bodies, const RunContext& context);
    void end_frame(std::span<const BodyState> bodies, const RunContext& context);
    /// Positions have changed by dt times velocities; from, until: s, the times before and after. Cost O(particles).
    void travel(std::span<BodyState> bodies, float dt, double from, double until, const RunContext& context);
    /// A body's particles were moved by so much, m, beside their velocities.
    void was_moved(std::size_t body, float way);
    /// A body was put elsewhere: on which side of obstacles it is has to be found anew.
    void was_placed(std::size_t body);
    /// The next search finds everything again; what touches is remembered.
    void begin_anew();
    /// s: in longer steps something could pass through something.
    double longest_step() const;
    float speed(std::size_t body) const { return motions_.speed(body); } ///< m/s, bound: of the last travel
    /// Which pairs forces are asked for, after bodies went to sleep or woke.
    void list_work(std::span<const BodyState> bodies);
    void clear_touches() { touched_.assign(touched_.size(), 0); }

    /// Adds the forces of what touches now to the bodies' forces, and lets friction's anchors slide; of rigid pairs
    /// finds contact points instead, which are there until the next search. dt: of the substep.
    ContactReport add_forces(std::span<BodyState> bodies, double time, float dt, RigidContacts& rigid,
                             const RunContext& context);
    /// Moves what is deeper than a part of the spacing out, and takes its speed inwards away: for impacts faster than
    /// the penalty can stop. Looks at what the last add_forces found.
    void push_out(std::span<BodyState> bodies, double time, const RunContext& context);

    /// Whether a body touched anything, and slid along it, as of the last add_forces.
    bool touches(std::size_t body) const { return touched_[body] != 0; }
    bool rubs(std::size_t body) const { return (touched_[body] & kRubs) != 0; }
    /// What pushes a stiff body, as of the last add_forces.
    const BodyLoad& load(std::size_t body) const { return loads_[body]; }
    /// Whether push_out may move anything.
    bool is_too_deep() const {
        return std::ranges::any_of(pairs_, [](const ContactPair& pair) { return is_too_deep(pair); });
    }
    /// Calls visit(body) for each body that friction holds on an obstacle; more than once where on several.
    template <class Visit>
    void each_on_obstacle(const Visit& visit) const {
        for (const ContactPair& pair : pairs_)
            if (pair.touched.is_obstacle() && holds(pair)) visit(pair.points.number());
    }
    /// Calls visit(body, other) for each two different bodies that friction holds together.
    template <class Visit>
    void each_holding(const Visit& visit) const {
        for (const ContactPair& pair : pairs_)
            if (pair.is_of_bodies() && !pair.is_own() && holds(pair))
                visit(pair.points.number(), pair.touched.number());
    }
    /// What the last add_forces may have added to the squared frequency of a body, in parts of that at rest. Two bodies
    /// that push each other swing by the sum of what each feels.
    double added_frequency(std::size_t body) const;

    struct CandidateMemory {
        Index point, cell, anchor_cell;
        std::uint32_t flags; ///< 1: holds, 2: slides, 4: tangled
        Vec3f local, anchor_local, entry_normal, rigid_force;
        Vec3d local_point;
    };
    struct PairMemory {
        ColliderId points, touched;
        Index candidates;         ///< how many
        std::uint32_t knows_side; ///< 1: it does
        float displacement, reach, since;
        std::uint32_t unused = 0; ///< so that nothing is padding
    };
    /// All that was found and what friction remembers.
    struct Memory {
        float travelled = 0, reach = -1;         ///< of the broad phase
        std::vector<PairMemory> pairs;           ///< ascending
        std::vector<CandidateMemory> candidates; ///< of one pair after the other, ascending by point
        std::vector<std::uint8_t> recovers;
        std::vector<ContactEvents::PairMemory> touched; ///< in the last frame
    };
    Memory memory() const;
    /// Instead of what there is. False, and nothing changed, where it is not of these bodies.
    bool set_memory(const Memory& memory, std::span<const BodyState> bodies);

private:
    struct Work { ///< a block of a pair's candidates
        Index pair, block;
        std::uint64_t touching = 0; ///< bits of those that touch
    };
    struct Ahead;
    class Surroundings;
    class Merge;

    static bool holds(const ContactPair& pair) {
        return std::ranges::any_of(pair.candidates, [](const Candidate& at) { return at.grasp.holds; });
    }
    static bool sleeps(const ContactPair& pair, std::span<const BodyState> bodies) {
        const auto is_still = [&](ColliderId id) { return id.is_obstacle() || bodies[id.number()].sleeps(); };
        return is_still(pair.points) && is_still(pair.touched);
    }
    /// Calls visit(points, touched) with the two sides of a pair.
    template <class Visit>
    void with_sides(const ContactPair& pair, std::span<BodyState> bodies, const ObstaclePoses& poses,
                    const Visit& visit) const;
    float margin_of(const ContactPair& pair) const;
    template <class Points, class Touched>
    Vec3f touch(ContactPair& pair, std::size_t k, const Points& points, const Touched& touched, float dt) const;
    template <class Points, class Touched>
    void push_out(Candidate& at, const ContactPair& pair, const Points& points, const Touched& touched);
    void tell(const ContactPair& pair, const Vec3f& place, const Vec3f& normal, float impulse, float approach,
              bool is_push);
    ContactPoint contact_point(ContactPair& pair, Candidate& at, const Vec3f& normal, std::span<BodyState> bodies,
                               const ObstaclePoses& poses) const;
    static bool is_too_deep(const ContactPair& pair) { return !pair.is_rigid && pair.deepest > first_depth(pair); }
    /// m: what is deeper is looked at by push_out.
    static float first_depth(const ContactPair& pair) {
        return pair.touched.is_obstacle() ? CrushedParticles::kCrushing * pair.spacing : pair.most_depth();
    }
    void note_touch(const ContactPair& pair, const Candidate& at, ContactReport& report);
    template <class Points, class Touched>
    void add_loads(const ContactPair& pair, const Candidate& at, const Vec3f& force, const Points& points,
                   const Touched& touched, std::span<const BodyState> bodies);

    Vec3f way_towards(std::size_t obstacle) const;
    void make_ready(const BodyState& state, std::size_t body, std::size_t like);
    ContactPair make_pair(ColliderId points, ColliderId touched, std::span<const BodyState> bodies) const;
    Box extent(const BodyState& body, std::size_t number) const;
    float bound_between(const ContactPair& pair, const Extremes& points, const Extremes& touched) const;
    float speed_of(const ContactPair& pair) const;
    float displacement_of(const ContactPair& pair) const;
    float relative_speed_of_all(std::span<const BodyState> bodies) const;
    void count_from_here(std::span<const BodyState> bodies);
    void find_pairs(std::span<const BodyState> bodies, float least_reach, const Ahead& ahead,
                    const ObstaclePoses& poses, const RunContext& context);
    void find_candidates(std::span<const Index> due, std::span<const BodyState> bodies, const Ahead& ahead,
                         const ObstaclePoses& poses, const RunContext& context);
    bool begin_pair(ContactPair& pair, const Surroundings& around, const Ahead& ahead,
                    const ObstaclePoses& poses) const;
    static void merge_in_matter(Merge& merge, const ContactPair& pair, const BodyState& body, Index point,
                                const CellBoxes::Near& found);
    void find_own(ContactPair& pair, const BodyState& body, float frame, const RunContext& context) const;
    void find_in_matter(ContactPair& pair, const Surroundings& around, const RunContext& context) const;
    void find_at_edges(ContactPair& pair, const Surroundings& around, const ObstaclePoses& poses) const;
    void find_below(ContactPair& pair, const Surroundings& around, const ObstaclePoses& poses,
                    const RunContext& context) const;
    void find_traced(ContactPair& pair, const Surroundings& around, const ObstaclePoses& poses,
                     const RunContext& context) const;
    bool wake_touched(std::span<BodyState> bodies) const;
    void forget_jumps(double time);
    void find_recovering(std::span<const BodyState> bodies);
    bool is_sound(const Memory& memory, std::span<const BodyState> bodies) const;

    const World& world_;
    const PairLaws laws_;
    bool between_bodies_, within_bodies_;
    std::vector<ObstacleShape> shapes_;
    std::vector<Vec3f> towards_; ///< of each obstacle, the way to it: of half-spaces that stand still; else 0
    std::vector<std::shared_ptr<const BodyMatter>> matter_;         ///< of each body
    std::vector<std::shared_ptr<const OwnCells>> own_cells_;        ///< null: of bodies that do not meet themselves
    std::vector<std::shared_ptr<const OwnCells::Passing>> passing_; ///< of bodies; null: everything touches
    std::vector<float> own_gaps_;                                   ///< of bodies, m
    std::vector<std::uint8_t> recovers_;                            ///< of each body: 1 while it does not meet itself
    MotionBounds motions_;
    CrushedParticles crushed_;

    std::vector<ContactPair> pairs_;   ///< ascending by points and touched
    float travelled_ = 0, reach_ = -1; ///< m: the broad phase's clock, as a pair's
    std::optional<double> time_;       ///< s, of the last search
    std::vector<Work> work_;
    std::vector<Vec3f> forces_; ///< of each candidate of work_: N, or of a rigid pair the normal
    static constexpr std::uint8_t kOnObstacle = 1, kInMatter = 2, kInItself = 4, kRubs = 8;
    std::vector<std::uint8_t> touched_; ///< of each body
    std::vector<BodyLoad> loads_;       ///< of each body, if it is stiff
    ContactEvents events_;
};

} // namespace filigree
