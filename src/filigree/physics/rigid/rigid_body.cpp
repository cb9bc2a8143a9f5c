#include "filigree/physics/rigid/rigid_body.h"

#include "filigree/core/dense_solve.h"
#include "filigree/core/math.h"
#include "filigree/physics/rigid/rigid_state.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

constexpr double kMostTouching = 6; ///< points that carry a body at one time, or a sixth of all
constexpr double kTired = 0.5;      ///< s, after which a body sleeps that hardly moves

/// Turns what is given as of the body at rest into the world's axes.
Mat3d turned(const RigidPose& pose, const Mat3d& at_rest) {
    const Mat3d r = pose.turn.toRotationMatrix();
    return r * at_rest * r.transpose();
}

Vec3d centre_of(const Vectors& positions, std::span<const float> mass) {
    Vec3d sum = Vec3d::Zero();
    double all = 0;
    for (std::size_t i = 0; i < positions.size(); ++i) {
        sum += double(mass[i]) * positions[i].cast<double>();
        all += double(mass[i]);
    }
    return sum / all;
}

/// to = centre + map (from - origin) of each point.
void map_affinely(const Vectors& from, const Vec3d& origin, const Mat3d& map, const Vec3d& centre, Vectors& to) {
    const Vec3f o = origin.cast<float>();
    for (int axis = 0; axis < 3; ++axis) { // one at a time, so that the compiler uses vectors
        const Vec3f m = map.row(axis).cast<float>();
        const auto c = float(centre[axis]);
        const float *x = from.x.data(), *y = from.y.data(), *z = from.z.data();
        float* along = (to.*kVectorAxes[axis]).data();
        for (std::size_t i = 0; i < from.size(); ++i)
            along[i] = c + (m.x() * (x[i] - o.x()) + m.y() * (y[i] - o.y()) + m.z() * (z[i] - o.z()));
    }
}

class RigidElasticity final : public Elasticity {
public:
    explicit RigidElasticity(const Body& body) : body_(body) {
        double mass = 0;
        for (std::size_t i = 0; i < body.mass.size(); ++i) {
            mass += double(body.mass[i]);
            centre_ += double(body.mass[i]) * body.rest[i].cast<double>();
        }
        centre_ /= mass;
    }

    ElasticReport forces(const Vectors&, Vectors& forces, const RunContext&) override {
        std::ranges::fill(forces.x, 0.0f);
        std::ranges::fill(forces.y, 0.0f);
        std::ranges::fill(forces.z, 0.0f);
        ElasticReport report;
        report.squared_frequency = 3 * kRigidSquaredFrequency; // points of both bodies push, also just before
        return report;
    }

    double energy(const Vectors&, const RunContext&) const override { return 0; }
    void gradients(const Vectors& positions, std::span<Mat3f> gradients, const RunContext&) const override {
        std::ranges::fill(gradients, rotation_of(positions).cast<float>());
    }

    Vec3d centre_of(const Vectors& positions) const { return filigree::centre_of(positions, body_.mass); }
    Mat3d rotation_of(const Vectors& positions) const {
        const Vec3d centre = centre_of(positions);
        Mat3d moment = Mat3d::Zero();
        for (std::size_t i = 0; i < positions.size(); ++i)
            moment += double(body_.mass[i]) * (positions[i].cast<double>() - centre) *
                      (body_.rest[i].cast<double>() - centre_).transpose();
        return nearest_rotation(moment);
    }
    const Vec3d& rest_centre() const { return centre_; }

private:
    const Body& body_;
    Vec3d centre_ = Vec3d::Zero(); ///< of mass, at rest
};

const RigidElasticity& rigid(const BodyState& body) { return static_cast<const RigidElasticity&>(*body.elasticity); }

} // namespace

std::unique_ptr<Elasticity> make_rigid_elasticity(const Body& body) { return std::make_unique<RigidElasticity>(body); }

Body as_rigid(const Body& body) {
    Body rigid = body;
    rigid.material.model = MaterialModel::rigid;
    return rigid;
}

RigidPose rigid_pose(const BodyState& body) {
    const RigidState state = rigid_state(body);
    RigidPose pose;
    pose.mass = state.mass;
    pose.centre = state.centre;
    pose.velocity = state.linear / state.mass;
    pose.angular = state.angular;
    pose.turn = Eigen::Quaterniond(rigid(body).rotation_of(body.positions));
    const Mat3d r = pose.turn.toRotationMatrix();
    pose.inverse_inertia = (r.transpose() * state.inertia * r).inverse();
    pose.rest_centre = rigid(body).rest_centre();
    return pose;
}

