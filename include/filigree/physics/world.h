// The world around bodies: gravity, obstacles, pins, forces, hands, wind and heat; and how bodies break.
//
//     World world;                                         // gravity alone
//     world.obstacles.push_back({.shape = HalfSpace{}});   // and the ground
//
// SI units: metres, kilograms, seconds, newtons, kelvins; y is up unless gravity says otherwise. `body` and `obstacle`
// are numbers: positions in the lists given to Simulation::create. Next: physics/simulation.h moves the bodies.
#pragma once

#include "filigree/physics/body.h"

#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <variant>
#include <vector>

namespace filigree {

// ---------------------------------------------------------------------------------------------------------------------
// Values and motions in time

/// A value that changes in time: linear between keys, constant before the first key and after the last.
template <class T>
struct Keyed {
    std::vector<double> times; ///< s, ascending; two equal times make a jump. Empty: the value is `constant`
    std::vector<T> values;     ///< one value a time
    T constant{};

    T at(double time) const {
        if (times.empty()) return constant;
        if (time <= times.front()) return values.front();
        for (std::size_t k = 1; k < times.size(); ++k)
            if (time < times[k]) {
                const double t = (time - times[k - 1]) / (times[k] - times[k - 1]);
                return T(values[k - 1] + (values[k] - values[k - 1]) * t);
            }
        return values.back();
    }
};

/// A rigid motion: `start`, then a turn about `centre` by `angle`, then `move`.
struct RigidMotion {
    Vec3d centre = Vec3d::Zero();              ///< m
    Keyed<Vec3d> move{{}, {}, Vec3d::Zero()};  ///< m
    Keyed<Vec3d> angle{{}, {}, Vec3d::Zero()}; ///< unit axis times radians
    /// Where the thing was put before it moves: Simulation::set_obstacle writes it.
    Eigen::Isometry3d start = Eigen::Isometry3d::Identity();

    Eigen::Isometry3d at(double time) const;
    bool moves() const { return !move.times.empty() || !angle.times.empty(); }
};

// ---------------------------------------------------------------------------------------------------------------------
// Obstacles

/// Everything below a plane is solid.
struct HalfSpace {
    Vec3d point = Vec3d::Zero(); ///< a point of the plane, m
    Vec3d normal = {0, 1, 0};    ///< points out of the solid; any length above 0
};
struct Ball {
    Vec3d centre = Vec3d::Zero(); ///< m
    double radius = 1;            ///< m, above 0
};
/// A box along the axes, before the obstacle's motion.
struct Cuboid {
    Vec3d centre = Vec3d::Zero(); ///< m
    Vec3d size = Vec3d::Ones();   ///< m, side lengths
};

class ObstacleSurface;
/// A mesh as an obstacle. Its triangles are walls with two sides, whether the mesh is closed or open: nothing passes
/// them from either side. A body that starts inside a closed mesh stays inside, as in a room.
struct MeshObstacle {
    std::shared_ptr<const DistanceField> field; ///< the mesh on a grid; bodies of mpm and distance_to use it
    Vec3d offset = Vec3d::Zero();               ///< m, added to the coordinates of the field and the surface
    /// The triangles. Null: bodies touch what `field` has inside, as exact as its grid.
    std::shared_ptr<const ObstacleSurface> surface = nullptr;
};

/// Makes an obstacle of a mesh, with `offset` 0.
/// scale: metres a model unit. spacing: m, between points of the field's grid; 0: a 64th of the mesh's longest side.
/// outward: if given, gets what was turned to make faces look outwards. Cost: the distances at all grid points.
/// Errors: usage (check_mesh refuses the mesh), unsuitable (no faces; more than 2^27 grid points), cancelled.
Result<MeshObstacle> make_mesh_obstacle(const Mesh& mesh, double scale, double spacing,
                                        const RunContext& context = RunContext(), OutwardReport* outward = nullptr);

/// Something solid that bodies touch. It does not feel them.
struct Obstacle {
    std::variant<HalfSpace, Ball, Cuboid, MeshObstacle> shape;
    RigidMotion motion;
    double friction = 0.5; ///< Coulomb's coefficient, 0 or more
    /// Coefficient of restitution, 0 .. 1: speed after a bounce by speed before it. Elastic bodies bounce by their own
    /// elasticity as well.
    double restitution = 0.5;
    double stiffness = 1; ///< of the contact, above 0 to 1; less than 1 for ground that is softer than the bodies
    Keyed<double> temperature{{}, {}, 293}; ///< K, above 0; felt by bodies of mpm
    double heat_transfer = 0;               ///< W/(m^2 K), 0 or more: heat exchanged with bodies of mpm
};

/// The point about which an obstacle turns where nothing else is said, m, before its motion: the middle of a ball or a
/// cuboid, the point of a half-space, the origin of a mesh.
Vec3d pivot_of(const Obstacle& obstacle);

/// Signed distance (m, negative inside) and outward normal of an obstacle at a point of the world.
/// motion: where the obstacle stands, as RigidMotion::at gives it.
DistanceField::Sample distance_to(const Obstacle& obstacle, const Eigen::Isometry3d& motion, const Vec3f& point);

// ---------------------------------------------------------------------------------------------------------------------
// Pins, forces, hands, heat

/// Particles that are held: they follow `motion` from where they were at the start.
struct Pin {
    std::size_t body = 0;
    std::vector<Index> particles;
    RigidMotion motion;
};

/// A force on a region of a body, or on the whole body. Each particle gets a share by its mass.
struct RegionForce {
    std::size_t body = 0;
    std::vector<Index> particles;              ///< empty: all of the body's
    Keyed<Vec3d> force{{}, {}, Vec3d::Zero()}; ///< N, of the whole region

