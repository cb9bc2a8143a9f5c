#include "filigree/physics/material.h"

#include <cmath>

namespace filigree {

double pressure_wave_speed(const Material& material) {
    const double nu = material.model == MaterialModel::springs ? 0.25 : material.poisson_ratio;
    const LameParameters lame = lame_parameters(material.young_modulus, nu);
    return std::sqrt((lame.lambda + 2 * lame.mu) / material.density);
}

std::string check_material(const Material& material) {
    const auto is_positive = [](double value) { return std::isfinite(value) && value > 0; };
    const auto is_not_negative = [](double value) { return std::isfinite(value) && value >= 0; };
    const auto within = [](double value, double least, double most) { return value >= least && value <= most; };

    // Beyond all matter, and within what floats can multiply.
    if (!within(material.density, 1e-9, 1e6)) return "The density must be from 1e-9 to 1e6 kg/m^3.";
    if (!within(material.young_modulus, 1e-9, 1e12)) return "Young's modulus must be from 1e-9 to 1e12 Pa.";
    if (!within(material.poisson_ratio, 0, 0.49)) return "Poisson's ratio must be from 0 to 0.49.";
    if (!is_not_negative(material.damping)) return "The damping must be 0 or more (1/s).";
    if (!is_not_negative(material.internal_damping)) return "The internal damping must be 0 s or more.";
    if (!within(material.bending, 0, 0.2)) return "The bending share must be from 0 to 0.2.";

    if (!(material.yield_stress > 0)) return "The yield stress must be above 0 Pa.";
    if (!is_not_negative(material.creep_time)) return "The creep time must be 0 s or more.";
    if (!is_positive(material.temperature)) return "The temperature must be above 0 K.";
    if (!(material.melting_from > 0)) return "Melting must begin above 0 K.";
    if (!(material.melting_to >= material.melting_from))
        return "The temperature at which melting ends must not be below that at which it begins.";
    if (!is_positive(material.viscosity)) return "The viscosity must be above 0 Pa s.";
    if (!std::isfinite(material.heating)) return "The heating must be a number (K/s).";
    if (!is_not_negative(material.conductivity)) return "The conductivity must be 0 m^2/s or more.";
    if (!is_positive(material.specific_heat)) return "The specific heat must be above 0 J/(kg K).";
    if (!is_not_negative(material.latent_heat)) return "The latent heat must be 0 J/kg or more.";
    if (material.melts() && material.model != MaterialModel::mpm)
        return "Only the model mpm melts; take it, or leave melting out.";
    if (material.is_plastic() && (material.model == MaterialModel::springs || material.model == MaterialModel::rigid))
        return "Only the models fem, meshfree and mpm yield; take one, or leave the yield stress out.";
    return "";
}

} // namespace filigree
