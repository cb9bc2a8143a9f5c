// What an elastic deformation gradient keeps of itself where the material flows.
#pragma once

#include "filigree/physics/fem/cofactor.h"
#include "filigree/physics/material.h"
#include "filigree/types.h"

#include <algorithm>

namespace filigree {

struct FlowLaw {
    float yield_strain; ///< of |dev log s|: sqrt(2/3) yield stress / (2 mu); infinite: no yield
    float yield_rate;   ///< part of the excess that flows off: 1 - exp(-dt / creep time); 1 at once
    float beside = 0;   ///< squared strain that the gradient does not show, which yields along with it
};
/// Of a material that yields, over dt seconds.
FlowLaw yield_law(const Material& material, float dt);

/// Cells and particles below this part of their volume do not yield.
inline constexpr float kLeastYielding = 0.1f;
/// How far matter has flowed, by the inverse D of its plastic gradient, of determinant 1: the larger of |D|^2 and
/// |D^-1|^2, the square of how many times it became longer or thinner, or was sheared.
inline float flowed(const Mat3f& inverse) { return std::max(inverse.squaredNorm(), cofactor(inverse).squaredNorm()); }
/// Beyond it nothing flows further, so that what became seven times as long is elastic from there on: neighbours and
/// corners at rest say less and less of what is near.
inline constexpr float kMostFlowed = 50;
/// Whether D has all but come to that limit.
inline bool has_flowed_out(const Mat3f& inverse) { return flowed(inverse) > 0.9f * kMostFlowed; }

/// Eigenvalues (not sorted) and unit eigenvectors (columns) of a symmetric matrix by Jacobi rotations; the same bytes
/// everywhere. Not for matrices with infinite entries.
void symmetric_eigen(const Mat3f& matrix, Vec3f& values, Mat3f& vectors);

/// The return map [Simo 1992]: with elastic stretches s of `elastic` (singular values) and e = log s, the deviatoric
/// part of e shrinks as the law says. Returns R so that the elastic gradient becomes elastic * R; R is symmetric, with
/// determinant 1, but where a stretch lies below kLeastStretch and is set to that. kept: the part of the deviatoric
/// strain that stays. False: nothing flows.
bool flow(const Mat3f& elastic, const FlowLaw& law, Mat3f& R, float* kept = nullptr);

inline constexpr float kLeastStretch = 0.05f;

} // namespace filigree
