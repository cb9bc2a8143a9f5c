// The double derivatives of fem bodies: energies, forces and Hessians agree with each other and with the stepper's.
#include "filigree/physics/body/make_cells.h"
#include "filigree/physics/fem/cell_derivatives.h"

#include "filigree/physics/body/elasticity.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace filigree {
namespace {

Body derived_body() {
    Material material;
    material.model = MaterialModel::fem;
    return bare_body(box_cells(3, 2, 2, 0.1), material);
}

/// Moved about by a part of a cell, one cell of them inside out.
std::vector<Vec3d> shaken(const Body& body, double by) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> any(-by, by);
    std::vector<Vec3d> positions;
    for (std::size_t i = 0; i < body.rest.size(); ++i)
        positions.push_back(body.rest[i].cast<double>() + Vec3d(any(random), any(random), any(random)));
    std::swap(positions[0], positions[1]);
    return positions;
}

double energy_sum(const std::vector<double>& numbers) {
    double sum = 0;
    for (const double number : numbers) sum += number;
    return sum;
}
double dot_of(const std::vector<Vec3d>& a, const std::vector<Vec3d>& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].dot(b[i]);
    return sum;
}

TEST(CellDerivatives, GradientAndHessianAreTheEnergysDerivatives) {
    const Body body = derived_body();
    const CellDerivatives of = CellDerivatives::create(body).value();
    const std::vector<Vec3d> at = shaken(body, 0.01);
    std::vector<Vec3d> direction = shaken(body, 0.1), ahead = at, behind = at;
    const double step = 1e-6;
    for (std::size_t i = 0; i < at.size(); ++i) {
        ahead[i] += step * direction[i];
        behind[i] -= step * direction[i];
    }
    const RunContext context(2);
    const double slope =
        (energy_sum(of.energies(ahead, context)) - energy_sum(of.energies(behind, context))) / (2 * step);
    EXPECT_NEAR(dot_of(of.gradient(at, context), direction) / slope, 1, 1e-6);

    const std::vector<Vec3d> product = of.hessian_product(at, direction, context), up = of.gradient(ahead, context),
                             down = of.gradient(behind, context);
    double largest = 0, wrong = 0;
    for (std::size_t i = 0; i < at.size(); ++i) {
        largest = std::max(largest, product[i].norm());
        wrong = std::max(wrong, (product[i] - (up[i] - down[i]) / (2 * step)).norm());
    }
    EXPECT_LT(wrong, 1e-6 * largest);

    std::vector<Vec3d> by_blocks(at.size(), Vec3d::Zero());
    const auto blocks = of.hessian_blocks(at, context);
    for (std::size_t cell = 0; cell < blocks.size(); ++cell)
        for (std::size_t row = 0; row < 24; ++row)
            for (std::size_t column = 0; column < 24; ++column) {
                const auto& corners = body.cells.cell_corners[cell];
                by_blocks[corners[row / 3]][Eigen::Index(row % 3)] +=
                    blocks[cell][24 * row + column] * direction[corners[column / 3]][Eigen::Index(column % 3)];
                EXPECT_NEAR(blocks[cell][24 * row + column], blocks[cell][24 * column + row], 1e-9 * largest);
            }
    for (std::size_t i = 0; i < at.size(); ++i) EXPECT_LT((by_blocks[i] - product[i]).norm(), 1e-9 * largest);
}

void expect_forces_of_the_stepper(const Body& body) {
    const CellDerivatives of = CellDerivatives::create(body).value();
    std::vector<Vec3d> at = shaken(body, 0.01);
    Vectors floats(at.size()), forces(at.size());
    for (std::size_t i = 0; i < at.size(); ++i) {
        floats.set(i, at[i].cast<float>());
        at[i] = floats[i].cast<double>();
    }
    const RunContext context;
    const auto stepped = make_elasticity(body, context);
    stepped->forces(floats, forces, context);
    const std::vector<Vec3d> gradient = of.gradient(at, context);
    double largest = 0;
    for (const Vec3d& one : gradient) largest = std::max(largest, one.norm());
    for (std::size_t i = 0; i < at.size(); ++i)
        EXPECT_LT((forces[i].cast<double>() + gradient[i]).norm(), 1e-5 * largest) << i;
    EXPECT_NEAR(energy_sum(of.energies(at, context)) / stepped->energy(floats, context), 1, 1e-9);
}

TEST(CellDerivatives, ForcesAreTheSteppers) {
    Body body = derived_body();
    expect_forces_of_the_stepper(body);
    for (std::size_t cell = 0; cell < body.cells.cells.size(); ++cell)
        body.fields.stiffness.push_back(cell % 3 == 0 ? 4.0f : 0.5f);
    expect_forces_of_the_stepper(body);
}

TEST(CellDerivatives, OtherModelsAreRefused) {
    Body body = derived_body();
    body.material.model = MaterialModel::springs;
    EXPECT_EQ(CellDerivatives::create(body).error().code, ErrorCode::unsuitable);
}

} // namespace
} // namespace filigree
