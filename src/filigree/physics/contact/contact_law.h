// The formulas of contact. Private to the layer.
#pragma once

#include "filigree/physics/body/body_state.h"
#include "filigree/physics/world.h"

#include <algorithm>

namespace filigree::contact_law {

inline constexpr float kTangentialStiffness = 0.5f; ///< of friction's spring, as a part of the normal stiffness
inline constexpr float kDeepest = 0.75f;            ///< spacings under a surface that a penalty is trusted with

/// Where weight presses a point deep, restitution would damp it faster than a substep can follow, and shake it: what is
/// lost then counts as from a higher speed on. With 0 a stack of five walks and falls
/// (MatterContact.ASquareStackStands).
inline constexpr float kDampingPart = 0.2f;
inline constexpr float kSlidingPart = 0.25f; ///< of smooth_speed: a slower point may stick

/// Part of the normal force that is left while a point moves away at `speed` (m/s): e^2 of it, so that a hard point
/// leaves with e times the speed it came with. Smooth about zero, where resting points tremble.
inline float unloading(double restitution, float speed, float smooth_speed) {
    return 1 - (1 - float(restitution * restitution)) * std::clamp(speed / smooth_speed, 0.0f, 1.0f);
}

/// m/s; dt: of the substep.
inline float smooth_speed(const World& world, float dt) { return 0.02f + 4 * dt * float(world.gravity.norm()); }

inline Vec3f along_surface(const Vec3f& v, const Vec3f& normal) { return v - v.dot(normal) * normal; }

/// `pull` shortened to Coulomb's limit.
inline Vec3f limited(const Vec3f& pull, float limit) {
    const float length = pull.norm();
    return length > limit ? Vec3f(pull * (limit / length)) : pull;
}

/// A point that touches something.
struct Touch {
    Vec3f normal;   ///< unit, out of what it touches
    Vec3f velocity; ///< m/s, beside the matter it touches
    float depth;    ///< m, above 0
    float stiffness, friction, restitution;
    float squared_frequency; ///< bound on stiffness by the mass it moves, 1/s^2
};

/// How friction holds a touching point: by a spring to the place where it landed, up to Coulomb's limit [Cundall
/// 1979]. Where the anchor lies is kept in the axes of what is touched.
struct Grasp {
    bool holds = false;  ///< there is an anchor
    bool slides = false; ///< the spring is at its limit, also while the load grows
};

/// The force on the point. `offset`: of the point from its anchor, along the surface; becomes shorter or longer where
/// the point slides, and the anchor then has to be moved. A point that lands while it slides rubs by the whole of its
/// load from the first: a spring that had to be stretched first would lack force, the more the more often it lands.
inline Vec3f touch_force(const Touch& touch, Vec3f& offset, Grasp& grasp, float dt, float smooth_speed) {
    const Vec3f slip = along_surface(touch.velocity, touch.normal);
    const float lost = 1 - touch.restitution * touch.restitution;
    const float slow = smooth_speed + kDampingPart * lost * touch.depth * touch.squared_frequency * dt;
    const float push =
        touch.stiffness * touch.depth * unloading(touch.restitution, touch.velocity.dot(touch.normal), slow);
    // A point that sticks may pull up to friction times the full penalty. The unloading does not weaken that limit: a
    // trembling foot would slip at every rise. A point that slides rubs by the weakened push.
    const float grip = kTangentialStiffness * touch.stiffness, hold = touch.friction * touch.stiffness * touch.depth;
    const float slowest = kSlidingPart * smooth_speed, speed = slip.norm();
    if (!grasp.holds) {
        grasp = {true, speed > slowest};
        offset = Vec3f::Zero();
        if (grasp.slides) offset = hold / grip / speed * slip;
    } else if (grasp.slides) {
        const float length = offset.norm();
        grasp.slides = length > 0 && slip.dot(offset) > slowest * length;
        if (grasp.slides) offset *= hold / grip / length;
    }
    const float stretch = grip * offset.norm();
    const Vec3f wanted = -grip * (offset + 2 * dt * slip);
    if (stretch > hold) {
        grasp.slides = true;
        offset *= hold / stretch;
    }
    return push * touch.normal + limited(wanted, grasp.slides ? touch.friction * push : hold);
}

} // namespace filigree::contact_law
