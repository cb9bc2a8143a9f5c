// Bodies touching obstacles and each other: penalty forces at surface points, with friction and
// restitution. Private to the layer.
#pragma once

#include "filigree/core/disjoint_sets.h"
#include "filigree/mesh/incidence.h"
#include "filigree/physics/body/body_state.h"
#include "filigree/physics/contact/matter_contact.h"
#include "filigree/physics/contact/obstacle_motion.h"

#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <memory>

namespace filigree {

/// All contacts of a scene. Finding what is near is separate from forces, and rare.
class Contacts {
public:
    /// bodies: fixed in number from here on.
    Contacts(const World& world, std::size_t bodies, std::size_t actors, bool between_bodies, bool within_bodies);
    /// Once, when all bodies are there.
    void begin(std::span<const BodyState> bodies);

    /// Finds what might touch before anything has moved by the reaches, unless what was found last still holds: surface
    /// points near obstacles and near cells of other bodies or far parts of their own.
    struct Search {
        double time;          ///< s
        float obstacle_reach; ///< m
        double frame;         ///< s: for about so long what is found is to hold
    };
    void search(std::span<BodyState> bodies, const Search& search, const RunContext& context);
    /// Before a frame of explicit steps.
    void begin_frame(std::span<BodyState> bodies, const RunContext& context) {
        place_corners(bodies, context);
        matter_.begin_frame(bodies, context);
    }
    /// After a frame of explicit steps.
    void end_frame(std::span<const BodyState> bodies, const RunContext& context) { matter_.end_frame(bodies, context); }
    /// Positions have changed by dt times velocities. obstacle_way: m, bound on how far obstacles have gone.
    void travel(std::span<BodyState> bodies, float dt, float obstacle_way, const RunContext& context);
    /// m/s: bound on how fast particles go towards any obstacle, as of the last travel or begin_frame; but for light
    /// corners, which hardly move the surface.
    float approach_speed(std::span<const BodyState> bodies) const;
    /// A body's particles were moved by so much, m, beside their velocities.
    void was_moved(std::size_t body, float way) {
        near_way_ += way;
        matter_.was_moved(body, way);
    }
    /// s: in longer steps something could pass through something.
    double longest_step() const { return matter_.longest_step(); }
    /// The same before anything is searched for, of all that is found anew: before a substep of descent.
    double longest_step_from(std::span<const BodyState> bodies, double left, const RunContext& context) {
        near_until_ = -1;
        matter_.find_approaching(bodies, left, context);
        return matter_.longest_step();
    }
    /// The next search finds everything again, and ways are counted from here; anchors and touches stay.
    void begin_anew() {
        near_until_ = -1;
        matter_.begin_anew();
    }
    /// The next search finds what is near obstacles: of what sleeps nothing was found.
    void look_near_again() { near_until_ = -1; }
    void clear_touches() {
        touched_.assign(touched_.size(), 0);
        deepest_near_.assign(deepest_near_.size(), 0);
    }

    /// Adds the forces of what touches now to the bodies' forces, and lets friction's anchors slide. dt: of the
    /// substep.
    ContactReport add_forces(std::span<BodyState> bodies, double time, float dt, const RunContext& context);

    /// Moves what is deeper than a part of the spacing out, and takes its speed inwards away: for impacts faster than
    /// the penalty can stop. Looks at what the last add_forces or update_anchors found.
    void push_out(std::span<BodyState> bodies, double time, const RunContext& context);

    /// Whether friction holds a body's surface on an obstacle.
    bool is_on_obstacle(std::size_t body) const {
        return std::ranges::any_of(near_[body].points, [](const Near& at) { return at.grasp.holds; });
    }
    /// Calls visit(body, other) for each two different bodies that friction holds together.
    template <class Visit>
    void each_holding(const Visit& visit) const {
        matter_.each_holding(visit);
    }

    /// What bodies meet in a substep of descent, worked out once for all of them.
    struct Meetings {
        ObstaclePoses poses; ///< where the substep ends
        std::vector<MatterContacts::Frame> frames;
        /// Of each body, ascending: twice the number of a frame, and 1 for its second body.
        IndexLists frames_of;
    };
    /// Searches; search.time, dt: of the substep's end, and its length. Sleepers that something is about to touch wake.
    Meetings meetings(std::span<BodyState> bodies, const Search& search, float dt, const RunContext& context);

    /// Contacts of one body as blocks for vertex block descent. Valid as long as the meetings, and until the next
    /// search.
    class Blocks final : public BlockTerms {
    public:
        /// Before every sweep: takes the points' places. During the sweep add sees each move by the asking particle
        /// alone, so that nothing depends on which thread moves the others when.
        /// swept: what `add` will be asked with; it moves `scale` times as far as the particles' positions.
        void update_places(std::span<const BodyState> bodies, const Vectors& swept, float scale);
        void add(Index particle, const Vectors& positions, Vec3f& force, Symmetric3& block) const override;
        /// A further spring that pulls points of an embedding: a hand.
        void add_pull(const Embedding& points, std::size_t point, const Vec3f& target, float stiffness);
        std::span<const std::uint8_t> touched() const { return touched_; }
        bool
        holds() const; ///< whether friction holds something of the body, so that it touched when the substep begins

