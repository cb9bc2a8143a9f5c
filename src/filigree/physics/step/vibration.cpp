#include "filigree/physics/step/vibration.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace filigree {

namespace {

constexpr double kRubbingDamping = 0.1; ///< of critical, of the slowest vibration
constexpr double kUntilCalmed = 2;      ///< vibrations
constexpr double kMostPaid = 0.75;      ///< of a body's vibration, in a substep

} // namespace

double vibration_energy(const BodyState& body) {
    const MotionOf rigid(rigid_state(body));
    double sum = 0;
    for (std::size_t i = 0; i < body.positions.size(); ++i)
        if (!body.fixed[i])
            sum += double(body.body->mass[i]) *
                   (body.velocities[i].cast<double>() - rigid.at(body.positions[i].cast<double>())).squaredNorm();
    return sum / 2;
}

void scale_vibration(BodyState& body, double factor) {
    const MotionOf rigid(rigid_state(body));
    for (std::size_t i = 0; i < body.positions.size(); ++i) {
        if (body.fixed[i]) continue;
        const Vec3d along = rigid.at(body.positions[i].cast<double>());
        body.velocities.set(i, (along + factor * (body.velocities[i].cast<double>() - along)).cast<float>());
    }
}

double lowest_frequency(const Body& body) {
    const Material& material = body.material;
    const double shear = material.young_modulus / (2 * (1 + material.poisson_ratio));
    return std::numbers::pi * std::sqrt(shear / material.density) / box_of(body.rest).size().maxCoeff();
}

void calm_rubbing(BodyState& body, bool touches, bool rubs, double frame_seconds) {
    if (!touches) {
        body.rubbed_seconds = 0;
        return;
    }
    if (!rubs) return;
    const double frequency = lowest_frequency(*body.body);
    if (double(body.rubbed_seconds) * frequency > kUntilCalmed * 2 * std::numbers::pi)
        scale_vibration(body, std::exp(-2 * kRubbingDamping * frequency * frame_seconds));
    else
        body.rubbed_seconds += float(frame_seconds);
}

void EnergyDebt::begin(const BodyState& body, const Vectors& forces, const RunContext& context) {
    energy_ = body.elasticity->energy(body.positions, context);
    positions_ = body.positions;
    forces_ = forces;
    work_ = 0;
}

void EnergyDebt::moved(const BodyState& body, const Vectors& forces) {
    for (std::size_t i = 0; i < positions_.size(); ++i)
        work_ += 0.5 * (forces_[i] + forces[i]).cast<double>().dot((body.positions[i] - positions_[i]).cast<double>());
}

void EnergyDebt::before_push(const BodyState& body, const RunContext& context) {
    energy_ = body.elasticity->energy(body.positions, context);
    work_ = 0;
}

void EnergyDebt::end(BodyState& body, const RunContext& context) {
    owed_ += body.elasticity->energy(body.positions, context) - *energy_ + work_;
    energy_.reset();
    if (owed_ > 0) pay(body);
    if (!std::isfinite(owed_)) owed_ = 0; // the frame is done again
}

void EnergyDebt::pay(BodyState& body) {
    const double has = vibration_energy(body), paid = std::min(owed_, kMostPaid * has);
    if (!(paid > 0)) return;
    scale_vibration(body, std::sqrt(1 - paid / has));
    owed_ -= paid;
}

} // namespace filigree
