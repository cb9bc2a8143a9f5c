// Warps as settings: a kind and an amount each.
#pragma once

#include "filigree/pose.h"

#include <memory>
#include <span>
#include <vector>

namespace filigree {

/// As make_stretch and the others of space_warp.h.
enum class WarpKind { stretch, squeeze, bend, twist, taper, random };

struct WarpStep {
    WarpKind kind;
    double amount; ///< a factor, degrees, or a fraction of the diagonal

    /// On the way from nothing (0) to all of it (1).
    WarpStep part(double fraction) const;
};

/// The steps one after the other, all over one box and along one axis. seed: of those at random. Amounts as the make_
/// functions of space_warp.h take them.
std::unique_ptr<SpaceWarp> make_warp(std::span<const WarpStep> steps, const Box& box, Axis axis,
                                     std::uint64_t seed = 1);

/// Five of them, one after the other in this order, about a mesh's box at rest: what sliders set.
struct Warps {
    Axis axis = Axis::y;
    double stretch = 1, squeeze = 1; ///< factors
    double bend = 0, twist = 0;      ///< degrees
    double taper = 1;                ///< factor
    bool operator==(const Warps&) const = default;
    bool none() const { return stretch == 1 && squeeze == 1 && bend == 0 && twist == 0 && taper == 1; }

    // How far they go by sliders and by handles in a view.
    static constexpr double kLeastFactor = 0.25, kMostFactor = 4; ///< stretch, squeeze, taper
    static constexpr double kMostBend = 270, kMostTwist = 720;    ///< degrees, either way
};

/// Null where there is nothing to do, or no box.
std::unique_ptr<SpaceWarp> make_warp(const Warps& warps, const Box& rest_box);

} // namespace filigree
