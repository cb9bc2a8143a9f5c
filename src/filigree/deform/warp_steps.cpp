#include "filigree/deform/warp_steps.h"

namespace filigree {

namespace {

bool is_factor(WarpKind kind) {
    return kind == WarpKind::stretch || kind == WarpKind::squeeze || kind == WarpKind::taper;
}

std::unique_ptr<SpaceWarp> make_step(const WarpStep& step, const Box& box, Axis axis, std::uint64_t seed) {
    switch (step.kind) {
    case WarpKind::stretch:
        return make_stretch(box, axis, step.amount).value();
    case WarpKind::squeeze:
        return make_squeeze(box, axis, step.amount).value();
    case WarpKind::bend:
        return make_bend(box, axis, step.amount);
    case WarpKind::twist:
        return make_twist(box, axis, step.amount);
    case WarpKind::taper:
        return make_taper(box, axis, step.amount).value();
    case WarpKind::random:
        break;
    }
    return make_smooth_random(box, step.amount, seed);
}

} // namespace

WarpStep WarpStep::part(double fraction) const {
    if (fraction == 1) return *this; // to the bit
    const double nothing = is_factor(kind) ? 1 : 0;
    return {kind, nothing + fraction * (amount - nothing)};
}

std::unique_ptr<SpaceWarp> make_warp(std::span<const WarpStep> steps, const Box& box, Axis axis, std::uint64_t seed) {
    std::vector<std::unique_ptr<SpaceWarp>> warps;
    for (const WarpStep& step : steps) warps.push_back(make_step(step, box, axis, seed));
    return make_chain(std::move(warps));
}

std::unique_ptr<SpaceWarp> make_warp(const Warps& warps, const Box& rest_box) {
    if (warps.none() || rest_box.empty()) return nullptr;
    std::vector<WarpStep> steps;
    if (warps.stretch != 1) steps.push_back({WarpKind::stretch, warps.stretch});
    if (warps.squeeze != 1) steps.push_back({WarpKind::squeeze, warps.squeeze});
    if (warps.bend != 0) steps.push_back({WarpKind::bend, warps.bend});
    if (warps.twist != 0) steps.push_back({WarpKind::twist, warps.twist});
    if (warps.taper != 1) steps.push_back({WarpKind::taper, warps.taper});
    return make_warp(steps, rest_box, warps.axis);
}

} // namespace filigree
