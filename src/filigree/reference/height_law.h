// What happens to detail height when its surroundings change size.
#pragma once

#include "filigree/reference.h"

#include <array>
#include <optional>
#include <string_view>

namespace filigree {

/// `inverse` and `volume` are held in [1 / kMaxHeightScale, kMaxHeightScale]: without it they have no bound as the
/// surroundings collapse (260 diagonals were measured). `proportional` needs none: it shrinks with its surroundings.
inline constexpr float kMaxHeightScale = 4;

inline constexpr std::array<std::string_view, 4> kHeightLawNames = {"keep", "inverse", "proportional", "volume"};

inline std::string_view height_law_name(HeightLaw law) { return kHeightLawNames[static_cast<std::size_t>(law)]; }
inline std::optional<HeightLaw> height_law_from_name(std::string_view name) {
    for (std::size_t i = 0; i < kHeightLawNames.size(); ++i)
        if (kHeightLawNames[i] == name) return static_cast<HeightLaw>(i);
    return std::nullopt;
}

/// s of a law from old and new area; `inverse` takes the square root of the area as its width.
double height_law_scale(HeightLaw law, double rest_area, double area);

} // namespace filigree
