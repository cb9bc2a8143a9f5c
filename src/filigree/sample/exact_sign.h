// On which side of a line or a plane a point lies, exactly.
#pragma once

#include "filigree/sample.h"

#include <array>
#include <cstdint>

namespace filigree::exact {

using Tally = ExactDecisions; ///< not shared between threads: add up

/// Sign (-1, 0, 1) of (b - a) x (c - a): 1 when a, b, c turn counter-clockwise. Exact when all coordinates are zero or
/// from 2^-300 to 2^300 in size, as all floats are; beyond, products may leave the range of doubles. Filter first, then
/// 128-bit integers where all coordinates are small multiples of one power of two, then expansions.
int orient2d(const std::array<double, 2>& a, const std::array<double, 2>& b, const std::array<double, 2>& c,
             Tally* tally = nullptr);

/// Sign of det(b - a, c - a, d - a): 1 when d is on the side of the plane (a, b, c) that its normal (b - a) x (c - a)
/// points to, 0 when on it. Exact as orient2d.
int orient3d(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d, Tally* tally = nullptr);

/// Exact signs of the components of the normal (b - a) x (c - a).
std::array<int, 3> normal_signs(const Vec3d& a, const Vec3d& b, const Vec3d& c, Tally* tally = nullptr);

/// orient3d of d + (e, e^2, e^3), e -> 0+: where d is on the plane, the sign of the first component of the normal that
/// is not zero; 0 only for a triangle without a normal. The one rule by which all of `sample` decides about points on
/// the surface.
int orient3d_perturbed(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d, Tally* tally = nullptr);

/// Whether the ray from p + (e, e^2, e^3) towards higher x crosses the triangle: 1 where it leaves through it (the
/// normal points along x), -1 where it enters, 0 where it does not.
int crosses_along_x(const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& p);

} // namespace filigree::exact
