#include "filigree/physics/mpm_particle.h"

#include <algorithm>
#include <cmath>

namespace filigree::mpm {

namespace {

constexpr float kElasticStep = 0.4f;     ///< of the time in which a pressure wave crosses a cell
constexpr float kViscousStep = 0.12f;    ///< of density spacing^2 / viscosity
constexpr float kConductionStep = 0.15f; ///< of spacing^2 / diffusivity
constexpr float kViscousShare = 4;       ///< how many times shorter than elasticity's viscosity may make steps
constexpr float kRenewedStrain = 0.8f;   ///< plastic strain from which on matter counts as new
constexpr float kRenewedLiquid = 1.25f;  ///< per fluid part
constexpr float kLeastVolumeRatio = 0.1f, kMostVolumeRatio = 4;

using Symmetric = float[6];

float norm(const Symmetric& s) {
    return std::sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2] + 2 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]));
}

float determinant(const Symmetric& s) {
    return s[0] * (s[1] * s[2] - s[5] * s[5]) - s[3] * (s[3] * s[2] - s[5] * s[4]) + s[4] * (s[3] * s[5] - s[1] * s[4]);
}

/// f b f^T, with f's columns.
void push_forward(const float f[3][3], const Symmetric& b, Symmetric& out) {
    float fb[3][3]; // rows
    for (int r = 0; r < 3; ++r) {
        fb[r][0] = f[0][r] * b[0] + f[1][r] * b[3] + f[2][r] * b[4];
        fb[r][1] = f[0][r] * b[3] + f[1][r] * b[1] + f[2][r] * b[5];
        fb[r][2] = f[0][r] * b[4] + f[1][r] * b[5] + f[2][r] * b[2];
    }
    const auto entry = [&](int r, int s) { return fb[r][0] * f[0][s] + fb[r][1] * f[1][s] + fb[r][2] * f[2][s]; };
    out[0] = entry(0, 0);
    out[1] = entry(1, 1);
    out[2] = entry(2, 2);
    out[3] = entry(0, 1);
    out[4] = entry(0, 2);
    out[5] = entry(1, 2);
}

/// d + I t with determinant 1, for a deviator d: two Newton steps from the mean there was.
void with_determinant_one(Symmetric& d, float mean) {
    for (int step = 0; step < 2; ++step) {
        Symmetric b = {d[0] + mean, d[1] + mean, d[2] + mean, d[3], d[4], d[5]};
        const float slope = b[0] * b[1] + b[1] * b[2] + b[2] * b[0] - b[3] * b[3] - b[4] * b[4] - b[5] * b[5];
        mean -= (determinant(b) - 1) / std::max(slope, 1e-3f);
    }
    for (int i = 0; i < 3; ++i) d[i] += mean;
}

} // namespace

Matter::Matter(const Material& material, double heat_pace)
    : density_(float(material.density)), yield_(float(material.yield_stress)), viscosity_(float(material.viscosity)),
      damping_(float(material.damping)), melting_from_(float(material.melting_from)),
      melting_to_(float(material.melting_to)), specific_heat_(float(material.specific_heat)),
      latent_heat_(float(material.latent_heat)), diffusivity_(float(material.conductivity * heat_pace)),
      heating_(float(material.heating * heat_pace)), melts_(material.melts()) {
    const LameParameters lame = lame_parameters(material.young_modulus, material.poisson_ratio);
    shear_ = float(lame.mu);
    bulk_ = float(lame.lambda + 2 * lame.mu / 3);
    if (melts_) yield_ = std::min(yield_, shear_); // so that it fades to nothing as it melts
    has_heat_ = melts_ || diffusivity_ > 0 || heating_ != 0;
}

float Matter::enthalpy(float temperature) const {
    const float sensible = specific_heat_ * temperature;
    if (!melts_ || temperature <= melting_from_) return sensible;
    if (temperature >= melting_to_) return sensible + latent_heat_;
    return sensible + latent_heat_ * (temperature - melting_from_) / (melting_to_ - melting_from_);
}

float Matter::liquid(float enthalpy) const {
    if (!melts_) return 0;
    const float from = specific_heat_ * melting_from_, to = specific_heat_ * melting_to_ + latent_heat_;
    return to > from ? std::clamp((enthalpy - from) / (to - from), 0.0f, 1.0f) : enthalpy >= to ? 1.0f : 0.0f;
}

float Matter::temperature(float enthalpy) const {
    const float l = liquid(enthalpy);
    if (l <= 0) return enthalpy / specific_heat_;
    if (l >= 1) return (enthalpy - latent_heat_) / specific_heat_;
    return melting_from_ + l * (melting_to_ - melting_from_);
}

