#include "filigree/physics/step/vibration.h"

#include "filigree/core/math.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace filigree {

namespace {

constexpr double kRubbingDamping = 0.1; ///< of critical, of vibrations across the thickness
constexpr double kUntilCalmed = 2;      ///< vibrations
constexpr double kMostPaid = 0.75;      ///< of a body's vibration, in a substep

double shear_wave_speed(const Material& material) {
    return std::sqrt(material.young_modulus / (2 * (1 + material.poisson_ratio) * material.density));
}

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
    return std::numbers::pi * shear_wave_speed(body.material) / box_of(body.rest).size().maxCoeff();
}

double thickness_frequency(const Body& body) {
    return std::numbers::pi * shear_wave_speed(body.material) / box_of(body.rest).size().minCoeff();
}

bool calm_rubbing(BodyState& body, bool touches, bool rubs, double seconds) {
    const auto step = float(seconds);
    if (!touches) body.rubbed_seconds = std::max(0.0f, body.rubbed_seconds - step); // it may only hop
    if (!touches || !rubs) return false;
    const double until_calmed = kUntilCalmed * 2 * std::numbers::pi / lowest_frequency(*body.body);
    body.rubbed_seconds = std::min(body.rubbed_seconds + step, float(2 * until_calmed));
    if (double(body.rubbed_seconds) < until_calmed) return false;
    scale_vibration(body, math::exp(-2 * kRubbingDamping * thickness_frequency(*body.body) * seconds));
    return true;
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