    /// Calls visit(particle) for each particle of the region. count: the number of particles of the body.
    template <class Visit>
    void each_particle(std::size_t count, const Visit& visit) const {
        for (const Index particle : particles) visit(particle);
        for (Index particle = 0; particles.empty() && particle < count; ++particle) visit(particle);
    }
};

/// A hand that pulls a point of a body towards a moving target, by a damped spring.
struct Hand {
    std::size_t body = 0;
    Vec3f point = Vec3f::Zero();                                      ///< m, on the body at rest
    double stiffness = 0;                                             ///< N/m; 0: chosen from the body's stiffness
    Keyed<Vec3d> target{{}, {}, Vec3d::Zero()};                       ///< world, m
    double from = 0, until = std::numeric_limits<double>::infinity(); ///< s: when it pulls
};

/// A source of heat for bodies of mpm: the matter inside a ball takes up the power, each particle by its mass.
struct HeatSource {
    Ball ball = {.radius = 0.1};              ///< m
    Keyed<Vec3d> move{{}, {}, Vec3d::Zero()}; ///< m
    Keyed<double> power{{}, {}, 0};           ///< W; below 0 it cools
};

// ---------------------------------------------------------------------------------------------------------------------
// How bodies touch each other

struct PairContact {
    double friction = 0.3;    ///< Coulomb's coefficient, 0 or more
    double restitution = 0.7; ///< coefficient of restitution, 0 .. 1
};

/// The contact of two bodies that differs from World::body_friction and body_restitution.
struct BodyPair {
    std::size_t first = 0, second = 0; ///< in any order; equal: parts of one body
    PairContact contact;
};

/// The contact of each body of one group with each body of another.
struct GroupPair {
    std::vector<std::size_t> first, second; ///< bodies, in any order; a body may be in both
    PairContact contact;
};

// ---------------------------------------------------------------------------------------------------------------------
// The world

struct World {
    Vec3d gravity = {0, -9.81, 0};            ///< m/s^2
    Keyed<Vec3d> wind{{}, {}, Vec3d::Zero()}; ///< m/s
    double air_density = 0;                   ///< kg/m^3; wind presses with 1/2 density |v| v on the area that faces it
    Keyed<double> air_temperature{{}, {}, 293}; ///< K, above 0
    double air_heat_transfer = 0;               ///< W/(m^2 K), 0 or more: heat between the air and bodies of mpm
    std::vector<HeatSource> heat_sources;
    double heat_pace = 1; ///< above 0: all heat in bodies of mpm flows this many times faster than in reality
    std::vector<Obstacle> obstacles;
    std::vector<Pin> pins;
    std::vector<RegionForce> forces;
    std::vector<Hand> hands;
    double body_friction = PairContact{}.friction; ///< between bodies, and between parts of one body
    double body_restitution = PairContact{}.restitution;
    std::vector<BodyPair> body_pairs;   ///< exceptions for two bodies; the first entry about the two counts
    std::vector<GroupPair> group_pairs; ///< exceptions for groups, where body_pairs has none; the first entry counts

