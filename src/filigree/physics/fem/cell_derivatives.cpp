#include "filigree/physics/fem/cell_derivatives.h"

#include "filigree/core/math.h"
#include "filigree/core/parallel_for.h"
#include "filigree/physics/fem/cell_kernel.h"

#include <algorithm>

namespace filigree {

namespace {

constexpr std::size_t kDerivativeGrain = 256; // cells

using CornerVectors = std::array<Vec3d, 8>;

/// How much |X_m|^2 counts in I.
constexpr std::array<double, 8> kShareOfSum = {0, 1, 1, 2.0 / 3, 1, 2.0 / 3, 2.0 / 3, 1.0 / 3};
constexpr bool bends(std::size_t m) { return m != 1 && m != 2 && m != 4; }

CornerVectors sums_of(const CornerVectors& corners) {
    CornerVectors X = corners;
    cell_kernel::transform_corners(X);
    return X;
}

/// From derivatives by X_m to those by the corners: corner c has X_m's sign -1 for each bit of m that c lacks.
CornerVectors by_corners(CornerVectors P) {
    for (std::size_t bit = 1; bit < 8; bit *= 2)
        for (std::size_t i = 0; i < 8; ++i)
            if (!(i & bit)) {
                const Vec3d even = P[i], odd = P[i | bit];
                P[i] = even - odd;
                P[i | bit] = even + odd;
            }
    return P;
}

/// A cell's energy over its factors, and derivatives by I, by the part of I that is bending, and by J.
struct CellLaw {
    double shear, bulk;                                   ///< J: times the occupied volume
    double size;                                          ///< 4 h, m
    double energy = 0, by_I = 0, by_I_bent = 0, by_J = 0; ///< J
    double by_I_I = 0, by_I_bent_bent = 0, by_J_J = 0;
    std::array<Vec3d, 3> cofactor; ///< of X_1, X_2, X_4

    /// stiffness: times the material's.
    CellLaw(const cell_kernel::CellMaterial& m, const CornerVectors& X, float filled, float stiffness) {
        const double h = m.spacing, volume = double(stiffness) * double(filled) * h * h * h;
        size = 4 * h;
        shear = volume * double(m.shear);
        bulk = volume * double(m.bulk);
        double I_bent = 0, I_linear = 0;
        for (std::size_t k = 1; k < 8; ++k) (bends(k) ? I_bent : I_linear) += kShareOfSum[k] * X[k].squaredNorm();
        I_bent /= size * size;
        const double I = I_linear / (size * size) + I_bent;
        cofactor = {X[2].cross(X[4]), X[4].cross(X[1]), X[1].cross(X[2])};
        const double J = X[1].dot(cofactor[0]) / (size * size * size), g = double(m.rest_ratio);

        energy = shear * (0.5 * ((I - 3) - math::log1p((I - 3) / 4)) + cell_kernel::bent_energy(I_bent)) +
                 bulk * (0.5 * (J - 1) * (J + 1 - 2 * g) + cell_kernel::crush_energy(m, J, filled));
        by_I = shear * 0.5 * I / (I + 1);
        by_I_I = shear * 0.5 / ((I + 1) * (I + 1));
        const double over = std::max(I_bent - double(cell_kernel::kBentFrom), 0.0),
                     most_bent = double(cell_kernel::kBentMost), r = std::min(over, most_bent);
        by_I_bent = shear * double(cell_kernel::kBentStiffness) * 0.5 * r * r;
        by_I_bent_bent = over < most_bent ? shear * double(cell_kernel::kBentStiffness) * r : 0;
        const double hard = double(cell_kernel::crush_stiffness(m, filled)), most = double(cell_kernel::kCrushFrom),
                     crush = std::clamp(most - J, 0.0, most);
        by_J = bulk * ((J - g) - hard * crush * crush);
        by_J_J = bulk * (1 + (J > 0 ? 2 * hard * crush : 0));
    }

    CornerVectors gradient(const CornerVectors& X) const {
        CornerVectors P;
        P[0].setZero();
        for (std::size_t m = 1; m < 8; ++m)
            P[m] = (by_I + (bends(m) ? by_I_bent : 0)) * 2 * kShareOfSum[m] / (size * size) * X[m];
        const double of_volume = by_J / (size * size * size);
        P[1] += of_volume * cofactor[0];
        P[2] += of_volume * cofactor[1];
        P[4] += of_volume * cofactor[2];
        return by_corners(P);
    }

