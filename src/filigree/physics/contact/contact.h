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
    /// points near obstacles and near cells of other bodies or far parts of their own, and pairs of balls of meshfree
    /// bodies or of far parts of one.
    struct Search {
        double time;          ///< s
        float obstacle_reach; ///< m
        float pair_reach;     ///< m, beside each other
        double frame;         ///< s: for about so long what is found is to hold
    };
    void search(std::span<BodyState> bodies, const Search& search, const RunContext& context);
    /// Before a frame of explicit steps.
    void begin_frame(std::span<const BodyState> bodies, const RunContext& context) {
        pairs_until_ = -1;
        matter_.begin_frame(bodies, context);
    }
    /// After a frame of explicit steps.
    void end_frame(std::span<const BodyState> bodies, const RunContext& context) { matter_.end_frame(bodies, context); }
    /// Positions have changed by dt times velocities. obstacle_way: m, bound on how far obstacles have gone.
    void travel(std::span<const BodyState> bodies, float dt, float obstacle_way, const RunContext& context);
    /// m/s: bound on how fast particles go towards any obstacle, as of the last travel or begin_frame; but for light
    /// corners, which hardly move the surface.
    float approach_speed(std::span<const BodyState> bodies) const;
    /// A body's particles were moved by so much, m, beside their velocities.
    void was_moved(std::size_t body, float way) {
        near_way_ += way;
        pairs_way_ += 2 * way;
        matter_.was_moved(body, way);
    }
    /// s: in longer steps something could pass through something.
    double longest_step() const { return matter_.longest_step(); }
    /// The next search finds everything again, and ways are counted from here; anchors and touches stay.
    void begin_anew() {
        near_until_ = pairs_until_ = -1;
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
    /// the penalty can stop. Looks at what the last add_forces found.
    void push_out(std::span<BodyState> bodies, double time, const RunContext& context);

    /// Whether friction holds a body's surface on an obstacle.
    bool is_on_obstacle(std::size_t body) const {
        return std::ranges::any_of(near_[body].points, [](const Near& at) { return at.grasp.holds; });
    }
    /// Calls visit(body, other) for each two different bodies that friction holds together.
    template <class Visit>
    void each_holding(const Visit& visit) const {
        matter_.each_holding(visit);
        for (const NearPair& pair : pairs_)
            if (pair.grasp.holds && pair.first_body != pair.second_body) visit(pair.first_body, pair.second_body);
    }

    /// What the last add_forces may have added to the squared frequency of a body, in parts of that at rest. Two bodies
    /// that push each other swing by the sum of what each feels.
    double added_frequency(std::size_t body) const {
        const std::uint8_t touched = touched_[body];
        const double in_matter = touched & kInItself   ? double(MatterContacts::kWithinOneBody)
                                 : touched & kInMatter ? 1.0
                                                       : 0.0;
        return double(kContactShare) * ((touched & kOnObstacle ? 1.0 : 0.0) + 2 * in_matter);
    }

    /// A surface point near an obstacle, and where friction holds it in the obstacle's own axes.
    struct NearMemory {
        Index body, obstacle, point;
        std::uint32_t flags; ///< 1: holds, 2: slides
        float clear_until;
        Vec3f anchor;
    };
    /// Two balls that friction holds together.
    struct BallMemory {
        Index first_body, first, second_body, second;
        std::uint32_t slides;
        Vec3f offset;
    };
    /// All that contacts remember.
    struct Memory {
        std::vector<NearMemory> near; ///< ascending by body, obstacle and point
        float near_way = 0, near_until = -1;
        std::vector<BallMemory> balls; ///< ascending
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
    /// Two balls near each other, of different bodies or of far parts of one.
    struct NearPair {
        Index first_body, first, second_body, second;
        float clear_until; ///< pairs_way_ until which these cannot touch
        PairContact law;
        contact_law::Grasp grasp = {};
        Vec3f offset = Vec3f::Zero(); ///< m, along both: how far the first has slid from where it landed

        std::array<Index, 4> key() const { return {first_body, first, second_body, second}; }
    };
    /// On the first of a pair. Friction acts between the surface points over the balls, which lie by each other where
    /// these touch, so that it hardly turns what it holds.
    struct PairForce {
        Vec3f push = Vec3f::Zero(), friction = Vec3f::Zero();
    };
    ContactReport add_obstacle_forces(BodyState& body, std::size_t b, const ObstaclePoses& poses, float dt,
                                      std::vector<Vec3f>& forces, const RunContext& context);
    Vec3f obstacle_force(Near& at, float& clear_until, const BodyState& body, const ObstaclePoses& poses,
                         float dt) const;
    PairForce pair_force(NearPair& pair, std::span<const BodyState> bodies, float dt) const;
    /// From the second's point to the first's, balls or surface points over them; of positions, or of velocities.
    static Vec3f between(const NearPair& pair, std::span<const BodyState> bodies, Embedding BodyState::*points,
                         const Vectors& of_first, const Vectors& of_second);
    std::vector<NearPair> held_pairs() const; ///< those that friction holds, ascending
    void push_particles_out(BodyState& body, std::size_t obstacle, const Vec3f& outwards, const ObstaclePoses& poses,
                            const RunContext& context);
    void find_near(std::span<const BodyState> bodies, double time, float reach, const RunContext& context);
    void find_pairs(std::span<const BodyState> bodies, float reach, const RunContext& context);
    void find_own_pairs(const BodyState& body, Index number, const Vectors& balls, float reach);

    const World& world_;
    bool between_bodies_, within_bodies_;
    std::vector<Vec3f> towards_;      ///< of each obstacle, the way to it: of half-spaces that stand still; else 0
    std::vector<NearPoints> near_;    ///< by body
    std::vector<float> deepest_near_; ///< m, of each body, now
    std::map<const Body*, std::vector<float>> most_depths_; ///< of bodies that were crushed: m, of each particle
    std::vector<NearPair> pairs_;
    struct OwnBalls;                                         ///< of a body whose balls meet each other
    std::vector<std::shared_ptr<const OwnBalls>> own_balls_; ///< null: of the others
    float near_way_ = 0;                       ///< m that anything may have come nearer to obstacles since ...
    float pairs_way_ = 0;                      ///< ... and balls beside each other ...
    float near_until_ = -1, pairs_until_ = -1; ///< ... and may go before they hold no more
    static constexpr std::uint8_t kOnObstacle = 1, kInMatter = MatterContacts::kTouched,
                                  kInItself = MatterContacts::kTouchedItself;
    std::vector<std::uint8_t> touched_; ///< of each body
    MatterContacts matter_;
};

} // namespace filigree