void place_particles(BodyState& body) {
    const RigidPose& pose = *body.rigid;
    const Mat3d turn = pose.turn.toRotationMatrix();
    const Vec3d spin = turned(pose, pose.inverse_inertia) * pose.angular;
    Mat3d spinning; // spin x r
    for (int axis = 0; axis < 3; ++axis) spinning.col(axis) = spin.cross(turn.col(axis));
    map_affinely(body.body->rest, pose.rest_centre, turn, pose.centre, body.positions);
    map_affinely(body.body->rest, pose.rest_centre, spinning, pose.velocity, body.velocities);
}

void fit_pose(BodyState& body) {
    RigidPose pose = rigid_pose(body);
    if (body.rigid) { // what does not change stays as it was, to the last digit
        pose.mass = body.rigid->mass;
        pose.inverse_inertia = body.rigid->inverse_inertia;
        pose.quiet_seconds = body.rigid->quiet_seconds;
        pose.rests = body.rigid->rests;
    }
    body.rigid = pose;
    place_particles(body);
}

RigidLoad rigid_load(const BodyState& body) {
    Vec3d force = Vec3d::Zero(), torque = Vec3d::Zero();
    const float *x = body.forces.x.data(), *y = body.forces.y.data(), *z = body.forces.z.data();
    const Vec3d centre = body.rigid->centre;
    for (std::size_t i = 0, count = body.forces.size(); i < count; ++i) {
        if (x[i] == 0 && y[i] == 0 && z[i] == 0) continue; // of most, often
        const Vec3d f = body.forces[i].cast<double>();
        force += f;
        torque += (body.positions[i].cast<double>() - centre).cross(f);
    }
    return {force, torque};
}

void kick_rigid(BodyState& body, const RigidLoad& load, const Vec3d& gravity, double dt, double kept) {
    RigidPose& pose = *body.rigid;
    pose.velocity = (pose.velocity + dt * (load.force / pose.mass + gravity)) * kept;
    pose.angular = (pose.angular + dt * load.torque) * kept;
}

void drift_rigid(BodyState& body, double dt) {
    RigidPose& pose = *body.rigid;
    pose.centre += dt * pose.velocity;
    // The spin where the turn will be halfway: a body without torque then keeps its energy to second order.
    Eigen::Quaterniond half = pose.turn;
    const auto turn_by = [&](const Eigen::Quaterniond& from, const Eigen::Quaterniond& spin_at, double seconds) {
        const Mat3d r = spin_at.toRotationMatrix();
        const Vec3d angle = seconds * (r * pose.inverse_inertia * r.transpose() * pose.angular);
        const double length = angle.norm();
        if (!(length > 0)) return from;
        return math::quaternion(Eigen::AngleAxisd(length, angle / length)) * from;
    };
    half = turn_by(pose.turn, pose.turn, dt / 2);
    pose.turn = turn_by(pose.turn, half, dt).normalized();
}

std::vector<float> rigid_surface_stiffness(const BodyState& body) {
    const RigidState state = rigid_state(body);
    const double easiest = 1 / symmetric_eigen(state.inertia).values[0]; // of the turns about any axis
    const BodySurface& surface = body.body->surface;
    const double share = std::max(kMostTouching, double(surface.points.size()) / 6);
    std::vector<float> stiffness(surface.points.size());
    for (std::size_t s = 0; s < stiffness.size(); ++s) {
        const Vec3d arm = embedded_point(surface.points, s, body.positions).cast<double>() - state.centre;
        const double mass = 1 / (1 / state.mass + easiest * arm.squaredNorm()); // that a push there moves, at least
        stiffness[s] = float(double(kRigidSquaredFrequency) * mass / share);
    }
    return stiffness;
}

bool grow_tired(BodyState& body, double frame_seconds) {
    RigidPose& pose = *body.rigid;
    float most = 0;
    for (std::size_t i = 0; i < body.velocities.size(); ++i) most = std::max(most, body.velocities[i].squaredNorm());
    pose.quiet_seconds = most > kSlow * kSlow ? 0 : pose.quiet_seconds + frame_seconds;
    return pose.quiet_seconds >= kTired;
}

void fall_asleep(BodyState& body) {
    RigidPose& pose = *body.rigid;
    pose.sleeps = true;
    pose.velocity = pose.angular = Vec3d::Zero();
    place_particles(body);
}

void wake(BodyState& body) {
    body.rigid->sleeps = false;
    body.rigid->quiet_seconds = 0;
}

} // namespace filigree
