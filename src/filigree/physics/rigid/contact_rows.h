// Contact points as a solver sees them, in registers of four floats. Private to the layer.
#pragma once

#include "filigree/core/lanes.h"
#include "filigree/types.h"

#include <algorithm>
#include <cmath>

namespace filigree {

/// What impulses have changed of a body's motion since they began to be solved: small numbers, so that floats do.
struct MoverChange {
    using Four = LaneTypes<4>::Float; ///< x, y, z and 0
    Four velocity = {}, spin = {};    ///< m/s, 1/s
};

/// A contact point between two movers. Directions are the normal and two tangents.
struct ContactRow {
    using Four = LaneTypes<4>::Float;
    /// How an impulse of 1 along a direction moves a body: m/s and 1/s.
    struct Answer {
        Four arm[3];  ///< arm x direction: the speed along it is direction . velocity + arm[k] . spin
        Four spin[3]; ///< of an impulse
        float speed;  ///< of an impulse: m/s along the direction, but for the spin
    };
    Four direction[3];
    Answer body, other;
    float mass[3];                        ///< kg, that an impulse there moves; in friction's order after the normal's
    float beside[2];                      ///< m/s along the tangents of an impulse of 1 along the normal
    float start[3];                       ///< m/s, of the body beside the other, before impulses
    float impulse[3];                     ///< N s, in all
    float target;                         ///< m/s, along the normal: at least
    float friction, separation, approach; ///< approach: m/s along the normal before loads; below 0 they come nearer
    Index movers[2], point;

    /// m/s along the three directions, of the body beside the other.
    FILIGREE_INLINE Four speeds(const MoverChange& a, const MoverChange& b) const {
        const Four between = a.velocity - b.velocity;
        Four sums[3];
        for (int k = 0; k < 3; ++k) sums[k] = direction[k] * between + body.arm[k] * a.spin - other.arm[k] * b.spin;
        const Four pairs = __builtin_shufflevector(sums[0], sums[1], 0, 4, 1, 5) +
                           __builtin_shufflevector(sums[0], sums[1], 2, 6, 3, 7);
        const Four last = sums[2] + __builtin_shufflevector(sums[2], sums[2], 2, 3, 0, 1);
        const Four start_of = {start[0], start[1], start[2], 0};
        return __builtin_shufflevector(pairs, last, 0, 1, 4, 4) + __builtin_shufflevector(pairs, last, 2, 3, 5, 5) +
               start_of;
    }
    FILIGREE_INLINE void push(MoverChange& a, MoverChange& b, float normal, float along, float across) const {
        const Four way = normal * direction[0] + along * direction[1] + across * direction[2];
        a.velocity += body.speed * way;
        b.velocity -= other.speed * way;
        a.spin += normal * body.spin[0] + along * body.spin[1] + across * body.spin[2];
        b.spin -= normal * other.spin[0] + along * other.spin[1] + across * other.spin[2];
    }
    /// Coulomb's law at one point. Returns by how much the velocity along a direction changed, m/s.
    FILIGREE_INLINE float solve(MoverChange& a, MoverChange& b) {
        const Four speed = speeds(a, b);
        const float pushed = std::max(0.0f, impulse[0] + mass[0] * (target - speed[0])), more = pushed - impulse[0];
        if (pushed == 0 && more == 0) return 0;
        impulse[0] = pushed;
        float along = impulse[1] - mass[1] * (speed[1] + more * beside[0]);
        float across = impulse[2] - mass[2] * (speed[2] + more * beside[1]);
        const float limit = friction * pushed, squared = along * along + across * across;
        if (squared > limit * limit) {
            const float shorter = limit / std::sqrt(squared);
            along *= shorter;
            across *= shorter;
        }
        const float more_along = along - impulse[1], more_across = across - impulse[2];
        impulse[1] = along;
        impulse[2] = across;
        push(a, b, more, more_along, more_across);
        return std::max({std::abs(more) / mass[0], std::abs(more_along) / mass[1], std::abs(more_across) / mass[2]});
    }
};

} // namespace filigree
