// Contact points between rigid bodies. Private to the layer.
#pragma once

#include "filigree/physics/contact/pair_laws.h"
#include "filigree/physics/rigid/contact_manifold.h"
#include "filigree/physics/rigid/rigid_contacts.h"
#include "filigree/physics/rigid/rigid_shape.h"

#include <map>
#include <memory>

namespace filigree {

/// Surface points of each rigid body in the distance field of each other one near it; of each pair of bodies a manifold
/// of few points is solved. Points are found anew when two bodies have moved a little beside each other; until then the
/// tangent planes where they were found are.
class RigidPairs {
public:
    RigidPairs(const World& world, std::size_t actors, bool between_bodies)
        : gravity_(float(world.gravity.norm())), laws_(world, actors), between_bodies_(between_bodies) {}

    void set_gravity(const Vec3d& gravity) { gravity_ = float(gravity.norm()); }

    /// Which bodies may touch within the next `longest` seconds. What sleeps wakes where something awake pushes it;
    /// returns whether anything did.
    bool search(std::span<BodyState> bodies, double longest, const RunContext& context);
    /// s, up to `longest` of the last search: in longer steps something could pass through something.
    double longest_step() const { return step_; }

    /// Points are found anew: what surface points there are has changed.
    void begin_anew() {
        for (Pair& pair : pairs_) pair.looked = -1;
    }
    /// Forgets a body that is still there; its slot will be free.
    void remove_body(std::span<const BodyState> bodies, std::size_t body);
    /// Calls visit(other) for rigid bodies that touch a body, or may soon.
    template <class Visit>
    void each_beside(std::size_t body, const Visit& visit) const {
        for (const Pair& pair : pairs_)
            if (!pair.points.empty() && (pair.body == body || pair.other == body))
                visit(pair.body == body ? pair.other : pair.body);
    }

    struct Report {
        std::size_t contacts = 0; ///< points in matter
        float deepest = 0;        ///< m
    };
    /// Adds the contact points of what the last search found, for a substep of up to longest_step(). Bodies are where
    /// they were then. The points refer to this until the next call.
    Report add_points(std::span<const BodyState> bodies, RigidContacts& contacts, const RunContext& context);

    /// Calls visit(body, other) for each two bodies that push each other.
    template <class Visit>
    void each_holding(const Visit& visit) const {
        for (const Pair& pair : pairs_)
            if (holds(pair)) visit(pair.body, pair.other);
    }

    struct Point {                    ///< a surface point of one of the two, saved as it is
        Index number;                 ///< twice the surface point's, and 1 more if it is the second body's
        std::uint32_t is_kept = 0;    ///< 1: it is of the manifold
        float separation = 0;         ///< m, when it was found
        Vec3f at = Vec3f::Zero();     ///< the same: in the other's axes at rest, and ...
        Vec3f normal = Vec3f::Zero(); ///< ... the surface's normal there
        Vec3f entry = Vec3f::Zero();  ///< the same where the point came in; zero outside
        Vec3f force = Vec3f::Zero();  ///< N, on the first body: of the last substep
    };
    struct PairMemory { ///< saved as it is
        Index body, other;
        Index points = 0;                  ///< how many
        float looked = -1;                 ///< m: points up to so far outside were found; below 0 none were looked for
        std::array<float, 12> beside = {}; ///< how the two lay beside each other then
    };
    struct Memory {
        std::vector<PairMemory> pairs; ///< ascending by bodies
        std::vector<Point> points;     ///< of one pair after the other
    };
    Memory memory() const;
    /// Instead of what there is. False, and nothing changed, where it is not of these bodies.
    bool set_memory(const Memory& memory, std::span<const BodyState> bodies);

private:
    struct Pair : PairMemory {       ///< of bodies, the first with the lower number
        float speed = 0, margin = 0; ///< m/s, of anything of the two beside each other; m, at which points count
        bool is_apart = false;       ///< nothing of the two is so near
        std::vector<Point> points;
        std::vector<float> separations; ///< m, of the points now
    };
    struct Placed { ///< a body as it is now
        Mat3f turn;
        Vec3d exact_centre;
        Vec3f centre, rest_centre; ///< of mass, m
        Vec3f velocity, spin;
        Vec3f box_centre;
        Mat3f half_axes;   ///< of the box about its own axes
        float turning = 0; ///< m/s, of what is the furthest from the centre
    };
    class AxesMap;
    struct Candidates { ///< of a pair
        std::vector<ManifoldPoint> points;
        std::vector<Point> memory; ///< of each
        bool is_passing = false;   ///< points were left out that pass by
    };
    static bool holds(const Pair& pair) {
        return std::ranges::any_of(pair.points, [](const Point& point) { return !point.force.isZero(0); });
    }
    static bool meets(const BodyState& body) { return body.rigid && !body.is_absent; }
    void find_shapes(std::span<const BodyState> bodies);
    void place(std::span<const BodyState> bodies, const RunContext& context);
    std::vector<std::uint64_t> near_bodies(std::span<const BodyState> bodies, float longest) const;
    static float spacing_of(std::span<const BodyState> bodies, const Pair& pair) { ///< m, the smaller
        return float(std::min(bodies[pair.body].body->spacing(), bodies[pair.other].body->spacing()));
    }
    float gap(Index body, Index other) const;
    void find_margins(std::span<const BodyState> bodies);
    bool meets_on_its_way(const RigidShape& shape, const Vec3f& at, const Vec3f& velocity,
                          DistanceField::Sample& surface) const;
    AxesMap to_axes(Index body, Index other) const;
    float moved(const Pair& pair, const AxesMap& map) const;
    void add_near_points(const Pair& pair, bool of_other, const AxesMap& map, std::span<const BodyState> bodies,
                         Candidates& found) const;
    void flatten(const Pair& pair, float spacing, Candidates& found) const;
    void find_points(Pair& pair, std::span<const BodyState> bodies, Candidates& found) const;
    void follow_points(Pair& pair, const AxesMap& map, const AxesMap& back) const;
    Vec3f world_place(const Pair& pair, const Point& point) const;
    Vec3f world_normal(const Pair& pair, const Point& point) const;

    float gravity_; ///< m/s^2
    const PairLaws laws_;
    const bool between_bodies_;
    std::map<const Body*, std::shared_ptr<const RigidShape>> known_shapes_;
    std::vector<std::shared_ptr<const RigidShape>> shapes_; ///< of each body; null: it is not rigid
    std::vector<Placed> placed_;                            ///< of each body
    std::vector<Pair> pairs_;                               ///< ascending by bodies
    std::vector<Candidates> found_;                         ///< of each pair, in the last add_points
    double step_ = 0;
};

} // namespace filigree
