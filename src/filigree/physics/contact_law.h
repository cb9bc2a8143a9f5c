// The formulas of contact, shared by explicit steps and descent. Private to the layer.
#pragma once

#include "filigree/physics/body_state.h"
#include "filigree/physics/world.h"

#include <algorithm>

namespace filigree::contact_law {

inline constexpr float kTangentialStiffness = 0.5f; ///< of friction's spring, as a part of the normal stiffness
inline constexpr float kDeepest = 0.75f;            ///< spacings under a surface that a penalty is trusted with

/// Part of the normal force that is left while a point moves away at `speed` (m/s): e^2 of it, so that a hard point
/// leaves with e times the speed it came with. Smooth about zero, where resting points tremble.
inline float unloading(double restitution, float speed, float smooth_speed) {
    return 1 - (1 - float(restitution * restitution)) * std::clamp(speed / smooth_speed, 0.0f, 1.0f);
}

/// m/s; dt: of the substep.
inline float smooth_speed(const World& world, float dt) { return 0.02f + 4 * dt * float(world.gravity.norm()); }

/// N/m between two balls; a third, as a ball may touch several.
inline float pair_stiffness(const BodyState& a, Index point_of_a, const BodyState& b, Index point_of_b) {
    return std::min(a.surface_stiffness[point_of_a], b.surface_stiffness[point_of_b]) / 3;
}

inline Vec3f along_surface(const Vec3f& v, const Vec3f& normal) { return v - v.dot(normal) * normal; }

/// `pull` shortened to Coulomb's limit.
inline Vec3f limited(const Vec3f& pull, float limit) {
    const float length = pull.norm();
    return length > limit ? Vec3f(pull * (limit / length)) : pull;
}

} // namespace filigree::contact_law
