// Maximum weighted matching of a triangle mesh's dual graph.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

namespace filigree {

/// The triangle that each triangle is paired with, or kNoIndex: of all matchings with the most pairs, one with the
/// greatest sum of weights. Half-edge 3 t + i belongs to triangle t.
/// opposite: 3 F twins, kNoIndex on borders. weights: 3 F, alike on twins, 0 to 1; below 0: this pair must not be.
/// Empty when is_cancelled, which is asked now and then, says so.
/// Method: [Edmonds 1965], as LEMON has it. Cost O(F^2 log F) at worst, near-linear on surfaces.
/// Plain vectors of plain numbers, as LEMON's headers keep this file to C++17.
std::vector<std::uint32_t> match_triangles(
    const std::vector<std::uint32_t>& opposite, const std::vector<double>& weights,
    const std::function<bool()>& is_cancelled = [] { return false; });

} // namespace filigree
