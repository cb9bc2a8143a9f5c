// The fem material: what cell_kernel computes, behind the interface of all materials; the energy in double.
#include "filigree/core/parallel_for.h"
#include "filigree/physics/body.h"
#include "filigree/physics/fem/cell_kernel.h"

#include <cmath>

namespace filigree {

namespace {

/// The energy of one cell, J, from its corners in doubles.
double cell_energy(const cell_kernel::CellMaterial& m, const std::array<Vec3d, 8>& corners, double fraction) {
    std::array<Vec3d, 8> X = corners;
    cell_kernel::transform_corners(X);
    const double h = m.spacing, size = 4 * h;
    const double I =
        (X[1].squaredNorm() + X[2].squaredNorm() + X[4].squaredNorm() +
         (X[3].squaredNorm() + X[5].squaredNorm() + X[6].squaredNorm()) * (2.0 / 3.0) + X[7].squaredNorm() / 3.0) /
        (size * size);
    const double J = X[1].dot(X[2].cross(X[4])) / (size * size * size);
    const double shear = m.shear, bulk = m.bulk, g = m.rest_ratio;
    // (J - g)^2 - (1 - g)^2 and log(I + 1) - log(4) as products: a body near rest has an energy, not rounding.
    return fraction * h * h * h *
           (0.5 * shear * ((I - 3) - std::log1p((I - 3) / 4)) + 0.5 * bulk * (J - 1) * (J + 1 - 2 * g));
}

/// Adds one cell's force on one of its corners, and the block there.
void add_corner_block(const cell_kernel::CellMaterial& m, const std::array<Vec3f, 8>& corners, float fraction,
                      int corner, Vec3f& force, Symmetric3& block) {
    const Vec3f base = corners[0];
    std::array<Vec3f, 8> X;
    for (int c = 0; c < 8; ++c) X[c] = corners[c] - base; // so that a body far away loses no digits
    cell_kernel::transform_corners(X);
    const float size = 4 * m.spacing, volume = fraction * m.spacing * m.spacing * m.spacing;
    constexpr float kShare[8] = {0, 1, 1, 2.0f / 3, 1, 2.0f / 3, 2.0f / 3, 1.0f / 3};
    const auto sign = [&](int sum) { // of the corner in a sum
        float s = 1;
        for (int bit = 1; bit < 8; bit *= 2)
            if (sum & bit && !(corner & bit)) s = -s;
        return s;
    };
    float I = 0;
    Vec3f by_I = Vec3f::Zero(); // half of dI/dx
    for (int sum = 1; sum < 8; ++sum) {
        I += kShare[sum] * X[sum].squaredNorm() / (size * size);
        by_I += kShare[sum] * sign(sum) / (size * size) * X[sum];
    }
    const Vec3f cofactors[3] = {X[2].cross(X[4]), X[4].cross(X[1]), X[1].cross(X[2])};
    const float cube = size * size * size, J = X[1].dot(cofactors[0]) / cube;
    const Vec3f by_J = (sign(1) * cofactors[0] + sign(2) * cofactors[1] + sign(4) * cofactors[2]) / cube;
    const float shear = m.shear * I / (I + 1);
    force -= volume * (shear * by_I + m.bulk * (J - m.rest_ratio) * by_J);
    block.add_scaled_identity(volume * shear * (16.0f / 3) / (size * size));
    block.add_outer(by_I, volume * 2 * m.shear / ((I + 1) * (I + 1)));
    block.add_outer(by_J, volume * m.bulk);
}

class CellElasticity final : public Elasticity {
public:
    explicit CellElasticity(const Body& body) : body_(body), plan_(cell_kernel::make_plan(body)) {}

    ElasticReport forces(const Vectors& positions, Vectors& forces, const RunContext& context) override {
        return cell_kernel::forces(plan_, positions, forces, sums_, context);
    }

    void sweep(Vectors& positions, const Descent& descent, const RunContext& context) override {
        cell_kernel::sweep(plan_, positions, descent, context);
    }

    void prepare_blocks() override {
        const Cells& cells = body_.cells;
        cells_at_.assign(cells.corners.size(),
                         {kNoIndex, kNoIndex, kNoIndex, kNoIndex, kNoIndex, kNoIndex, kNoIndex, kNoIndex});
        for (Index cell = 0; cell < cells.cells.size(); ++cell)
            for (int corner = 0; corner < 8; ++corner) cells_at_[cells.cell_corners[cell][corner]][corner] = cell;
    }

    void add_block(Index particle, const Vectors& positions, Vec3f& force, Symmetric3& block) const override {
        const Cells& cells = body_.cells;
        for (int corner = 0; corner < 8; ++corner) {
            const Index cell = cells_at_[particle][corner];
            if (cell == kNoIndex) continue;
            std::array<Vec3f, 8> corners;
            for (int c = 0; c < 8; ++c) corners[c] = positions[cells.cell_corners[cell][c]];
            add_corner_block(plan_.material, corners, cells.fraction[cell], corner, force, block);
        }
    }

    double energy(const Vectors& positions, const RunContext& context) const override {
        const Cells& cells = body_.cells;
        constexpr std::size_t kPiece = 1024;
        std::vector<double> sums((cells.cells.size() + kPiece - 1) / kPiece); // a piece each, added in order
        parallel_for(context, cells.cells.size(), kPiece, [&](std::size_t begin, std::size_t end) {
            double sum = 0;
            std::array<Vec3d, 8> corners;
            for (std::size_t cell = begin; cell < end; ++cell) {
                for (int c = 0; c < 8; ++c) corners[c] = positions[cells.cell_corners[cell][c]].cast<double>();
                sum += cell_energy(plan_.material, corners, cells.fraction[cell]);
            }
            sums[begin / kPiece] = sum;
        });
        double sum = 0;
        for (const double piece : sums) sum += piece;
        return sum;
    }

    void gradients(const Vectors& positions, std::span<Mat3f> gradients, const RunContext& context) const override {
        corner_gradients(body_.cells, positions, gradients, context);
    }

private:
    const Body& body_;
    cell_kernel::Plan plan_;
    cell_kernel::Sums sums_;
    std::vector<std::array<Index, 8>>
        cells_at_; ///< of each corner, the cell in which it is the n-th; by prepare_blocks
};

} // namespace

std::unique_ptr<Elasticity> make_cell_elasticity(const Body& body, const RunContext&) {
    return std::make_unique<CellElasticity>(body);
}

} // namespace filigree
