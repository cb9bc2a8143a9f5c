// What touched in a frame.
#pragma once

#include "filigree/core/types.h"

#include <optional>

namespace filigree {

/// Whether two things touched in the frame before as well.
enum class ContactKind { began, stays, ended };

/// Two bodies, or a body and an obstacle, that touched in a frame; or did in the frame before, and no more.
struct ContactEvent {
    ContactKind kind = ContactKind::began;
    std::size_t body = 0;
    std::optional<std::size_t> other;    ///< the other body, of a higher number; or
    std::optional<std::size_t> obstacle; ///< what the body touched
    Vec3d place = Vec3d::Zero();         ///< world, m: the middle of what touched, by how hard; of `ended` the last one
    Vec3d normal = Vec3d::Zero();        ///< unit, towards `body`
    double impulse = 0;                  ///< N s, along the normal, of the whole frame
    double speed = 0;                    ///< m/s, the largest with which points that touch came nearer along the normal
};

} // namespace filigree
