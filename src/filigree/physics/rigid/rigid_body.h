// A body that does not deform: its particles keep their places beside each other. Private to the layer.
#pragma once

#include "filigree/physics/body/body_state.h"

namespace filigree {

/// Squared frequency that contacts with soft bodies give a rigid body at most, 1/s^2: 16 substeps
/// a frame at 60 frames a second.
inline constexpr float kRigidSquaredFrequency = 0.99e6f;
inline constexpr float kLongestRigidStep = 4.2e-3f; ///< s, of substeps of rigid bodies: 4 a frame, else

/// The same particles and surface, of a material that does not deform. body: of fem or springs.
Body as_rigid(const Body& body);

/// m, m/s and so on of the body as it is moved by its particles' forces.
RigidPose rigid_pose(const BodyState& body);
/// The particles where the pose has them, with its velocities.
void place_particles(BodyState& body);
/// The pose that fits the particles best, after something moved them one by one.
void fit_pose(BodyState& body);

/// What the forces on the particles are together.
struct RigidLoad {
    Vec3d force = Vec3d::Zero();  ///< N
    Vec3d torque = Vec3d::Zero(); ///< N m, about the centre of mass
};
RigidLoad rigid_load(const BodyState& body);
/// m/s of the load and gravity, for dt; then what damping leaves, a factor.
void kick_rigid(BodyState& body, const RigidLoad& load, const Vec3d& gravity, double dt, double kept);
/// Moves the pose by the velocities for dt; place_particles comes after.
void drift_rigid(BodyState& body, double dt);

/// N/m of each surface point, so that those that touch at one time add no more than kRigidSquaredFrequency.
std::vector<float> rigid_surface_stiffness(const BodyState& body);

/// Elastic forces of a body that has none.
std::unique_ptr<Elasticity> make_rigid_elasticity(const Body& body);

/// m/s of the fastest point, below which a body that rests tires.
inline constexpr float kSlow = 2e-3f;
/// Counts frames in which a body hardly moves. Whether that is long enough to sleep: half a second.
bool grow_tired(BodyState& body, double frame_seconds);
void fall_asleep(BodyState& body);
void wake(BodyState& body);

} // namespace filigree
