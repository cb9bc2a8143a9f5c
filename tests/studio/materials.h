// Materials by name, for tests.
#pragma once

#include "filigree/physics/material.h"

#include <algorithm>
#include <string_view>

namespace filigree::studio {

inline Material material_named(std::string_view name) {
    return std::ranges::find(named_materials(), name, &NamedMaterial::name)->material;
}

} // namespace filigree::studio
