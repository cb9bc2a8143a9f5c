// Materials to begin with, by name. Rounded and chosen for how they move on a screen, not measured.
#pragma once

#include "filigree/physics/material.h"

#include <span>
#include <string_view>

namespace filigree {

struct NamedMaterial {
    std::string_view name, text; ///< text: what it does, a few words
    Material material;
};
/// Rubber, soft-rubber, jelly, foam, wood, metal, lattice (springs), clay and wax.
std::span<const NamedMaterial> named_materials();

} // namespace filigree
