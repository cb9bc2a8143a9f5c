// The formulas of a crack: when two copies of a corner let go, and how they hold each other afterwards. Private to the
// layer.
#pragma once

#include "filigree/core/math.h"
#include "filigree/core/random.h"
#include "filigree/physics/breaking/broken_body.h"
#include "filigree/types.h"

#include <algorithm>
#include <cmath>

namespace filigree::crack_law {

/// How much less shear counts than tension [Camacho 1996].
inline constexpr float kShear = 2;
/// Traction at the front of a crack that is about to grow, over sqrt(E G / h). With 0.5 an edge-cracked plate fails at
/// the same load within 13 % for spacings of an eighth to a 64th of its width, and within 25 % for lattices turned by
/// 15, 30 and 45 degrees (Fracture.ANotchedPlate...).
inline constexpr double kFront = 0.5;
/// Of the yield stress: what still pulls on matter that has opened too far for good. Less does not open it.
inline constexpr double kTearing = 0.5;
/// Of the squared frequency that the springs of cohesion may add where they are stiffest.
inline constexpr float kCohesionShare = 0.25f;

/// Parts of a traction on a plane: tension, and what is not pressure.
struct Traction {
    Vec3f pull; ///< Pa: the traction less its pressure
    float size; ///< Pa: of tension and shear together
};
inline Traction split_traction(const Vec3f& traction, const Vec3f& normal) {
    const float along = traction.dot(normal);
    const Vec3f shear = traction - along * normal;
    const float tension = std::max(along, 0.0f);
    return {shear + tension * normal, std::sqrt(tension * tension + shear.squaredNorm() / (kShear * kShear))};
}

/// Strength of what holds two pieces, Pa: a Weibull variable with mean `strength`. The same on any lattice.
inline float strength_of(const FractureMaterial& material, Index piece, Index other) {
    if (!(material.scatter > 0)) return float(material.strength);
    const double shape = material.scatter / 1.2; // 1 over Weibull's modulus: 1.2 / m is the relative deviation, about
    const double u = random_unit(material.seed, (std::uint64_t{piece} << 32) + other);
    return float(material.strength * math::pow(-math::log1p(-u), shape) / math::gamma(1 + shape));
}

/// J/m^2 that a crack takes to grow: where matter yields first, that as well.
inline double front_energy(const FractureMaterial& material, const Material& matter) {
    const bool tears = matter.is_plastic() && std::isfinite(material.plastic_opening);
    return material.energy + (tears ? matter.yield_stress * material.plastic_opening : 0);
}
/// Pa: of what is next to a crack. Where the lattice cannot resolve the stress there, energy decides.
inline float strength_at_front(float strength, double front_energy, double young_modulus, double spacing) {
    return std::min(strength, float(kFront * std::sqrt(young_modulus * front_energy / spacing)));
}

/// Two copies of a corner that have let go: traction falls from `pull` to nothing at the opening 2 G / |pull|.
struct Cohesion {
    Vec3f pull = Vec3f::Zero(); ///< Pa, on the first piece when it let go; zero: it lets go at once
    float opening = 0;          ///< m, the widest so far

    float last_opening(float energy) const { return 2 * energy / std::max(pull.norm(), 1e-30f); } ///< m
    bool has_ended(float energy) const { return pull.isZero(0) || opening >= last_opening(energy); }
    /// J/m^2 that is spent for good.
    float spent(float energy) const {
        if (pull.isZero(0)) return 0;
        const float part = std::min(opening / last_opening(energy), 1.0f);
        return energy * part; // of G (2 part - part^2), what is left in the spring is G part (1 - part)
    }
};

/// N/m of a spring, and how far it is from slack, m.
struct CohesionSpring {
    float stiffness;
    Vec3f stretch;
};
/// The force on the first copy is stiffness times stretch; `between` goes from it to the second. Stiffness is bounded
/// by `stiffest`: openings below `least` = area |pull| / stiffest count as that, along the pull, so that the force
/// begins as the traction was.
inline CohesionSpring cohesion_spring(const Cohesion& cohesion, const Vec3f& between, float area, float energy,
                                      float stiffest) {
    const float strength = cohesion.pull.norm();
    const float least = area * strength / stiffest;
    const float now = between.norm(), widest = std::max(cohesion.opening, now);
    const float left = std::max(1 - widest / cohesion.last_opening(energy), 0.0f);
    CohesionSpring spring{area * strength * left / std::max(widest, least), between};
    if (now < least) spring.stretch += (least - now) / strength * cohesion.pull;
    return spring;
}

} // namespace filigree::crack_law
