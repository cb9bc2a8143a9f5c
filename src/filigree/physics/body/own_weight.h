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
    double young_modulus = 0; ///< Pa, of the body

    bool is_too_much() const { return smaller < 1; }
    /// What carries itself: a size (or scale) in place of this one, rounded down to one digit; a Young's modulus, Pa.
    double size_that_does(double size) const;
    double modulus_that_does() const { return young_modulus / smaller; }
    /// Where it is too much: the body's height and weight, and that matter of this name cannot carry that; else "". The
    /// rest of a sentence that begins with the body's name, without its full stop.
    std::string sentence(const std::string& material) const;
};

/// turn: how the body stands. A body is too large from a strain of kMostOwnStrain on. Cost O(particles).
OwnWeight own_weight(const Body& body, const Mat3d& turn, const Vec3d& gravity);
inline constexpr double kMostOwnStrain = 0.2;

} // namespace filigree
