#include "filigree/core/dense_solve.h"

#include "filigree/core/random.h"

#include <Eigen/LU>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>

namespace filigree {
namespace {

Mat3d numbers(std::uint64_t seed) {
    Mat3d matrix;
    for (int k = 0; k < 9; ++k) matrix(k / 3, k % 3) = 2 * random_unit(seed, std::uint64_t(k)) - 1;
    return matrix;
}

TEST(DenseSolve, EigenvaluesAscendAndComeBackAsTheMatrix) {
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
        const Mat3d half = numbers(seed), matrix = half + half.transpose();
        const SymmetricEigen<double, 3> eigen = symmetric_eigen(matrix);
        EXPECT_LE(eigen.values[0], eigen.values[1]);
        EXPECT_LE(eigen.values[1], eigen.values[2]);
        EXPECT_LT((eigen.vectors * eigen.values.asDiagonal() * eigen.vectors.transpose() - matrix).norm(), 1e-12);
        const SymmetricEigen<double, Eigen::Dynamic> of_any_size = symmetric_eigen(Eigen::MatrixXd(matrix));
        EXPECT_LT((Vec3d(of_any_size.values) - eigen.values).norm(), 1e-12);
        EXPECT_LT(
            (Mat3d(of_any_size.vectors) * eigen.values.asDiagonal() * Mat3d(of_any_size.vectors).transpose() - matrix)
                .norm(),
            1e-12);
        const Vec3f alone = symmetric_eigenvalues(Mat3f(matrix.cast<float>()));
        EXPECT_LT((alone.cast<double>() - eigen.values).norm(), 1e-5);
    }
}

TEST(DenseSolve, SingularValuesDescendAndComeBackAsTheMatrix) {
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
        const Mat3d matrix = numbers(seed);
        const SingularValues<double> parts = singular_values(matrix);
        ASSERT_TRUE(parts.converged);
        EXPECT_GE(parts.s[0], parts.s[1]);
        EXPECT_GE(parts.s[1], parts.s[2]);
        EXPECT_GE(parts.s[2], 0);
        EXPECT_LT((parts.u * parts.s.asDiagonal() * parts.v.transpose() - matrix).norm(), 1e-12);
        EXPECT_LT((singular_values_only(matrix) - parts.s).norm(), 1e-12);
    }
    const Mat3d endless = Mat3d::Constant(std::numeric_limits<double>::infinity());
    EXPECT_FALSE(singular_values(endless).converged);
    EXPECT_TRUE(std::isnan(singular_values_only(endless)[0]));
}

TEST(DenseSolve, CofactorTransformsAreas) {
    const Mat3d a = numbers(3);
    EXPECT_LT((cofactor(a) - a.determinant() * a.inverse().transpose()).norm(), 1e-12);
    Mat3d flat = a;
    flat.col(2) = flat.col(0); // singular: the areas in the plane of the other two are left
    EXPECT_LT((cofactor(flat) * Vec3d(1, 0, 0) - flat.col(1).cross(flat.col(2))).norm(), 1e-12);
}

TEST(DenseSolve, SolvesWhatItIsGiven) {
    const Mat3d half = numbers(5), definite = half * half.transpose() + Mat3d::Identity();
    const Vec3d right(1, -2, 3);
    EXPECT_LT((definite * solve_semidefinite(definite, right) - right).norm(), 1e-12);
    const Eigen::MatrixXd solved = solve_semidefinite(Eigen::MatrixXd(definite), Eigen::MatrixXd(right));
    EXPECT_LT((definite * Vec3d(solved) - right).norm(), 1e-12);
}

} // namespace
} // namespace filigree
