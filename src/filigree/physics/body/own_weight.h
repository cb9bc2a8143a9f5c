// Whether a body can carry itself.
#pragma once

#include "filigree/physics/body.h"

#include <string>

namespace filigree {

/// A body that its own weight presses together.
struct OwnWeight {
    double strain = 0; ///< density times gravity times height by Young's modulus; 0 of what is rigid or fluid
    double height = 0; ///< m, along gravity
    double mass = 0;   ///< kg
    /// What the body's scale, or its size, or one by Young's modulus may be multiplied by, so that it carries itself;
    /// 1: it does.
    double smaller = 1;

    bool is_too_much() const { return smaller < 1; }
};

/// turn: how the body stands. A body is too large from a strain of kMostOwnStrain on. Cost O(particles).
OwnWeight own_weight(const Body& body, const Mat3d& turn, const Vec3d& gravity);
inline constexpr double kMostOwnStrain = 0.2;

/// Where it is too much: the rest of a sentence that begins with the body's name and says what would do, else "".
/// material: what it is called. size: m, the mesh's longest side, where that is what the user gives; else the scale is.
std::string weight_warning(const Body& body, const Mat3d& turn, const Vec3d& gravity, const std::string& material,
                           std::optional<double> size = {});

} // namespace filigree
