// What a stiff elastic body meets while it touches something. Private to the layer.
#pragma once

#include "filigree/types.h"

namespace filigree {

/// What pushes a body in a substep, summed by how hard.
struct BodyLoad {
    static constexpr double kNothing = -1, kObstacle = -2, kSeveral = -3;

    double force = 0;                                    ///< N, along normals
    Vec3d normal = Vec3d::Zero(), place = Vec3d::Zero(); ///< N; N m, in the world
    Vec3d other_velocity = Vec3d::Zero();                ///< N m/s, of what pushes
    double restitution = 0;                              ///< N
    double other = kNothing;                             ///< number of the body that pushes

    void add(double push, const Vec3f& along, const Vec3f& at, const Vec3f& velocity, double bounce, double by) {
        force += push;
        normal += push * along.cast<double>();
        place += push * at.cast<double>();
        other_velocity += push * velocity.cast<double>();
        restitution += push * bounce;
        other = other == kNothing || other == by ? by : kSeveral;
    }
    void add(const BodyLoad& load, double times) {
        force += times * load.force;
        normal += times * load.normal;
        place += times * load.place;
        other_velocity += times * load.other_velocity;
        restitution += times * load.restitution;
        other = other == kNothing || other == load.other ? load.other : kSeveral;
    }
};

/// From the first substep in which something pushes the body to the last.
struct BodyHit {
    double seconds = -1; ///< since it began; below 0: nothing pushes
    BodyLoad pushed;     ///< times seconds
    Vec3d centre = Vec3d::Zero(), velocity = Vec3d::Zero(), spin = Vec3d::Zero(); ///< as it came
};

} // namespace filigree
