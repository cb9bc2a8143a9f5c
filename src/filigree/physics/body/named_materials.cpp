#include "filigree/physics/material.h"

#include <array>

namespace filigree {

namespace {

/// A material, with what differs from a new one's.
template <class Set>
NamedMaterial made(std::string_view name, std::string_view text, double density, double young, double poisson,
                   const Set& set) {
    NamedMaterial named{.name = name, .text = text, .material = {}};
    named.material.density = density;
    named.material.young_modulus = young;
    named.material.poisson_ratio = poisson;
    set(named.material);
    return named;
}

/// Stiffness is a thousandth of the real one or less, so that frames take few steps: what is left is how it breaks.
/// strength: Pa; energy: J/m^2.
NamedMaterial brittle(std::string_view name, std::string_view text, double density, double young, double poisson,
                      double strength, double energy) {
    NamedMaterial named = made(name, text, density, young, poisson, [](Material& m) {
        m.damping = 0.1;
        m.internal_damping = 1e-4;
    });
    named.strength = strength;
    named.energy = energy;
    return named;
}

struct Melt {
    double yield, viscosity, specific, latent, diffusivity; ///< Pa, Pa s, J/(kg K), J/kg, m^2/s
};

/// from, to: K.
void melts(Material& material, double from, double to, const Melt& melt) {
    material.model = MaterialModel::mpm;
    material.melting_from = from;
    material.melting_to = to;
    material.yield_stress = melt.yield;
    material.viscosity = melt.viscosity;
    material.specific_heat = melt.specific;
    material.latent_heat = melt.latent;
    material.conductivity = melt.diffusivity;
    material.damping = 0.1;
}

} // namespace

std::span<const NamedMaterial> named_materials() {
    static const std::array materials = {
        made("rubber", "bounces", 1100, 1e6, 0.45, [](Material& m) { m.damping = 0.2; }),
        made("soft-rubber", "squashes and bounces", 1100, 1e5, 0.45, [](Material& m) { m.damping = 0.2; }),
        made("jelly", "wobbles", 1000, 2e4, 0.45, [](Material& m) { m.internal_damping = 0.002; }),
        made("foam", "light and soft", 60, 2e4, 0.1, [](Material& m) { m.damping = 1; }),
        made("wood", "stiff; a tenth of real wood's", 600, 1e9, 0.3, [](Material&) {}),
        made("metal", "heavy and stiff; a hundredth of steel's", 7800, 2e9, 0.3, [](Material&) {}),
        made("lattice", "springs", 1000, 1e5, 0.25, [](Material& m) { m.model = MaterialModel::springs; }),
        made("stone", "does not deform; any size and number of pieces", 2600, 1e9, 0.2,
             [](Material& m) {
                 m.model = MaterialModel::rigid;
                 m.damping = 0.1;
             }),
        brittle("brittle-stone", "breaks where it is hit hard", 2600, 2e7, 0.2, 1e5, 20),
        brittle("glass", "breaks easily, into splinters", 2500, 3e7, 0.25, 1e5, 4),
        brittle("plaster", "light; crumbles", 1200, 1e7, 0.2, 4e4, 4),
        made("clay", "keeps the shape it is pressed into", 1700, 2e5, 0.35,
             [](Material& m) {
                 m.model = MaterialModel::meshfree;
                 m.yield_stress = 8e3;
                 m.creep_time = 0.02;
                 m.damping = 2;
             }),
        made("wax", "melts from 45 to 65 degrees Celsius", 900, 3e5, 0.35,
             [](Material& m) {
                 melts(m, 318, 338,
                       {.yield = 2e4, .viscosity = 2, .specific = 2100, .latent = 2e5, .diffusivity = 1.3e-7});
             }),
        made("chocolate", "melts from 27 to 36 degrees Celsius", 1300, 4e5, 0.35,
             [](Material& m) {
                 melts(m, 300, 309,
                       {.yield = 4e4, .viscosity = 3, .specific = 1600, .latent = 4.5e4, .diffusivity = 1.2e-7});
             }),
        made("butter", "soft; melts from 15 to 35 degrees Celsius", 910, 3e5, 0.4,
             [](Material& m) {
                 melts(m, 288, 308,
                       {.yield = 6e3, .viscosity = 0.5, .specific = 2300, .latent = 8e4, .diffusivity = 1e-7});
                 m.temperature = 280;
             }),
        made("ice", "melts to water at 0 degrees Celsius", 917, 3e5, 0.33,
             [](Material& m) {
                 melts(m, 273.15, 273.15,
                       {.yield = 2e5, .viscosity = 0.002, .specific = 2050, .latent = 3.34e5, .diffusivity = 1.2e-6});
                 m.temperature = 268;
             }),
        made("lava", "fluid at 1200 degrees Celsius, rock at 1000", 2700, 5e5, 0.25,
             [](Material& m) {
                 melts(m, 1273, 1473,
                       {.yield = 2e5, .viscosity = 300, .specific = 1150, .latent = 4e5, .diffusivity = 5e-7});
                 m.temperature = 1480;
             }),
    };
    return materials;
}

} // namespace filigree
