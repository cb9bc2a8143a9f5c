// Deformations drawn at random, to judge what was calibrated on others.
#pragma once

#include "filigree/pose.h"

#include <string>

namespace filigree::bench {

struct RandomWarp {
    std::string kind; ///< bend, twist, taper, swell, smooth or scribble
    std::unique_ptr<SpaceWarp> warp;
};

/// One of six kinds, along an axis and of a strength drawn from the seed: bends of 10 to 200 degrees, twists of 10 to
/// 300, tapers to 0.3 to 2, swells (a place that grows up to twofold or shrinks to half, and dies away over a tenth to
/// four tenths of the diagonal), smooth random displacements of 2 to 30 % of the diagonal, and scribbles (a cubic
/// interpolant of twelve random points, each moved anywhere by up to 5 %).
RandomWarp random_warp(const Box& box, std::uint64_t seed);

} // namespace filigree::bench
