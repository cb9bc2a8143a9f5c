#include "filigree/core/dense_solve.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>

namespace filigree {

namespace {

template <class Matrix>
auto eigen_of(const Matrix& matrix) {
    const Eigen::SelfAdjointEigenSolver<Matrix> eigen(matrix);
    return SymmetricEigen<typename Matrix::Scalar, Matrix::RowsAtCompileTime>{eigen.eigenvalues(),
                                                                              eigen.eigenvectors()};
}

template <class Matrix>
SingularValues<typename Matrix::Scalar> decompose(const Matrix& matrix) {
    const Eigen::JacobiSVD<Matrix> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
    if (svd.info() != Eigen::Success) return {Matrix::Identity(), Matrix::Identity(), {0, 0, 0}, false};
    return {svd.matrixU(), svd.matrixV(), svd.singularValues()};
}

} // namespace

SymmetricEigen<float, 3> symmetric_eigen(const Mat3f& matrix) { return eigen_of(matrix); }
SymmetricEigen<double, 3> symmetric_eigen(const Mat3d& matrix) { return eigen_of(matrix); }
SymmetricEigen<double, Eigen::Dynamic> symmetric_eigen(const Eigen::MatrixXd& matrix) { return eigen_of(matrix); }

Vec3f symmetric_eigenvalues(const Mat3f& matrix) {
    return Eigen::SelfAdjointEigenSolver<Mat3f>(matrix, Eigen::EigenvaluesOnly).eigenvalues();
}

SingularValues<float> singular_values(const Mat3f& matrix) { return decompose(matrix); }
SingularValues<double> singular_values(const Mat3d& matrix) { return decompose(matrix); }

Vec3d singular_values_only(const Mat3d& matrix) {
    const Eigen::JacobiSVD<Mat3d> svd(matrix);
    if (svd.info() != Eigen::Success) return Vec3d::Constant(std::numeric_limits<double>::quiet_NaN());
    return svd.singularValues();
}

Mat3d nearest_rotation(const Mat3d& matrix) {
    const SingularValues<double> svd = singular_values(matrix);
    Vec3d sign = Vec3d::Ones();
    sign[2] = (svd.u * svd.v.transpose()).determinant() < 0 ? -1 : 1;
    return svd.u * sign.asDiagonal() * svd.v.transpose();
}

Vec3d solve_semidefinite(const Mat3d& matrix, const Vec3d& right) { return matrix.ldlt().solve(right); }

Eigen::MatrixXd solve_semidefinite(const Eigen::MatrixXd& matrix, const Eigen::MatrixXd& right) {
    return matrix.ldlt().solve(right);
}

Eigen::MatrixX3d least_squares(const Eigen::MatrixXd& matrix, const Eigen::MatrixX3d& right) {
    return matrix.completeOrthogonalDecomposition().solve(right);
}

Eigen::MatrixXd orthogonal_complement(const Eigen::MatrixXd& matrix) {
    const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> split(matrix);
    return Eigen::MatrixXd(split.householderQ()).rightCols(matrix.rows() - split.rank());
}

} // namespace filigree
