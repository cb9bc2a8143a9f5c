// How far the warps go, by numbers in the panel and by handles in the view.
#pragma once

namespace filigree::studio {

constexpr double kLeastFactor = 0.25, kMostFactor = 4; ///< stretch, squeeze, taper
constexpr double kMostBend = 270, kMostTwist = 720;    ///< degrees, either way

} // namespace filigree::studio
