// Which way is up, and where one looks from: words that scenes, pictures and windows share.
#pragma once

#include "filigree/core/types.h"

#include <numbers>

namespace filigree {

/// The usual directions. With y up: front looks along -z, side along -x (from the right), top along -y, iso from the
/// front right above. With z up the same turned so that front looks along +y.
enum class View { front, side, top, iso };
enum class Axis { x, y, z };
using UpAxis = Axis; ///< the one that points up

Vec3d up_vector(UpAxis up);
constexpr double radians(double degrees) { return degrees * std::numbers::pi / 180; }

/// Unit, from the object to the viewer.
Vec3d view_direction(View view, UpAxis up);

} // namespace filigree