float Matter::longest_step(float grid_spacing) const {
    const float wave = std::sqrt((bulk_ + 4.0f / 3 * shear_) / density_);
    float step = kElasticStep * grid_spacing / wave;
    if (melts_) step = std::min(step, kViscousStep * density_ * grid_spacing * grid_spacing / viscosity_);
    if (diffusivity_ > 0) step = std::min(step, kConductionStep * grid_spacing * grid_spacing / diffusivity_);
    return step;
}

void Matter::limit_viscosity(float grid_spacing) {
    const float wave = std::sqrt((bulk_ + 4.0f / 3 * shear_) / density_);
    const float shortest = kElasticStep * grid_spacing / wave / kViscousShare;
    viscosity_ = std::min(viscosity_, kViscousStep * density_ * grid_spacing * grid_spacing / shortest);
}

void Matter::stress(const Particle& p, float stress[6]) const {
    const float l = liquid(p.enthalpy()), j = p.volume_ratio();
    const float mean = (p.b[0] + p.b[1] + p.b[2]) / 3, shear = shear_ * (1 - l);
    float pressure = 0.5f * bulk_ * (j * j - 1);
    if (j > 1) pressure *= 1 - l; // melt does not pull
    for (int i = 0; i < 6; ++i) stress[i] = shear * p.b[i];
    for (int i = 0; i < 3; ++i) stress[i] += pressure - shear * mean;
    if (l > 0) {
        const float viscous = 2 * viscosity_ * l * j;
        const float divergence = (p.c[0][0] + p.c[1][1] + p.c[2][2]) / 3;
        for (int i = 0; i < 3; ++i) stress[i] += viscous * (p.c[i][i] - divergence);
        stress[3] += viscous * 0.5f * (p.c[1][0] + p.c[0][1]);
        stress[4] += viscous * 0.5f * (p.c[2][0] + p.c[0][2]);
        stress[5] += viscous * 0.5f * (p.c[2][1] + p.c[1][2]);
    }
    for (int i = 0; i < 6; ++i) stress[i] *= p.volume;
}

void Matter::deform(Particle& p, float dt) const {
    float f[3][3];
    for (int k = 0; k < 3; ++k)
        for (int r = 0; r < 3; ++r) f[k][r] = dt * p.c[k][r] + (k == r ? 1.0f : 0.0f);
    const float det = f[0][0] * (f[1][1] * f[2][2] - f[2][1] * f[1][2]) -
                      f[1][0] * (f[0][1] * f[2][2] - f[2][1] * f[0][2]) +
                      f[2][0] * (f[0][1] * f[1][2] - f[1][1] * f[0][2]);
    const float safe = std::clamp(det, 0.3f, 3.0f);
    p.volume_ratio() = std::clamp(p.volume_ratio() * safe, kLeastVolumeRatio, kMostVolumeRatio);
    Symmetric b;
    push_forward(f, p.b, b);
    const float shrink = 1 / std::cbrt(std::clamp(determinant(b), 0.03f, 30.0f)); // by its own: rounding adds up
    for (float& entry : b) entry *= shrink;

    const float l = liquid(p.enthalpy());
    const float mean = (b[0] + b[1] + b[2]) / 3;
    Symmetric d = {b[0] - mean, b[1] - mean, b[2] - mean, b[3], b[4], b[5]};
    const float size = norm(d), most = std::sqrt(2.0f / 3) * yield_ * (1 - l) / shear_;
    if (size > most || !(size < 10)) {
        const float kept = size < 1e6f ? most / size : 0.0f;
        for (float& entry : d) entry *= kept;
        if (l <= 0) p.plastic_strain() += std::sqrt(2.0f / 3) * 0.5f * (size - most) / std::max(mean, 1.0f);
        with_determinant_one(d, std::max(mean * kept, 1.0f));
        std::copy(d, d + 6, p.b);
    } else {
        std::copy(b, b + 6, p.b);
    }
    const float renewed = std::max(kRenewedLiquid * l, p.plastic_strain() - kRenewedStrain);
    p.renewal = std::max(p.renewal, std::clamp(renewed, 0.0f, 1.0f));
    if (l >= 1) p.melted = 1;
}

double Matter::energy(const Particle& p) const {
    const double j = double(p.volume_ratio()), l = double(liquid(p.enthalpy()));
    const double trace = double(p.b[0] + p.b[1] + p.b[2]) - 3;
    double volumetric = 0.5 * double(bulk_) * (0.5 * (j * j - 1) - std::log(j));
    if (j > 1) volumetric *= 1 - l;
    return double(p.volume) * (0.5 * double(shear_) * (1 - l) * trace + volumetric);
}

} // namespace filigree::mpm