    /// dX: the sums of a direction.
    CornerVectors change(const CornerVectors& X, const CornerVectors& dX) const {
        double dI = 0, dI_bent = 0;
        for (std::size_t m = 1; m < 8; ++m) {
            const double part = 2 * kShareOfSum[m] / (size * size) * X[m].dot(dX[m]);
            dI += part;
            if (bends(m)) dI_bent += part;
        }
        const double size3 = size * size * size;
        const double dJ = (cofactor[0].dot(dX[1]) + cofactor[1].dot(dX[2]) + cofactor[2].dot(dX[4])) / size3;
        CornerVectors P;
        P[0].setZero();
        for (std::size_t m = 1; m < 8; ++m) {
            const double first = by_I + (bends(m) ? by_I_bent : 0),
                         second = by_I_I * dI + (bends(m) ? by_I_bent_bent * dI_bent : 0);
            P[m] = 2 * kShareOfSum[m] / (size * size) * (first * dX[m] + second * X[m]);
        }
        const double first = by_J / size3, second = by_J_J * dJ / size3;
        P[1] += first * (dX[2].cross(X[4]) + X[2].cross(dX[4])) + second * cofactor[0];
        P[2] += first * (dX[4].cross(X[1]) + X[4].cross(dX[1])) + second * cofactor[1];
        P[4] += first * (dX[1].cross(X[2]) + X[1].cross(dX[2])) + second * cofactor[2];
        return by_corners(P);
    }
};

/// Of a cell whose corners have the sums X.
CellLaw law_of(const Body& body, const cell_kernel::CellMaterial& material, std::size_t cell, const CornerVectors& X) {
    const std::vector<float>& stiffness = body.fields.stiffness;
    return {material, X, body.cells.fraction[cell], stiffness.empty() ? 1 : stiffness[cell]};
}

CornerVectors corners_of(const std::array<Index, 8>& corners, std::span<const Vec3d> values) {
    CornerVectors at;
    for (std::size_t c = 0; c < 8; ++c) at[c] = values[corners[c]];
    return at;
}

} // namespace

Result<CellDerivatives> CellDerivatives::create(const Body& body) {
    if (body.material.model != MaterialModel::fem)
        return Error{ErrorCode::unsuitable,
                     "Energies and their derivatives are of bodies of the model fem; this body is "
                     "of another: make it of Material(name, model='fem')."};
    return CellDerivatives(body);
}

CellDerivatives::CellDerivatives(const Body& body) : body_(&body), first_of_(body.rest.size() + 1, 0) {
    const auto& cells = body.cells.cell_corners;
    for (const std::array<Index, 8>& corners : cells)
        for (const Index corner : corners) ++first_of_[corner + 1];
    for (std::size_t k = 1; k < first_of_.size(); ++k) first_of_[k] += first_of_[k - 1];
    at_corner_.resize(first_of_.back());
    std::vector<Index> next(first_of_.begin(), first_of_.end() - 1);
    for (Index cell = 0; cell < cells.size(); ++cell)
        for (Index c = 0; c < 8; ++c) at_corner_[next[cells[cell][c]]++] = {cell, c};
}

/// term(cell): what a cell adds to its corners. Corners add theirs in the order of the cells.
template <class Term>
std::vector<Vec3d> CellDerivatives::sum_at_corners(const RunContext& context, const Term& term) const {
    std::vector<CornerVectors> of_cells(body_->cells.cells.size());
    parallel_for(context, of_cells.size(), kDerivativeGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t cell = begin; cell < end; ++cell) of_cells[cell] = term(cell);
    });
    std::vector<Vec3d> sums(body_->rest.size(), Vec3d::Zero());
    parallel_for(context, sums.size(), 4 * kDerivativeGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            for (Index at = first_of_[i]; at < first_of_[i + 1]; ++at)
                sums[i] += of_cells[at_corner_[at][0]][at_corner_[at][1]];
    });
    return sums;
}

std::vector<double> CellDerivatives::energies(std::span<const Vec3d> positions, const RunContext& context) const {
    const Cells& cells = body_->cells;
    const cell_kernel::CellMaterial material = cell_kernel::cell_material(body_->material, cells.spacing);
    std::vector<double> energies(cells.cells.size());
    parallel_for(context, energies.size(), kDerivativeGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t cell = begin; cell < end; ++cell)
            energies[cell] =
                law_of(*body_, material, cell, sums_of(corners_of(cells.cell_corners[cell], positions))).energy;
    });
    return energies;
}

std::vector<Vec3d> CellDerivatives::gradient(std::span<const Vec3d> positions, const RunContext& context) const {
    const Cells& cells = body_->cells;
    const cell_kernel::CellMaterial material = cell_kernel::cell_material(body_->material, cells.spacing);
    return sum_at_corners(context, [&](std::size_t cell) {
        const CornerVectors X = sums_of(corners_of(cells.cell_corners[cell], positions));
        return law_of(*body_, material, cell, X).gradient(X);
    });
}

std::vector<Vec3d> CellDerivatives::hessian_product(std::span<const Vec3d> positions, std::span<const Vec3d> directions,
                                                    const RunContext& context) const {
    const Cells& cells = body_->cells;
    const cell_kernel::CellMaterial material = cell_kernel::cell_material(body_->material, cells.spacing);
    return sum_at_corners(context, [&](std::size_t cell) {
        const CornerVectors X = sums_of(corners_of(cells.cell_corners[cell], positions));
        const CornerVectors dX = sums_of(corners_of(cells.cell_corners[cell], directions));
        return law_of(*body_, material, cell, X).change(X, dX);
    });
}

std::vector<CellDerivatives::CellBlock> CellDerivatives::hessian_blocks(std::span<const Vec3d> positions,
                                                                        const RunContext& context) const {
    const Cells& cells = body_->cells;
    const cell_kernel::CellMaterial material = cell_kernel::cell_material(body_->material, cells.spacing);
    std::vector<CellBlock> blocks(cells.cells.size());
    parallel_for(context, blocks.size(), kDerivativeGrain / 16, [&](std::size_t begin, std::size_t end) {
        for (std::size_t cell = begin; cell < end; ++cell) {
            const CornerVectors X = sums_of(corners_of(cells.cell_corners[cell], positions));
            const CellLaw law = law_of(*body_, material, cell, X);
            for (std::size_t column = 0; column < 24; ++column) {
                CornerVectors direction;
                direction.fill(Vec3d::Zero());
                direction[column / 3][Eigen::Index(column % 3)] = 1;
                const CornerVectors change = law.change(X, sums_of(direction));
                for (std::size_t row = 0; row < 24; ++row)
                    blocks[cell][24 * row + column] = change[row / 3][Eigen::Index(row % 3)];
            }
        }
    });
    return blocks;
}

} // namespace filigree
