// What a film shows over its whole length, so that one camera and one ground hold for all of it.
#pragma once

#include "filigree/render.h"
#include "filigree/types.h"

#include <optional>
#include <span>
#include <vector>

namespace filigree {

/// The places that moments of a film reach: the box of all, and some of their points.
class FilmExtent {
public:
    /// Another moment: points relative to `origin`. Keeps about 20,000 of them.
    void add(std::span<const Vec3f> positions, const Vec3d& origin);
    /// Room for balls of that radius around all points, those to come not included.
    void widen(double radius);

    const Box& box() const { return box_; } ///< of all points, world
    /// For fit_camera; valid until the next call of add.
    CameraPoints points() const { return {points_, origin_.value_or(Vec3d::Zero()), radius_}; }
    /// The same of all that is reached while everything turns about the axis through the box's centre: into
    /// `ring`, which has to stay.
    CameraPoints points_turning(UpAxis axis, std::vector<Vec3f>& ring) const;
    /// A little below the lowest point, so that rounding cuts nothing off.
    double ground_level(UpAxis up) const;

private:
    std::vector<Vec3f> points_;
    std::optional<Vec3d> origin_; ///< the first moment's centre: what is kept are differences from it
    Box box_;
    double radius_ = 0;
};

} // namespace filigree