    private:
        friend class Contacts;
        struct Entry {
            const Embedding* embedding = nullptr; ///< the point that touches
            Index point = 0;
            float stiffness = 0;
            const Obstacle* obstacle = nullptr;
            const Eigen::Isometry3d* motion = nullptr; ///< of the obstacle
            bool anchored = false;
            Vec3f anchor = Vec3f::Zero(); ///< world
            float friction = 0, unloading = 1;
            const MatterContacts::Frame* frame = nullptr; ///< or a point and the matter around it; `place` is its way
            Vec3f target = Vec3f::Zero();                 ///< of a pull: in the world
            Vec3f place = Vec3f::Zero();                  ///< of the point, by update_places
        };
        template <class Visit>
        void each_weight(const Entry& entry, const Visit& visit) const;
        void link(std::size_t particles);
        std::size_t body_ = 0;
        const MatterContacts* matter_ = nullptr;
        std::vector<Entry> entries_;
        Vectors start_; ///< what is swept, at the last update_places
        float scale_ = 1;
        std::vector<std::uint8_t> touched_;
        std::vector<Index> offsets_, entry_of_; ///< entries of each particle
        std::vector<float> weight_of_;
    };
    /// `pulls` adds hands before the particles are linked. Cost O(the body's contacts and particles).
    Blocks blocks(std::span<const BodyState> bodies, std::size_t body, const Meetings& met, float dt,
                  const std::function<void(Blocks&)>& pulls) const;
    /// After a descent substep: anchors begin, slide and end as positions say.
    /// start: each body's positions before the substep.
    ContactReport update_anchors(std::span<const BodyState> bodies, std::span<const Vectors> start, double time);

    /// What the last add_forces may have added to the squared frequency of a body, in parts of that at rest. Two bodies
    /// that push each other swing by the sum of what each feels.
    double added_frequency(std::size_t body) const {
        const std::uint8_t touched = touched_[body];
        const double in_matter = touched & kInItself   ? double(MatterContacts::kWithinOneBody)
                                 : touched & kInMatter ? 1.0
                                                       : 0.0;
        return double(kContactShare) * ((touched & kOnObstacle ? 1.0 : 0.0) + 2 * in_matter);
    }
    /// Joins bodies that touch each other: a group that touches nothing else keeps its momentum. is_held: 1 is set of
    /// those that touch an obstacle.
    void join_touching(DisjointSets& groups, std::span<std::uint8_t> is_held) const;

    /// A surface point near an obstacle, and where friction holds it in the obstacle's own axes.
    struct NearMemory {
        Index body, obstacle, point;
        std::uint32_t flags; ///< 1: holds, 2: slides
        float clear_until;
        Vec3f anchor;
    };
    /// All that contacts remember.
    struct Memory {
        std::vector<NearMemory> near; ///< ascending by body, obstacle and point
        float near_way = 0, near_until = -1;
        MatterContacts::Memory matter;
    };
    Memory memory() const;
    /// Instead of what there is. False, and nothing changed, where it is not of these bodies.
    bool set_memory(const Memory& memory, std::span<const BodyState> bodies);

private:
    /// A surface point near an obstacle.
    struct Near {
        Index obstacle, point;
        float depth = 0; ///< m, now
        contact_law::Grasp grasp;
        Vec3f anchor = Vec3f::Zero();
    };
    struct NearPoints { ///< of a body
        static constexpr std::size_t kBlock = 64;
        std::vector<Near> points; ///< ascending by obstacle and point
        /// Of each, near_way_ until which it cannot touch; padded to whole blocks. Beside the points, as most are asked
        /// nothing more. What cannot touch has no depth and holds nothing.
        std::vector<float> clear_until;

        std::size_t blocks() const { return (points.size() + kBlock - 1) / kBlock; }
        void pad() { clear_until.resize(blocks() * kBlock, 0); }
    };
    Blocks::Entry block_of(const Near& at, const BodyState& body, const ObstaclePoses& poses, float dt) const;
    ContactReport add_obstacle_forces(BodyState& body, std::size_t b, const ObstaclePoses& poses, float dt,
                                      std::vector<Vec3f>& forces, const RunContext& context);
    Vec3f obstacle_force(Near& at, float& clear_until, const BodyState& body, const ObstaclePoses& poses,
                         float dt) const;
    void push_particles_out(BodyState& body, std::size_t obstacle, const Vec3f& outwards, const ObstaclePoses& poses,
                            const RunContext& context);
    void find_near(std::span<const BodyState> bodies, double time, float reach, const RunContext& context);

    const World& world_;
    std::vector<Vec3f> towards_;      ///< of each obstacle, the way to it: of half-spaces that stand still; else 0
    std::vector<NearPoints> near_;    ///< by body
    std::vector<float> deepest_near_; ///< m, of each body, now
    std::map<const Body*, std::vector<float>> most_depths_; ///< of bodies that were crushed: m, of each particle
    float near_way_ = 0;    ///< m that anything may have come nearer to obstacles since ...
    float near_until_ = -1; ///< ... and may go before they hold no more
    static constexpr std::uint8_t kOnObstacle = 1, kInMatter = MatterContacts::kTouched,
                                  kInItself = MatterContacts::kTouchedItself;
    std::vector<std::uint8_t> touched_; ///< of each body
    MatterContacts matter_;
};

} // namespace filigree
