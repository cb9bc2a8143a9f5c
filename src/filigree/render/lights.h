// Where light comes from in a picture, pass by pass, and how a box is seen from there.
#pragma once

#include "filigree/types.h"

#include <array>

namespace filigree {

inline constexpr double kGroundSide = 2.5; ///< half of the ground's, in diagonals of the scene

/// The i-th point of a sequence that fills the unit square evenly whatever its length [Roberts 2018].
std::array<double, 2> evenly(unsigned i, double shift);

/// Two directions that make a right-handed basis with the unit vector n.
std::array<Vec3d, 2> tangents(const Vec3d& n);

std::array<Vec3d, 8> corners_of(const Box& box);

/// Where light comes from, as the viewer sees it: key from the upper left, sky from above and behind the viewer. All of
/// it turns with the camera, so that the frames of a turntable are lit alike.
class Lights {
public:
    /// back: from the scene to the viewer. All three of length one.
    Lights(const Vec3d& back, const Vec3d& camera_right, const Vec3d& up);
    const Vec3d& fill() const { return fill_; }
    const Vec3d& key() const { return key_; } ///< the middle
    const Vec3d& sky() const { return sky_; }
    /// The i-th point of the key light.
    Vec3d key(unsigned i) const;
    /// The i-th direction, evenly over the hemisphere around the sky's middle.
    Vec3d sky(unsigned i) const;

private:
    Vec3d around(const Vec3d& axis, double along, double across, double angle) const;

    Vec3d right_, key_, sky_, fill_;
};

/// Parallel light from a direction over a box: to clip space, and the size of a texel.
struct LightView {
    Eigen::Matrix4d matrix;
    double texel;

    LightView(const Vec3d& direction, const Box& box, int size);
    Eigen::Matrix4d to_texture() const;
};

} // namespace filigree
