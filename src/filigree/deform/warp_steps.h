// Warps as settings: a kind and an amount each.
#pragma once

#include "filigree/pose.h"

#include <memory>
#include <span>
#include <string_view>
#include <vector>

namespace filigree {

/// stretch: make_stretch of filigree/pose.h, and so on. random: make_smooth_random.
enum class WarpKind { stretch, squeeze, bend, twist, taper, random };

struct WarpStep {
    WarpKind kind;
    double amount; ///< a factor, degrees, or a fraction of the diagonal

    /// On the way from nothing (0) to all of it (1).
    WarpStep part(double fraction) const;
};

/// The steps one after the other, all over one box and along one axis. seed: for random steps. Amounts have the units
/// and ranges of the make_ functions in filigree/pose.h.
std::unique_ptr<SpaceWarp> make_warp(std::span<const WarpStep> steps, const Box& box, Axis axis,
                                     std::uint64_t seed = 1);

/// One amount for each kind that a slider sets. They act one after the other, in this order, about the box of the mesh
/// at rest.
struct Warps {
    Axis axis = Axis::y;
    double stretch = 1, squeeze = 1; ///< factors
    double bend = 0, twist = 0;      ///< degrees
    double taper = 1;                ///< factor
    bool operator==(const Warps&) const = default;
    bool none() const;

    // The ranges of sliders, and of handles in a view.
    static constexpr double kLeastFactor = 0.25, kMostFactor = 4; ///< stretch, squeeze, taper
    static constexpr double kMostBend = 270, kMostTwist = 720;    ///< degrees, either way
};

/// What programs need to know of a kind.
struct WarpInfo {
    WarpKind kind;
    std::string_view name;   ///< "twist"
    bool is_factor;          ///< a factor above 0, where 1 changes nothing; else any number, where 0 changes nothing
    std::string_view action; ///< "Turn ... by this many degrees": a sentence without its full stop
    double Warps::*amount;   ///< the slider's member; null: the kind has no slider
    double most;             ///< of the slider; its least value is 1 / most for a factor, else -most
    double step;             ///< of the slider, degrees; a factor's slider is logarithmic and has none
    std::unique_ptr<SpaceWarp> (*make)(const Box& box, Axis axis, double amount, std::uint64_t seed);

    double nothing() const { return is_factor ? 1 : 0; }
};

/// The table of kinds, in the order of WarpKind. A new kind is a row of this table.
std::span<const WarpInfo> warp_infos();

/// Null where there is nothing to do, or no box.
std::unique_ptr<SpaceWarp> make_warp(const Warps& warps, const Box& rest_box);

} // namespace filigree
