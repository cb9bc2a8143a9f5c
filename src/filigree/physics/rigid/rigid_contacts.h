// Contact points of rigid bodies, solved by impulses. Private to the layer.
#pragma once

#include "filigree/physics/body/body_state.h"

#include <span>
#include <vector>

namespace filigree {

/// Where a rigid body touches an obstacle or another rigid body, or may touch it within a substep.
struct ContactPoint {
    Index body = 0, other = kNoIndex;     ///< other: kNoIndex is an obstacle ...
    Index obstacle = kNoIndex;            ///< ... and this its number
    Vec3f place = Vec3f::Zero();          ///< world, m
    Vec3f normal = Vec3f::Zero();         ///< unit, from the other to the body
    float separation = 0;                 ///< m; below 0 is penetration
    Vec3f other_velocity = Vec3f::Zero(); ///< m/s, of an obstacle there
    float friction = 0, restitution = 0;
    Vec3f* force = nullptr;          ///< N, on the body: of the last substep, where the solver starts; then of this one
    bool* holds = nullptr;           ///< whether it pushes
    float impulse = 0, approach = 0; ///< after finish: N s along the normal; m/s that they came nearer before
};

/// m outside of something at which a point of a rigid body counts as touching it: in a substep it may get there. speed:
/// m/s, of anything of the two beside each other. spacing: m, the smaller.
float touching_margin(float spacing, float speed);

/// Sequential impulses [Catto 2006] in short substeps, started from the forces of the substep before. Sweeps go on
/// until velocities hardly change, so that heavy bodies on light ones stand; their number is bounded by the work that
/// they are. Penetration is corrected by velocities that are taken away again after the bodies have moved, and
/// restitution is applied then. Same bytes for any number of threads: one thread solves.
class RigidContacts {
public:
    void clear() { points_.clear(); }
    void add(const ContactPoint& point) { points_.push_back(point); }

    std::span<const ContactPoint> points() const { return points_; }

    /// Before loads change velocities: what restitution goes by.
    void prepare(std::span<const BodyState> bodies);
    /// After loads have changed velocities: the velocities with which bodies move for dt.
    void solve(std::span<BodyState> bodies, double dt);
    /// After bodies have moved for dt: the velocities with which they go on. slow: m/s, of approach, below which
    /// nothing bounces.
    void finish(std::span<BodyState> bodies, double dt, double slow);
    /// Whether something pushes a body; after solve.
    bool pushes(std::size_t body) const { return is_pushed_[body] != 0; }

private:
    struct Mover { ///< a body as the solver sees it
        Vec3d velocity, spin;
        Mat3d inverse_inertia;
        double inverse_mass;
    };
    struct Row {           ///< a contact point
        Index body, other; ///< movers; other: kNoIndex is what nothing moves
        Vec3d normal, arm, other_arm, tangents[2];
        Vec3d other_velocity;
        double mass, tangent_masses[2];                   ///< kg, that an impulse there moves
        double impulse = 0, tangent_impulses[2] = {0, 0}; ///< N s, in all
        double target = 0;                                ///< m/s, along the normal: at least
        double approach; ///< m/s along the normal before the substep; below 0 they come nearer
        double separation;
    };
    Index mover_of(std::span<const BodyState> bodies, Index body);
    Vec3d relative_velocity(const Row& row) const;
    void push(const Row& row, const Vec3d& impulse);
    double solve_row(Row& row, double friction);
    void sweep_until_still(double tolerance);
    void write_back(std::span<BodyState> bodies) const;

    std::vector<ContactPoint> points_;
    std::vector<Row> rows_; ///< of the points
    std::vector<Mover> movers_;
    std::vector<Index> body_of_mover_, mover_of_body_;
    std::vector<std::uint8_t> is_pushed_; ///< of each body
};

} // namespace filigree
