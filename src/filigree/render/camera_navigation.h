// Moving a camera by a pointer: zoom about a point, the way to another camera, what a pixel is worth and points at.
#pragma once

#include "filigree/render.h"

#include <optional>

namespace filigree {

/// Size of a picture, or of a part of it, in pixels of any kind.
struct PictureSize {
    double width = 1, height = 1;
    double aspect() const { return width / height; }
};

/// `factor` times as large; what is seen at the point (from the top left) at the target's distance stays there.
Camera zoomed_about(const Camera& camera, double factor, double x, double y, const PictureSize& size);

/// On the way from one camera to another, t from 0 to 1: about the target, at an even pace to the eye.
Camera camera_between(const Camera& from, const Camera& to, double t);

/// Pixels that a model unit has at a point of the world; 0 where the camera does not see it.
double pixels_a_unit(const Camera& camera, const Vec3d& world, const PictureSize& size);
/// The most that it has anywhere in a box; infinite when the eye is in it.
double most_pixels_a_unit(const Camera& camera, const Box& box, const PictureSize& size);

/// Where the ray through a pixel meets the plane through a point that is parallel to the picture.
Vec3d point_in_plane(const Camera& camera, const Vec3d& through, double x, double y, const PictureSize& size);
/// The point of the line (through a point along a unit direction) that is nearest to the ray through a pixel, as a
/// distance along the direction; none where the line points into the picture.
std::optional<double> point_on_line(const Camera& camera, const Vec3d& through, const Vec3d& along, double x, double y,
                                    const PictureSize& size);

} // namespace filigree
