// Contact points of rigid bodies, solved by impulses. Private to the layer.
#pragma once

#include "filigree/physics/body/body_state.h"
#include "filigree/physics/rigid/contact_manifold.h"
#include "filigree/physics/rigid/contact_rows.h"

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
    bool* holds = nullptr;           ///< whether it pushes; null: nobody asks
    float impulse = 0, approach = 0; ///< after finish: N s along the normal; m/s that they came nearer before
};

/// m outside of something at which a point of a rigid body counts as touching it: in a substep it may get there. speed:
/// m/s, of anything of the two beside each other. spacing: m, the smaller.
float touching_margin(float spacing, float speed);

/// Sequential impulses [Catto 2006] in short substeps, started from the forces of the substep before. Bodies that touch
/// are an island, and each island is swept until its velocities hardly change, so that heavy bodies on light ones
/// stand; the number of sweeps is bounded by the work that they are. Penetration is corrected by velocities that are
/// taken away again after the bodies have moved, and restitution is applied then. Same bytes for any number of threads.
class RigidContacts {
public:
    void clear() { points_.clear(); }
    void add(const ContactPoint& point) { points_.push_back(point); }

    std::span<const ContactPoint> points() const { return points_; }

    /// What is deep in an obstacle came in faster than a substep can see, began there, or the obstacle jumped: it is
    /// moved out at once and gets no speed, and its points go along. Returns which bodies, and how far, m.
    std::vector<std::pair<Index, float>> move_out_of_obstacles(std::span<BodyState> bodies);
    /// Before loads change velocities: what restitution goes by. Of the points that a body has on obstacles a manifold
    /// is left. gravity: m/s^2, what comes becomes faster until it touches.
    void prepare(std::span<const BodyState> bodies, const Vec3d& gravity, const RunContext& context);
    /// After loads have changed velocities: the velocities with which bodies move for dt.
    void solve(std::span<BodyState> bodies, double dt, const RunContext& context);
    /// After bodies have moved for dt: the velocities with which they go on. slow: m/s, of approach, below which
    /// nothing bounces.
    void finish(std::span<BodyState> bodies, double dt, double slow, const RunContext& context);
    /// Whether something pushes a body; after solve.
    bool pushes(std::size_t body) const { return is_pushed_[body] != 0; }

private:
    struct Mover { ///< a body as it was before; the first is what nothing moves
        Index body = kNoIndex;
        Vec3d velocity = Vec3d::Zero(), spin = Vec3d::Zero(), angular = Vec3d::Zero();
        Mat3d turn = Mat3d::Identity();
        Mat3f inverse_inertia = Mat3f::Zero();
        float inverse_mass = 0;
    };
    static std::vector<ManifoldPoint> manifold_points(std::span<const ContactPoint> points, const RigidPose& pose);
    void reduce_on_obstacles(std::span<const BodyState> bodies);
    Index mover_of(std::span<const BodyState> bodies, Index body);
    void find_islands();
    void begin_answer(ContactRow::Answer& answer, const ContactRow& row, Index mover, const Vec3d& arm) const;
    void begin_row(ContactRow& row, std::span<const BodyState> bodies, const Vec3d& gravity) const;
    Vec3d velocity_before(const ContactRow& row, const Vec3d& arm, const Vec3d& other_arm) const;
    void take_velocities(std::span<const BodyState> bodies);
    void start_row(ContactRow& row, std::span<const BodyState> bodies, double dt);
    void sweep_until_still(std::span<const Index> rows, std::size_t most_rows, float tolerance);
    void write_back(std::span<BodyState> bodies) const;

    std::vector<ContactPoint> points_;
    std::vector<ContactRow> rows_; ///< of points, island by island
    struct Touching {
        Index body, other, point; ///< movers
    };
    std::vector<Touching> touching_, sorted_; ///< of rows, in the order of points and in their own
    std::vector<Index> islands_, swept_;      ///< first row of each, and how many there are; numbers of rows
    std::vector<Mover> movers_;
    std::vector<MoverChange> changes_; ///< of movers
    std::vector<Index> mover_of_body_;
    std::vector<std::uint8_t> is_pushed_; ///< of each body
};

} // namespace filigree
