// A body on its way: what the stepper and contacts change. Private to the layer.
#pragma once

#include "filigree/physics/body/body_hit.h"
#include "filigree/physics/body/contact_corners.h"
#include "filigree/physics/body/elasticity.h"
#include "filigree/physics/breaking/broken_body.h"

#include <Eigen/Geometry>
#include <optional>

namespace filigree {

/// Where a rigid body is and how it moves.
struct RigidPose {
    double mass = 0;                                          ///< kg
    Mat3d inverse_inertia = Mat3d::Zero();                    ///< 1/(kg m^2), of the body at rest
    Vec3d rest_centre = Vec3d::Zero();                        ///< of mass, m
    Vec3d centre = Vec3d::Zero(), velocity = Vec3d::Zero();   ///< world, m and m/s
    Eigen::Quaterniond turn = Eigen::Quaterniond::Identity(); ///< from the body at rest
    Vec3d angular = Vec3d::Zero();                            ///< angular momentum about the centre, kg m^2/s
    double quiet_seconds = 0;                                 ///< that it has hardly moved
    bool rests = false;  ///< an obstacle holds it, or a rigid body that rests; nothing else moves it
    bool sleeps = false; ///< nothing is computed for it
};

/// Share of the body's squared frequency at rest that contacts may add: they never shorten explicit steps by more.
inline constexpr float kContactShare = 1;

struct BodyState {
    static constexpr std::size_t kNobody = ~std::size_t{0};

    std::shared_ptr<const Body> body;
    std::size_t actor = 0; ///< that it belongs to: a piece, to the one that broke; kNobody: the slot is free
    Eigen::Isometry3d placement = Eigen::Isometry3d::Identity(); ///< Actor::placement
    bool is_absent = false;  ///< a body that has broken, a piece of one that has not, or one on the grid
    bool is_on_grid = false; ///< of the model mpm: moved by mpm::Bodies; it has no elasticity
    std::shared_ptr<const BrokenBody> broken; ///< of a body that breaks: its pieces ...
    std::size_t first_piece = 0;              ///< ... and the first of their numbers
    std::unique_ptr<Elasticity> elasticity;
    Vectors positions, velocities;    ///< world, m and m/s
    Vectors forces;                   ///< N, of the last evaluation; on the grid those from outside alone
    std::vector<float> inverse_mass;  ///< 0: pinned
    std::vector<std::uint8_t> fixed;  ///< 1: pinned
    float rest_squared_frequency = 0; ///< ElasticReport::squared_frequency at rest
    std::vector<float> damping;       ///< of each particle, over Material::damping; empty: 1
    double mean_damping = 1;          ///< the same of the whole body, by mass
    bool may_sleep = true;            ///< Actor::may_sleep
    bool is_held = false;             ///< by pins, forces or wind: not left to itself
    bool follows = false;             ///< the targets of an animation
    std::optional<RigidPose> rigid;   ///< of a rigid body
    bool is_stiff = false; ///< its bounces are over before they are seen, and are what restitution says (stiff_hits.h)
    BodyHit hit;           ///< of a stiff body
    float rubbed_seconds = 0; ///< at whose frames' starts it rubbed, since it touched nothing (vibration.h)
    float step_seconds = 0;   ///< of the substep that is being made
    float most_push = 0;      ///< m that contact may push a particle out in it: kMostPush
    float pushed_way = 0;     ///< m that particles were moved one by one, at most; a rigid body's pose has to follow
    bool is_free() const { return actor == kNobody; } ///< no body is here: it was removed
    bool sleeps() const { return is_absent || (rigid && rigid->sleeps); }

    /// Of a piece: a light corner, of cells that are hardly filled, and the heaviest corner of those cells.
    struct LightCorner {
        Index particle, neighbour;
    };
    std::vector<LightCorner> light_corners;

    /// What contact sees of the cells: of meshfree bodies corners of their own, else the particles.
    std::optional<ContactCorners> corners;
    const Vectors& corner_positions() const { return corners ? corners->positions() : positions; }
    const Vectors& corner_velocities() const { return corners ? corners->velocities() : velocities; }
    Vectors& corner_forces() { return corners ? corners->forces() : forces; }

