// Materials of bodies: how stiff, how heavy, what yields, melts and flows. SI units: metres, kilograms, seconds,
// pascals, kelvins.
//
//     Material rubber = {.density = 1100, .young_modulus = 1e6, .poisson_ratio = 0.45};
//     Material wax;
//     for (const NamedMaterial& named : named_materials()) if (named.name == "wax") wax = named.material;
//
// Next: physics/body.h makes a body of a mesh and a material.
#pragma once

#include <limits>
#include <span>
#include <string>
#include <string_view>

namespace filigree {

/// How a body moves.
/// - fem: neo-Hookean finite elements on lattice cells. The first choice for elastic bodies.
/// - springs: a lattice of springs; Poisson's ratio is always 1/4.
/// - meshfree: moving least squares over neighbours at rest [Mueller 2004]; elastic and plastic.
/// - rigid: does not deform. For bodies that are too stiff or too small for elastic steps.
/// - mpm: the material point method [Hu 2018]. For matter that melts, freezes, separates and joins.
enum class MaterialModel { fem, springs, meshfree, rigid, mpm };

struct Material {
    MaterialModel model = MaterialModel::fem;
    double density = 1000;       ///< kg/m^3, 1e-9 to 1e6
    double young_modulus = 1e5;  ///< Pa, 1e-9 to 1e12
    double poisson_ratio = 0.3;  ///< 0 .. 0.49; springs: always 1/4
    double damping = 0.5;        ///< 1/s: the fraction of its speed that motion loses a second
    double internal_damping = 0; ///< s: viscous stress by rate of strain, as a multiple of the stiffness (Kelvin-Voigt)
    double bending = 0.05;       ///< springs: stiffness of bending springs as a share of an axis spring's, 0 .. 0.2

    // Plasticity: fem, meshfree and mpm. Heat and melting: mpm.
    static constexpr double kNever = std::numeric_limits<double>::infinity();
    double yield_stress = kNever; ///< Pa, uniaxial (von Mises), above 0
    double creep_time = 0;        ///< s: time in which stress above the yield stress relaxes; 0: at once
    double temperature = 293;     ///< K, at the start
    double melting_from = kNever; ///< K: solid below
    double melting_to = kNever;   ///< K: fluid above; not below melting_from
    double viscosity = 10;        ///< Pa s, of the melt
    double heating = 0;           ///< K/s: how fast the surroundings heat the surface
    double conductivity = 0;      ///< m^2/s: thermal diffusivity inside
    double specific_heat = 2000;  ///< J/(kg K), solid and fluid, above 0
    double latent_heat = 0;       ///< J/kg: melting takes it, freezing gives it back

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
/// Speed of pressure waves, m/s: sqrt((lambda + 2 mu) / density). Stiffer and lighter matter needs shorter steps.
double pressure_wave_speed(const Material& material);

/// The first thing wrong with a material, as a sentence that names the quantity, or "".
std::string check_material(const Material& material);

/// A preset: a material to begin with. Values are rounded and chosen for how they move on a screen; they are not
/// measured.
struct NamedMaterial {
    std::string_view name;
    std::string_view text; ///< what it does, in a few words
    Material material;
    double strength = 0; ///< Pa, FractureMaterial::strength; 0: chosen by the stiffness
    double energy = 0;   ///< J/m^2, FractureMaterial::energy; 0: chosen by the stiffness
};
/// All presets.
std::span<const NamedMaterial> named_materials();

} // namespace filigree
