#include "filigree/sample/frustum.h"

#include "filigree/core/math.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace filigree {

Frustum frustum_around(const Box& box, const std::optional<Vec3d>& eye) {
    Frustum frustum;
    frustum.target = box.centre();
    frustum.eye = eye.value_or(Vec3d(box.centre() + 2.2 * box.diagonal() * Vec3d(0.25, 0.2, 1).normalized()));
    const double distance = (frustum.eye - frustum.target).norm(), reach = 0.5 * box.diagonal();
    frustum.near = std::max(distance - reach, 1e-3 * distance);
    frustum.far = distance + reach;
    return frustum;
}

Result<std::vector<Vec3d>> frustum_points(const Frustum& frustum) {
    const double count = double(frustum.counts[0]) * double(frustum.counts[1]) * double(frustum.counts[2]);
    const Vec3d forward = frustum.target - frustum.eye;
    const Vec3d across = forward.cross(frustum.up);
    if (!(forward.norm() > 0) || !(across.norm() > 0) || !(0 < frustum.near && frustum.near < frustum.far) ||
        !(frustum.field_of_view_deg > 0 && frustum.field_of_view_deg < 170) || !(frustum.aspect > 0) || !(count >= 1))
        return Error{ErrorCode::usage,
                     "The frustum has no extent: eye and target have to differ, up must not point along "
                     "the view, and 0 < near < far."};
    if (count > double(1 << 28))
        return Error{ErrorCode::usage, "The frustum has more than 2^28 points; take fewer along its sides."};
    const Vec3d back = -forward.normalized(), right = across.normalized(), up = back.cross(right);
    const double half = math::tan(frustum.field_of_view_deg * std::numbers::pi / 360);
    const auto step = [](std::size_t i, std::size_t n) { return (2.0 * double(i) + 1) / double(n) - 1; };
    std::vector<Vec3d> points;
    points.reserve(static_cast<std::size_t>(count));
    for (std::size_t k = 0; k < frustum.counts[2]; ++k) {
        const double depth =
            frustum.near + (frustum.far - frustum.near) * (double(k) + 0.5) / double(frustum.counts[2]);
        for (std::size_t j = 0; j < frustum.counts[1]; ++j)
            for (std::size_t i = 0; i < frustum.counts[0]; ++i)
                points.push_back(
                    frustum.eye - depth * back +
                    depth * half *
                        (frustum.aspect * step(i, frustum.counts[0]) * right + step(j, frustum.counts[1]) * up));
    }
    return points;
}

} // namespace filigree
