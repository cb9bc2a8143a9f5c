#include "filigree/physics/named_materials.h"

#include <array>

namespace filigree {

namespace {

/// A material, with what differs from a new one's.
template <class Set>
NamedMaterial made(std::string_view name, std::string_view text, double density, double young, double poisson,
                   const Set& set) {
    NamedMaterial named{name, text, {}};
    named.material.density = density;
    named.material.young_modulus = young;
    named.material.poisson_ratio = poisson;
    set(named.material);
    return named;
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
        made("clay", "keeps the shape it is pressed into", 1700, 2e5, 0.35,
             [](Material& m) {
                 m.model = MaterialModel::meshfree;
                 m.yield_stress = 8e3;
                 m.creep_time = 0.02;
                 m.damping = 2;
             }),
        made("wax", "melts from 45 to 65 degrees Celsius", 900, 2e5, 0.35,
             [](Material& m) {
                 m.model = MaterialModel::meshfree;
                 m.yield_stress = 2e4;
                 m.melting_from = 318;
                 m.melting_to = 338;
                 m.viscosity = 20;
                 m.conductivity = 1e-4;
                 m.damping = 1;
             }),
    };
    return materials;
}

} // namespace filigree
