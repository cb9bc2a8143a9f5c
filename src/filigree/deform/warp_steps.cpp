#include "filigree/deform/warp_steps.h"

#include <algorithm>
#include <array>

namespace filigree {

namespace {

constexpr std::array kWarps = {
    WarpInfo{WarpKind::stretch, "stretch", true, "Scale along the axis by this factor", &Warps::stretch,
             Warps::kMostFactor, 0,
             [](const Box& box, Axis axis, double amount, std::uint64_t) {
                 return make_stretch(box, axis, amount).value();
             }},
    WarpInfo{WarpKind::squeeze, "squeeze", true,
             "Scale along the axis by this factor, and across it so that the volume stays", &Warps::squeeze,
             Warps::kMostFactor, 0,
             [](const Box& box, Axis axis, double amount, std::uint64_t) {
                 return make_squeeze(box, axis, amount).value();
             }},
    WarpInfo{WarpKind::bend, "bend", false, "Bend the axis into an arc of this many degrees", &Warps::bend,
             Warps::kMostBend, 1,
             [](const Box& box, Axis axis, double amount, std::uint64_t) { return make_bend(box, axis, amount); }},
    WarpInfo{WarpKind::twist, "twist", false, "Twist about the axis: this many degrees between the two ends",
             &Warps::twist, Warps::kMostTwist, 5,
             [](const Box& box, Axis axis, double amount, std::uint64_t) { return make_twist(box, axis, amount); }},
    WarpInfo{
        WarpKind::taper, "taper", true, "Scale cross-sections, from 1 at the near end to this factor at the far end",
        &Warps::taper, Warps::kMostFactor, 0,
        [](const Box& box, Axis axis, double amount, std::uint64_t) { return make_taper(box, axis, amount).value(); }},
    WarpInfo{
        WarpKind::random, "random", false, "Smooth random displacement of up to this fraction of the diagonal", nullptr,
        0, 0,
        [](const Box& box, Axis, double amount, std::uint64_t seed) { return make_smooth_random(box, amount, seed); }},
};

const WarpInfo& info_of(WarpKind kind) { return kWarps[static_cast<std::size_t>(kind)]; }

} // namespace

std::span<const WarpInfo> warp_infos() { return kWarps; }

bool Warps::none() const {
    return std::ranges::all_of(kWarps, [this](const WarpInfo& info) {
        return info.amount == nullptr || this->*info.amount == info.nothing();
    });
}

WarpStep WarpStep::part(double fraction) const {
    if (fraction == 1) return *this; // to the bit
    const double nothing = info_of(kind).nothing();
    return {kind, nothing + fraction * (amount - nothing)};
}

std::unique_ptr<SpaceWarp> make_warp(std::span<const WarpStep> steps, const Box& box, Axis axis, std::uint64_t seed) {
    std::vector<std::unique_ptr<SpaceWarp>> warps;
    for (const WarpStep& step : steps) warps.push_back(info_of(step.kind).make(box, axis, step.amount, seed));
    return make_chain(std::move(warps));
}

std::unique_ptr<SpaceWarp> make_warp(const Warps& warps, const Box& rest_box) {
    if (warps.none() || rest_box.empty()) return nullptr;
    std::vector<WarpStep> steps;
    for (const WarpInfo& info : kWarps)
        if (info.amount != nullptr && warps.*info.amount != info.nothing())
            steps.push_back({info.kind, warps.*info.amount});
    return make_warp(steps, rest_box, warps.axis);
}

} // namespace filigree
