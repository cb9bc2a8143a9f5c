// Decompositions of matrices, most of them small. Eigen's are templates that take seconds to compile; here each is
// compiled once, for the whole library.
#pragma once

#include "filigree/types.h"

#include <Eigen/Geometry>

namespace filigree {

/// Of a symmetric matrix, of which the lower triangle is read: eigenvalues in ascending order, and unit eigenvectors
/// as the columns of a rotation or a reflection.
template <class Scalar, int kSize>
struct SymmetricEigen {
    Eigen::Matrix<Scalar, kSize, 1> values;
    Eigen::Matrix<Scalar, kSize, kSize> vectors;
};
SymmetricEigen<float, 3> symmetric_eigen(const Mat3f& matrix);
SymmetricEigen<double, 3> symmetric_eigen(const Mat3d& matrix);
SymmetricEigen<double, Eigen::Dynamic> symmetric_eigen(const Eigen::MatrixXd& matrix);
/// The eigenvalues alone, which is twice as fast; they may differ from the above in their last bits.
Vec3f symmetric_eigenvalues(const Mat3f& matrix);

/// matrix = u diag(s) v^T: u and v orthogonal, s descending and not negative.
template <class Scalar>
struct SingularValues {
    Eigen::Matrix<Scalar, 3, 3> u, v;
    Eigen::Matrix<Scalar, 3, 1> s;
    bool converged = true; ///< false: the matrix is not finite; u and v are the identity then, s is 0
};
SingularValues<float> singular_values(const Mat3f& matrix);
SingularValues<double> singular_values(const Mat3d& matrix);
/// s alone; NaN where the matrix is not finite.
Vec3d singular_values_only(const Mat3d& matrix);

/// The rotation R, always proper, with the largest trace(R^T matrix) [Kabsch 1976]; the identity where the matrix is
/// not finite.
Mat3d nearest_rotation(const Mat3d& matrix);

/// How oriented areas, and so normals, are transformed by a: det(a) a^-T, defined for singular a too.
inline Mat3d cofactor(const Mat3d& a) {
    Mat3d result;
    result << a.col(1).cross(a.col(2)), a.col(2).cross(a.col(0)), a.col(0).cross(a.col(1));
    return result;
}

/// x with matrix x = right, for a symmetric positive semi-definite matrix, of which the lower triangle is read.
Vec3d solve_semidefinite(const Mat3d& matrix, const Vec3d& right);
Eigen::MatrixXd solve_semidefinite(const Eigen::MatrixXd& matrix, const Eigen::MatrixXd& right);
/// The least x of those with the least |matrix x - right|, column by column, for any matrix.
Eigen::MatrixX3d least_squares(const Eigen::MatrixXd& matrix, const Eigen::MatrixX3d& right);
/// An orthonormal basis, as columns, of all that is orthogonal to the columns of matrix. It has no columns where
/// nothing is.
Eigen::MatrixXd orthogonal_complement(const Eigen::MatrixXd& matrix);

} // namespace filigree
