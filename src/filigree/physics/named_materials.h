// Materials to begin with, by name. Rounded and chosen for how they move on a screen, not measured.
#pragma once

#include "filigree/physics/material.h"

#include <span>
#include <string_view>

namespace filigree {

struct NamedMaterial {
    std::string_view name, text; ///< text: what it does, a few words
    Material material;
    double strength = 0, energy = 0; ///< of what breaks, for FractureMaterial: Pa, J/m^2; 0: by its stiffness
};
std::span<const NamedMaterial> named_materials();

} // namespace filigree