    Embedding surface; ///< points that touch
    /// Of each surface point, N/m: that of a spacing's depth of material under the point's area, bounded so that all
    /// points together add no more than kContactShare times the body's own squared frequency to any particle.
    std::vector<float> surface_stiffness;
    std::vector<std::uint8_t> hidden; ///< 1: a surface point on a crack that has not opened; empty: none
    bool is_hidden(std::size_t point) const { return !hidden.empty() && hidden[point]; }
};

/// A slot that waits for a body: absent, without particles, and wider than anything.
BodyState free_slot();

/// A gradient with its stretches within 1/4 and 4; the identity for one that is not finite.
Mat3f bounded_stretch(const Mat3f& gradient);

/// Of each corner, whether its cells are hardly filled. Such corners fly to and fro beside the rest at ten times its
/// speed, and carry nothing.
std::vector<std::uint8_t> light_particles(const Body& body);
void find_light_corners(BodyState& state);

/// Calls visit(body, number, particle) for a particle of a body, or of one that has broken for each of its copies.
template <class State, class Visit>
void each_copy(std::span<State> bodies, std::size_t body, Index particle, const Visit& visit) {
    const BodyState& whole = bodies[body];
    if (!whole.is_absent || whole.is_on_grid) return visit(bodies[body], body, particle);
    for (const CornerCopy& copy : whole.broken->copies_of(particle))
        visit(bodies[whole.first_piece + copy.piece], whole.first_piece + copy.piece, copy.corner);
}

/// Points that others asked to be carried along.
struct Attachment {
    std::size_t body = 0;
    std::vector<Vec3f> points; ///< of the body at rest
    Embedding embedding;
};
Attachment attach(const BodyState& state, std::size_t body, std::span<const Vec3f> rest_points,
                  const RunContext& context);
/// As Simulation::attached.
void move_attached(const BodyState& state, const Attachment& attachment, std::span<Vec3f> points,
                   std::span<Mat3f> gradients, const RunContext& context);

/// Where the particles have the corners of cells that are not particles. Cost O(particles of meshfree bodies).
void place_corners(std::span<BodyState> bodies, const RunContext& context);
/// Not of a rigid body.
void set_surface_stiffness(BodyState& state);

Box box_of(const Vectors& positions); ///< at least one, all finite

/// Where an embedded point is, by its weights alone.
inline Vec3f embedded_point(const Embedding& embedding, std::size_t point, const Vectors& values) {
    Vec3f sum = Vec3f::Zero();
    for (Index k = embedding.offsets[point]; k < embedding.offsets[point + 1]; ++k)
        sum += embedding.weights[k] * values[embedding.particles[k]];
    return sum;
}

/// Begins to read what embedded_point reads of a point: where that follows for many points, they wait but once.
inline void read_ahead(const Embedding& embedding, std::size_t point) {
    const Index first = embedding.offsets[point];
    __builtin_prefetch(embedding.particles.data() + first);
    __builtin_prefetch(embedding.weights.data() + first);
}

inline void add_to_particles(const Embedding& embedding, std::size_t point, const Vec3f& value, Vectors& values) {
    for (Index k = embedding.offsets[point]; k < embedding.offsets[point + 1]; ++k)
        values.add(embedding.particles[k], embedding.weights[k] * value);
}

/// How far a point gives way to an impulse of 1 along any direction, 1/kg: sum w^2 / m.
inline float yielding(const Embedding& embedding, std::size_t point, const std::vector<float>& inverse_mass) {
    float sum = 0;
    for (Index k = embedding.offsets[point]; k < embedding.offsets[point + 1]; ++k)
        sum += embedding.weights[k] * embedding.weights[k] * inverse_mass[embedding.particles[k]];
    return sum;
}

inline constexpr float kMostPush = 0.05f; ///< times the speed of the body's waves

/// Moves a particle by its weight over its mass, as XPBD projects a constraint of zero compliance, but no further than
/// `most`, m: light corners of the cell would be thrown through the others. Of a body that deforms, no further than it
/// has come in this substep and kMostPush: what is moved faster than waves run turns cells inside out, and deforms them
/// by work that nobody did.
inline void push_particle(BodyState& body, Index particle, float weight, const Vec3f& way, const Vec3f& velocity,
                          float most) {
    const float share = weight * body.inverse_mass[particle], asked = std::abs(share) * way.norm();
    float moved = std::min(asked, most);
    if (!body.rigid) moved = std::min(moved, body.most_push + body.step_seconds * std::abs(share) * velocity.norm());
    const Vec3f step = moved > 0 ? Vec3f(share * (moved / asked) * way) : Vec3f(Vec3f::Zero());
    body.positions.add(particle, step);
    body.velocities.add(particle, share * velocity);
    if (body.corners) body.corners->follow(particle, step, share * velocity);
    body.pushed_way = std::max(body.pushed_way, moved);
}

} // namespace filigree
