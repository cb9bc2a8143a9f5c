// The report's lattice (2.2): points in a view frustum.
#pragma once

#include "filigree/result.h"
#include "filigree/types.h"

#include <array>
#include <optional>
#include <vector>

namespace filigree {

/// Points in a view frustum, in regular steps across the picture and in depth.
struct Frustum {
    Vec3d eye, target, up = {0, 1, 0};
    double field_of_view_deg = 30, aspect = 1, near = 0, far = 0; ///< near and far: along the view, above 0
    std::array<std::size_t, 3> counts = {};                       ///< across, up, in depth
};

/// A frustum from an eye to the middle of a box, as deep as the box's diagonal around it. eye: unset: in front of the
/// box, a little above and beside. The counts are left to say.
Frustum frustum_around(const Box& box, const std::optional<Vec3d>& eye);

/// The points, by depth, row and column. Errors: usage (no extent, near not below far, more than 2^28 points).
Result<std::vector<Vec3d>> frustum_points(const Frustum& frustum);

} // namespace filigree
