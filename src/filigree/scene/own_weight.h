// Whether a body can carry itself.
#pragma once

#include "filigree/physics/body.h"

#include <string>

namespace filigree {

/// Where a body is so large that its own weight would press it together by a quarter at its foot or more (density times
/// gravity times height by Young's modulus): the rest of a sentence that begins with its name and says
/// what would do; else "". box: of the mesh, model units; turn: how it stands; material: what it is called.
std::string weight_warning(const Body& body, const Box& box, const Mat3d& turn, const Vec3d& gravity,
                           const std::string& material);

} // namespace filigree