    /// The contact that counts between two bodies. Cost O(pairs and members of groups).
    PairContact contact_of(std::size_t body, std::size_t other) const;
};

// ---------------------------------------------------------------------------------------------------------------------
// Bodies that break
//
// Cut the body into pieces before the simulation (break_body); the pieces hold together until the stress on the crack
// between them is above the material's strength. fracture.h makes cells that cut the mesh and the body alike.

/// Space cut into pieces.
struct Partition {
    Index count = 0; ///< number of pieces, 1 or more
    /// The piece that holds a point: below `count`. The point is on the body at rest, m. Called from many threads.
    std::function<Index(const Vec3d&)> piece_at;
};

/// A body with all of its pieces.
struct BrokenBody;

struct BrokenBodyReport {
    std::size_t pieces = 0;                     ///< pieces that have matter
    double crack_area = 0;                      ///< m^2
    double least_volume = 0, median_volume = 0; ///< m^3, of the pieces
};

/// Cuts a body of the model fem into pieces. Cost: about 2 us for each cell that pieces share, and a distance field for
/// each piece. Errors: usage (no pieces), unsuitable (another material model than fem; a piece needs more than 2^27
/// grid points), cancelled.
Result<std::shared_ptr<const BrokenBody>> break_body(std::shared_ptr<const Body> whole, Partition partition,
                                                     const RunContext& context = RunContext(),
                                                     BrokenBodyReport* report = nullptr);

/// When a crack begins and how it grows.
struct FractureMaterial {
    double strength = 1e6; ///< Pa, above 0: the traction at which two pieces separate
    double scatter = 0;    ///< 0 .. 1: relative standard deviation of the strength between pairs of pieces (Weibull)
    double energy = 10;    ///< J/m^2 of crack, above 0
    /// m, above 0. For matter that yields: how far a layer one cell thick opens for good before it separates.
    double plastic_opening = std::numeric_limits<double>::infinity();
    std::uint64_t seed = 0; ///< of the scatter
};

/// Pieces that separate at a given time, whatever pulls them.
struct FractureEvent {
    double time = 0;              ///< s
    std::vector<Index> pieces;    ///< numbers of the partition that lose their neighbours; empty: all
    std::vector<Index> particles; ///< particles of the whole body: only there; empty: everywhere
};

/// Says that a body breaks, and how. Actor::fracture takes it.
struct Fracture {
    std::shared_ptr<const BrokenBody> body; ///< made from the actor's body
    FractureMaterial material;
    std::vector<FractureEvent> events;
};

/// How far a body is broken.
struct FractureReport {
    bool breaks = false; ///< whether it can break at all
    std::size_t pieces = 0;
    std::size_t parts = 0;                                  ///< groups of pieces that still hold together
    double first = std::numeric_limits<double>::infinity(); ///< s: when the first crack began
    double crack_area = 0;                                  ///< m^2 between pieces
    double broken_area = 0;                                 ///< m^2 of it that has lost strength
    double dissipated = 0;                                  ///< J
    std::vector<double> broke; ///< s, for each piece with matter: when it began to separate
};

/// The first thing wrong with the material, as a sentence that names the quantity, or "".
std::string check_fracture(const FractureMaterial& material);

} // namespace filigree
