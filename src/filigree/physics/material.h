// What a body is made of. SI units throughout: metres, kilograms, seconds, pascals, kelvins.
#pragma once

#include <limits>
#include <string>

namespace filigree {

/// How a body's elasticity is computed. fem: neo-Hookean on lattice cells. springs: a lattice of springs, Poisson's
/// ratio 1/4 by construction. meshfree: moving least squares over neighbours at rest [Mueller 2004]. rigid: does
/// not deform; for what is too stiff or too small to be stepped as elastic. mpm: the material point method [Hu
/// 2018], for matter that melts, freezes, parts and joins.
enum class MaterialModel { fem, springs, meshfree, rigid, mpm };

struct Material {
    MaterialModel model = MaterialModel::fem;
    double density = 1000;       ///< kg/m^3, 1e-9 to 1e6
    double young_modulus = 1e5;  ///< Pa, 1e-9 to 1e12
    double poisson_ratio = 0.3;  ///< 0 .. 0.49; springs: always 1/4
    double damping = 0.5;        ///< 1/s: motion through still air loses this fraction of its speed a second
    double internal_damping = 0; ///< s: stress a rate of strain adds, as a multiple of stiffness (Kelvin-Voigt)
    double bending = 0.05;       ///< springs: share of an axis spring's stiffness given to bending springs, 0 .. 0.2

    // Plasticity: fem, meshfree and mpm. Heat and melting: mpm.
    static constexpr double kNever = std::numeric_limits<double>::infinity();
    double yield_stress = kNever; ///< Pa, of uniaxial stress (von Mises), above 0
    double creep_time = 0;        ///< s: stress beyond yield relaxes at this rate; 0: at once
    double temperature = 293;     ///< K, at the start
    double melting_from = kNever; ///< K: stiff below ...
    double melting_to = kNever;   ///< K: ... fluid above; not below melting_from
    double viscosity = 10;        ///< Pa s, of the melt
    double heating = 0;           ///< K/s: ambient heating of the surface
    double conductivity = 0;      ///< m^2/s: thermal diffusivity inside
    double specific_heat = 2000;  ///< J/(kg K), solid and fluid, above 0
    double latent_heat = 0;       ///< J/kg that melting takes and freezing gives back

    bool operator==(const Material&) const = default;

    bool is_plastic() const { return yield_stress < kNever; }
    bool melts() const { return melting_to < kNever; }
};

struct LameParameters {
    double lambda, mu; ///< Pa
};
inline LameParameters lame_parameters(double young_modulus, double poisson_ratio) {
    return {young_modulus * poisson_ratio / ((1 + poisson_ratio) * (1 - 2 * poisson_ratio)),
            young_modulus / (2 * (1 + poisson_ratio))};
}
/// Speed of pressure waves, m/s: sqrt((lambda + 2 mu) / density).
double pressure_wave_speed(const Material& material);

/// The first thing wrong with a material, as a sentence that names the quantity, or "".
std::string check_material(const Material& material);

} // namespace filigree
