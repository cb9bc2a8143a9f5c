// What cells of a plastic fem body remember, and how they yield. Private to the layer.
#pragma once

#include "filigree/physics/body.h"
#include "filigree/physics/fem/plasticity.h"

#include <array>

namespace filigree {

/// A cell as its eight corners have it: sums X_m of their positions with the signs of a Walsh-Hadamard transform
/// (cell_lanes.h). X_1, X_2, X_4 over 4 h are the columns of its mean gradient; X_3, X_5, X_6, X_7 bend it.
using CellSums = std::array<Vec3f, 8>;
CellSums cell_sums(const Vectors& positions, const std::array<Index, 8>& corners);
inline constexpr std::array<int, 3> kLinearSums = {1, 2, 4};
inline constexpr std::array<int, 4> kBentSums = {3, 5, 6, 7};
/// Of |X_m|^2 / (4 h)^2 in the mean of |F|^2 over the cell.
inline constexpr std::array<float, 8> kSumShares = {0, 1, 1, 2.0f / 3, 1, 2.0f / 3, 2.0f / 3, 1.0f / 3};

/// The shape in which a cell is at rest, once it has yielded.
struct PlasticCell {
    Mat3f inverse = Mat3f::Identity(); ///< of the plastic gradient, of determinant 1: what is elastic is F inverse
    std::array<Vec3f, 4> bent = {Vec3f::Zero(), Vec3f::Zero(), Vec3f::Zero(),
                                 Vec3f::Zero()}; ///< X_3, X_5, X_6, X_7 at rest, by X_1, X_2, X_4

    /// The sums that elasticity sees.
    CellSums elastic(const CellSums& sums) const;
    bool is_sound() const;
};
static_assert(sizeof(PlasticCell) == 21 * sizeof(float), "padding would be saved");

/// Yields as the law says, by the mean square of the strain in the cell, of its mean gradient and of its bending
/// together. size: 4 h, m. Crushed cells (below a tenth of their volume) and those that have flowed to seven times
/// their length keep what they have.
void yield(PlasticCell& cell, const CellSums& sums, float size, const FlowLaw& law);

/// m: how far a layer of the cell has opened for good on a plane with this unit normal at rest; slip counts a half.
float plastic_opening(const PlasticCell& cell, const Vec3f& normal, float spacing);

} // namespace filigree
