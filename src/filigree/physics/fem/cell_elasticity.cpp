// The fem material: what cell_kernel computes, behind the interface of all materials; the energy in double.
#include "filigree/core/math.h"
#include "filigree/core/parallel_sum.h"
#include "filigree/physics/body.h"
#include "filigree/physics/body/make_cells.h"
#include "filigree/physics/fem/cell_kernel.h"

#include <cmath>

namespace filigree {

namespace {

/// The energy of one cell, J, from its corners in doubles.
double cell_energy(const cell_kernel::CellMaterial& m, const std::array<Vec3d, 8>& corners, float filled) {
    std::array<Vec3d, 8> X = corners;
    const double fraction = double(filled);
    cell_kernel::transform_corners(X);
    const double h = m.spacing, size = 4 * h;
    const double I_bent =
        ((X[3].squaredNorm() + X[5].squaredNorm() + X[6].squaredNorm()) * (2.0 / 3.0) + X[7].squaredNorm() / 3.0) /
        (size * size);
    const double I = (X[1].squaredNorm() + X[2].squaredNorm() + X[4].squaredNorm()) / (size * size) + I_bent;
    const double J = X[1].dot(X[2].cross(X[4])) / (size * size * size);
    const double shear = m.shear, bulk = m.bulk, g = m.rest_ratio;
    // (J - g)^2 - (1 - g)^2 and log(I + 1) - log(4) as products: a body near rest has an energy, not rounding.
    return fraction * h * h * h *
           (shear * (0.5 * ((I - 3) - math::log1p((I - 3) / 4)) + cell_kernel::bent_energy(I_bent)) +
            bulk * (0.5 * (J - 1) * (J + 1 - 2 * g) + cell_kernel::crush_energy(m, J, filled)));
}

class CellElasticity final : public Elasticity {
public:
    explicit CellElasticity(const Body& body) : body_(body), plan_(cell_kernel::make_plan(body)) {}

    ElasticReport forces(const Vectors& positions, Vectors& forces, const RunContext& context) override {
        return cell_kernel::forces(plan_, positions, forces, sums_, context);
    }

    ElasticReport damped_forces(const Vectors& positions, const InternalDamping& damping, Vectors& forces,
                                const RunContext& context) override {
        return cell_kernel::forces(plan_, positions, forces, sums_, context, &damping);
    }

    double energy(const Vectors& positions, const RunContext& context) const override {
        const Cells& cells = body_.cells;
        return parallel_sum(context, cells.cells.size(), 1024, [&](std::size_t cell) {
            std::array<Vec3d, 8> corners;
            for (int c = 0; c < 8; ++c) corners[c] = positions[cells.cell_corners[cell][c]].cast<double>();
            const double energy = cell_energy(plan_.material, corners, cells.fraction[cell]);
            return plan_.stiffness.empty() ? energy : energy * double(plan_.stiffness[cell]);
        });
    }

    void gradients(const Vectors& positions, std::span<Mat3f> gradients, const RunContext& context) const override {
        corner_gradients(body_.cells, positions, gradients, context);
    }

private:
    const Body& body_;
    cell_kernel::Plan plan_;
    cell_kernel::Sums sums_;
};

} // namespace

std::unique_ptr<Elasticity> make_cell_elasticity(const Body& body, const RunContext&) {
    return std::make_unique<CellElasticity>(body);
}

} // namespace filigree
