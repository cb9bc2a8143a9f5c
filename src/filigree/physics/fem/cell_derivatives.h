// The energy of a fem body with its first and second derivatives, in double: for solvers of others (inverse problems,
// equilibria, modes). cell_kernel.h has the energy; steps use cell_kernel::forces, which are the same to float
// precision.
#pragma once

#include "filigree/context.h"
#include "filigree/physics/body.h"

#include <array>
#include <span>
#include <vector>

namespace filigree {

/// Derivatives of the elastic energy of the cells by the positions of their corners. positions: one a particle, m,
/// finite. Without plastic flow and damping: the body as it is at rest. Everything is proportional to Young's modulus.
class CellDerivatives {
public:
    /// The body must outlive it. Errors: unsuitable (not of the model fem).
    static Result<CellDerivatives> create(const Body& body);

    /// Of each cell, J; 0 at rest. Cost O(cells).
    std::vector<double> energies(std::span<const Vec3d> positions, const RunContext& context) const;
    /// dE / dx, N, one a particle: minus the elastic forces. Same bytes for any thread count. Cost O(cells).
    std::vector<Vec3d> gradient(std::span<const Vec3d> positions, const RunContext& context) const;
    /// The second derivative times `directions` (one a particle). Where a cell is crushed or bent beyond a limit the
    /// energy has no second derivative at one place; that of one side counts. Cost O(cells).
    std::vector<Vec3d> hessian_product(std::span<const Vec3d> positions, std::span<const Vec3d> directions,
                                       const RunContext& context) const;
    /// The second derivative of each cell's energy: rows and columns 3 c + k, corner c (as in Cells::cell_corners),
    /// coordinate k; symmetric. Cost: 24 products.
    using CellBlock = std::array<double, 24 * 24>;
    std::vector<CellBlock> hessian_blocks(std::span<const Vec3d> positions, const RunContext& context) const;

private:
    explicit CellDerivatives(const Body& body);
    const Body* body_;
    std::vector<Index> first_of_;                 ///< where each corner's cells begin in at_corner_, and the end
    std::vector<std::array<Index, 2>> at_corner_; ///< cell, and which of its corners
    template <class Term>
    std::vector<Vec3d> sum_at_corners(const RunContext& context, const Term& term) const;
};

} // namespace filigree
