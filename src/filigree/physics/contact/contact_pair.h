// Pairs that the broad phase finds, and the points of each that may touch. Private to the layer.
#pragma once

#include "filigree/physics/contact/contact_law.h"
#include "filigree/physics/contact/matter.h"

#include <compare>
#include <limits>

namespace filigree {

/// A body or an obstacle, by its number. All bodies come before all obstacles.
struct ColliderId {
    Index code = kNoIndex;

    static constexpr Index kObstacleBit = 0x80000000u;
    static ColliderId body(std::size_t number) { return {Index(number)}; }
    static ColliderId obstacle(std::size_t number) { return {Index(number) | kObstacleBit}; }
    bool is_obstacle() const { return (code & kObstacleBit) != 0; }
    Index number() const { return code & ~kObstacleBit; }
    auto operator<=>(const ColliderId&) const = default;
};

/// A point near what it may touch: a contact point, or one that may become it.
struct Candidate {
    Index point = 0;             ///< number of a body's surface point, or of a point on an obstacle's edges
    Matter::Place place;         ///< in matter: where it was found last
    float depth = 0;             ///< m, now; of rigid pairs below 0 where it is outside, but near
    Vec3f normal{0, 0, 0};       ///< unit, in the world, out of what it touches
    float approach = 0;          ///< m/s that it comes nearer
    contact_law::Grasp grasp;    ///< how friction holds it ...
    Matter::Place anchor;        ///< ... to this place; of an obstacle `local` is in its own axes, m
    Vec3f entry_normal{0, 0, 0}; ///< unit, at rest or in the obstacle's axes: where it came in; zero outside
    bool is_tangled = false;     ///< it did not come in from outside, and is left alone until it is out
    Vec3f rigid_force{0, 0, 0};  ///< N, of rigid pairs: of the last substep
    /// In an obstacle's axes. Of a body's point: on the side that it came from, the place to which it was followed. Of
    /// a point on an edge: where it is.
    Vec3d local_point{0, 0, 0};
};

/// Points of a body or of an obstacle's edges, beside another body, an obstacle, or the same body.
struct ContactPair {
    ColliderId points, touched;
    PairContact law;
    float spacing = 0;       ///< m, the smaller of both
    float stiffness = 1;     ///< of the contact, as a part of what the surfaces have
    float slack = 0;         ///< m that points may lie inside and touch nothing; below 0: outside and touch
    bool is_rigid = false;   ///< nothing in it deforms: it is solved by impulses
    bool is_traced = false;  ///< points are followed beside an obstacle ...
    bool knows_side = false; ///< ... and it is known on which side of it the body began

    // The clock: bounds on the motion of one side beside the other.
    float speed = 0;                                 ///< m/s
    float travelled = 0;                             ///< m, length of the path since it was 0
    float displacement = 0;                          ///< m, from where they were at the last search
    float reach = -1;                                ///< m of displacement, as far as the candidates hold
    float since = std::numeric_limits<float>::max(); ///< s since the last search

    static constexpr std::size_t kBlock = 64;
    std::vector<Candidate> candidates; ///< ascending by point
    /// Of each, the travelled length until which it cannot touch; padded to whole blocks. Beside the candidates, as
    /// most are asked nothing more. What cannot touch has no depth and holds nothing.
    std::vector<float> clear_until;
    float deepest = 0; ///< m, of the last forces

    bool is_own() const { return points == touched; }
    bool is_of_bodies() const { return !points.is_obstacle() && !touched.is_obstacle(); }
    bool is_of_edges() const { return points.is_obstacle(); }
    /// Of a pair of a body and an obstacle: their numbers.
    Index body() const { return is_of_edges() ? touched.number() : points.number(); }
    Index obstacle() const { return is_of_edges() ? points.number() : touched.number(); }
    std::size_t blocks() const { return (candidates.size() + kBlock - 1) / kBlock; }
    void pad() { clear_until.resize(blocks() * kBlock, 0); }
    void clear() {
        candidates.clear();
        clear_until.clear();
        travelled = displacement = 0;
    }
    /// m: deeper points are moved out.
    float most_depth() const {
        constexpr float kDeepestWithin = 0.25f; // spacings, of parts of one body
        return (is_own() ? kDeepestWithin : contact_law::kDeepest) * spacing;
    }
    /// m that the pair may go until a point that lies so far outside might touch.
    float safe_way(float distance) const {
        constexpr float kClearer = 0.8f;   // part of a distance that is safe to go
        constexpr float kTouching = 0.05f; // spacings; later would be too late: the way in would cost no energy
        return distance < kTouching * spacing ? 0 : kClearer * distance;
    }
};

} // namespace filigree
