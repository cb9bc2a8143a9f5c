// Bodies touching obstacles and each other: penalty forces at surface points, with friction and
// restitution. Private to the layer.
#pragma once

#include "filigree/physics/body/body_state.h"
#include "filigree/physics/contact/feature_contacts.h"
#include "filigree/physics/contact/matter_contact.h"
#include "filigree/physics/contact/obstacle_motion.h"
#include "filigree/physics/contact/start_sides.h"

#include <algorithm>
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
        float step_way = 0;   ///< m that anything may go towards an obstacle in the next step; it is found before
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
    /// A body was put elsewhere: on which side of obstacles it is has to be found anew.
    void was_placed(std::size_t body) {
        for (std::size_t o = 0; o < shapes_.size(); ++o) seen_[body * shapes_.size() + o] = 0;
    }
    /// Whether points are followed, as of all obstacles but half-spaces.
    bool follows_points() const { return std::ranges::any_of(shapes_, &ObstacleShape::is_traced); }
    /// Whether a body is near an obstacle whose surface is followed, and whose edges push.
    bool is_near_traced(std::size_t body) const { return !near_[body].traces.empty() || features_.is_near(body); }
    /// s: in longer steps something could pass through something.
    double longest_step() const { return matter_.longest_step(); }
    /// The next search finds everything again, and ways are counted from here; anchors and touches stay.
    void begin_anew() {
        near_until_ = -1;
        matter_.begin_anew();
    }
    /// m/s: bound on how fast a body's particles go, as of the last travel or begin_frame.
    float speed(std::size_t body) const { return matter_.speed(body); }
    /// Bodies woke that something is about to push.
    void woke(std::span<const BodyState> bodies) {
        near_until_ = -1;
        matter_.list_work(bodies);
    }
    /// The next search finds what is near obstacles: of what sleeps nothing was found.
    void look_near_again() { near_until_ = -1; }
    void clear_touches() {
        touched_.assign(touched_.size(), 0);
        deepest_near_.assign(deepest_near_.size(), 0);
    }

    /// Adds the forces of what touches now to the bodies' forces, and lets friction's anchors slide; between rigid
    /// bodies and obstacles finds contact points instead, which are there until the next search. dt: of the
    /// substep.
    ContactReport add_forces(std::span<BodyState> bodies, double time, float dt, RigidContacts& rigid,
                             const RunContext& context);

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
        std::uint32_t flags; ///< 1: holds, 2: slides, 4: it is on the other side of the wall that it touches
        float clear_until;
        Vec3f anchor, rigid_force;
        std::uint32_t unused = 0; ///< so that nothing is padding
        Vec3d place;              ///< Trace::place
    };
    /// All that contacts remember.
    struct Memory {
        std::vector<NearMemory> near; ///< ascending by body, obstacle and point
        float near_way = 0, near_until = -1;
        std::vector<std::uint8_t> seen; ///< of each body and obstacle: 1 once sides are known
        std::vector<FeatureContacts::Near> features;
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
        Vec3f rigid_force = Vec3f::Zero(); ///< N, on a rigid body: of the last substep
        Index trace = kNoIndex;            ///< of the body's traces; none of a half-space
    };
    struct NearPoints { ///< of a body
        static constexpr std::size_t kBlock = 64;
        std::vector<Near> points; ///< ascending by obstacle and point
        /// Of each, near_way_ until which it cannot touch; padded to whole blocks. Beside the points, as most are asked
        /// nothing more. What cannot touch has no depth and holds nothing.
        std::vector<float> clear_until;
        std::vector<Trace> traces;

        std::size_t blocks() const { return (points.size() + kBlock - 1) / kBlock; }
        void pad() { clear_until.resize(blocks() * kBlock, 0); }
    };
    ContactReport add_obstacle_forces(BodyState& body, std::size_t b, const ObstaclePoses& poses, float dt,
                                      std::vector<Vec3f>& forces, std::vector<ContactPoint>& rigid,
                                      const RunContext& context);
    Vec3f probe_rigid(Near& at, float& clear_until, const DistanceField::Sample& surface, float margin) const;
    ContactPoint contact_point(Near& at, const Vec3f& normal, Index b, const BodyState& body,
                               const ObstaclePoses& poses) const;
    Vec3f obstacle_force(Near& at, Trace* trace, float& clear_until, const BodyState& body, const ObstaclePoses& poses,
                         float dt, float margin) const;
    DistanceField::Sample follow(std::size_t obstacle, Trace& trace, bool touched, const Vec3f& place,
                                 const ObstaclePoses& poses) const;
    DistanceField::Sample surface_at(const Near& at, const NearPoints& of, const Vec3f& place,
                                     const ObstaclePoses& poses) const;
    void push_particles_out(BodyState& body, std::size_t b, std::size_t obstacle, const Vec3f& outwards,
                            const ObstaclePoses& poses, const RunContext& context);
    void find_near(std::span<const BodyState> bodies, double time, float reach, const RunContext& context);
    class NearFinder;
    void forget_jumps(double time);
    std::vector<DistanceField::Sample> depths_of_particles(const BodyState& body, std::size_t b, std::size_t obstacle,
                                                           const ObstaclePoses& poses, const RunContext& context);

    const World& world_;
    std::vector<Vec3f> towards_;         ///< of each obstacle, the way to it: of half-spaces that stand still; else 0
    std::vector<NearPoints> near_;       ///< by body
    std::vector<float> deepest_near_;    ///< m, of each body, now
    struct ParticleDepths {              ///< of a body that was crushed, of each particle
        std::vector<float> most;         ///< m that it may go into an obstacle
        std::vector<Index> near_surface; ///< the surface point that is about the closest at rest
    };
    std::map<const Body*, ParticleDepths> particle_depths_;
    std::vector<ObstacleShape> shapes_;
    std::vector<std::uint8_t> seen_; ///< of each body and obstacle
    std::optional<double> time_;     ///< s, of the last search
    float near_way_ = 0;             ///< m that anything may have come nearer to obstacles since ...
    float near_until_ = -1;          ///< ... and may go before they hold no more
    static constexpr std::uint8_t kOnObstacle = 1, kInMatter = MatterContacts::kTouched,
                                  kInItself = MatterContacts::kTouchedItself;
    std::vector<std::uint8_t> touched_; ///< of each body
    MatterContacts matter_;
    FeatureContacts features_;
};

} // namespace filigree
