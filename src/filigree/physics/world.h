// What is around bodies: gravity, obstacles, forces, hands, wind, and how they move in time.
#pragma once

#include "filigree/physics/distance_field.h"

#include <memory>
#include <variant>
#include <vector>

namespace filigree {

/// A value that changes in time: linear between keys, constant before the first and after the last.
template <class T>
struct Keyed {
    std::vector<double> times; ///< s, ascending (two equal ones are a jump); empty: `constant`
    std::vector<T> values;     ///< one a time
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

/// A rigid motion: turn about `centre` by `angle` (the angle times a unit axis), then move.
struct RigidMotion {
    Vec3d centre = Vec3d::Zero();
    Keyed<Vec3d> move{{}, {}, Vec3d::Zero()};  ///< m
    Keyed<Vec3d> angle{{}, {}, Vec3d::Zero()}; ///< axis times radians
    /// A turn and a shift before all of this, as where something was put (Simulation::set_obstacle).
    Eigen::Isometry3d start = Eigen::Isometry3d::Identity();

    Eigen::Isometry3d at(double time) const;
    bool moves() const { return !move.times.empty() || !angle.times.empty(); }
};

struct HalfSpace {
    Vec3d point = Vec3d::Zero(), normal = {0, 1, 0}; ///< solid below; any length above 0
};
struct Ball {
    Vec3d centre = Vec3d::Zero();
    double radius = 1; ///< m, above 0
};
struct Cuboid {
    Vec3d centre = Vec3d::Zero(), size = Vec3d::Ones(); ///< along the axes before the obstacle's motion
};
class ObstacleSurface;
/// Its triangles are walls with two sides, whether they close or not: nothing goes through them, from wherever it
/// comes. What starts inside of a closed one stays in it, as in a room.
struct MeshObstacle {
    std::shared_ptr<const DistanceField> field; ///< a coarse picture of it, for what asks on a grid
    Vec3d offset = Vec3d::Zero();               ///< added to the field's and the surface's coordinates
    /// Null: it is as solid as `field` says, and no sharper.
    std::shared_ptr<const ObstacleSurface> surface = nullptr;
};
/// The one way from a mesh to an obstacle; `offset` is 0. Arguments and errors: as DistanceField::create.
Result<MeshObstacle> make_mesh_obstacle(const Mesh& mesh, double scale, double spacing, const RunContext& context,
                                        OutwardReport* outward = nullptr);

/// Something solid that bodies touch and that does not feel them.
struct Obstacle {
    std::variant<HalfSpace, Ball, Cuboid, MeshObstacle> shape;
    RigidMotion motion;
    double friction = 0.5; ///< Coulomb's coefficient, 0 or more
    /// 0 .. 1: speed of a hard point after the bounce over that before. A soft body bounces by its own elasticity too.
    double restitution = 0.5;
    double stiffness = 1; ///< above 0, to 1: of the contact; less for ground that is softer than the bodies
    Keyed<double> temperature{{}, {}, 293}; ///< K, above 0; of what bodies of mpm touch
    double heat_transfer = 0;               ///< W/(m^2 K), 0 or more: heat that it exchanges with them
};

/// What an obstacle is turned about where nothing else is said, before its motion, m: the middle of a ball or a cuboid,
/// a half-space's point, a mesh's origin.
Vec3d pivot_of(const Obstacle& obstacle);

/// Distance and outward normal of an obstacle that stands at `motion` (its RigidMotion at some time). World, m.
DistanceField::Sample distance_to(const Obstacle& obstacle, const Eigen::Isometry3d& motion, const Vec3f& point);

/// Particles held fast: they follow `motion`, from where they were at the start.
struct Pin {
    std::size_t body = 0;
    std::vector<Index> particles;
    RigidMotion motion;
};

/// A force on the particles of a region, or of the whole body, shared out by mass.
struct RegionForce {
    std::size_t body = 0;
    std::vector<Index> particles;              ///< empty: all of the body's
    Keyed<Vec3d> force{{}, {}, Vec3d::Zero()}; ///< N, of the whole region

    /// Calls visit(particle) for all that it acts on, of a body of so many.
    template <class Visit>
    void each_particle(std::size_t count, const Visit& visit) const {
        for (const Index particle : particles) visit(particle);
        for (Index particle = 0; particles.empty() && particle < count; ++particle) visit(particle);
    }
};

/// A hand that pulls a point of a body's surface towards a moving target by a damped spring.
struct Hand {
    std::size_t body = 0;
    Vec3f point = Vec3f::Zero();                                      ///< of the body at rest
    double stiffness = 0;                                             ///< N/m; 0: chosen from the body's
    Keyed<Vec3d> target{{}, {}, Vec3d::Zero()};                       ///< world, m
    double from = 0, until = std::numeric_limits<double>::infinity(); ///< s
};

/// Something that warms bodies of mpm: matter in a ball takes up its power, shared out by mass.
struct HeatSource {
    Ball ball = {.radius = 0.1};
    Keyed<Vec3d> move{{}, {}, Vec3d::Zero()}; ///< m
    Keyed<double> power{{}, {}, 0};           ///< W; below 0 it cools
};

/// How two bodies touch.
struct PairContact {
    double friction = 0.3;    ///< Coulomb's coefficient, 0 or more
    double restitution = 0.7; ///< 0 .. 1, as an obstacle's
};

/// How these two bodies touch, where that differs from others.
struct BodyPair {
    std::size_t first = 0, second = 0; ///< in any order; equal: parts of one body
    PairContact contact;
};

/// How each body of one group touches each of another, where that differs from others.
struct GroupPair {
    std::vector<std::size_t> first, second; ///< bodies, in any order; a body may be in both
    PairContact contact;
};

struct World {
    Vec3d gravity = {0, -9.81, 0};              ///< m/s^2
    Keyed<Vec3d> wind{{}, {}, Vec3d::Zero()};   ///< m/s
    double air_density = 0;                     ///< kg/m^3: wind presses by 1/2 density |v| v on the area that faces it
    Keyed<double> air_temperature{{}, {}, 293}; ///< K, above 0
    double air_heat_transfer = 0;               ///< W/(m^2 K), 0 or more: between the air and bodies of mpm
    std::vector<HeatSource> heat_sources;
    double heat_pace = 1; ///< above 0: how many times quicker than in truth all heat goes, in bodies of mpm
    std::vector<Obstacle> obstacles;
    std::vector<Pin> pins;
    std::vector<RegionForce> forces;
    std::vector<Hand> hands;
    double body_friction = PairContact{}.friction; ///< between bodies, and between parts of one
    double body_restitution = PairContact{}.restitution;
    std::vector<BodyPair> body_pairs;   ///< those that touch otherwise; of several about the same two the first holds
    std::vector<GroupPair> group_pairs; ///< the same of many, where body_pairs has nothing about two; the first holds

    PairContact contact_of(std::size_t body, std::size_t other) const; ///< cost O(pairs and members of groups)
};

} // namespace filigree
