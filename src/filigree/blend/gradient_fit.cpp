#include "filigree/blend/gradient_fit.h"

#include "filigree/blend/space_neighbours.h"
#include "filigree/core/dense_solve.h"
#include "filigree/core/parallel_for.h"
#include "filigree/core/smoothstep.h"
#include "filigree/mesh/normals.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

constexpr double kQuadratics = 10; // how cheap quadratic terms are beside the kernel; between 1 and 100 little changes
constexpr double kRidge =
    3e-8; // on the kernel, in units of the set's size: keeps vertices almost at one place solvable
constexpr double kFlat = 6e-4,
                 kSolid = 6e-3;    // thickness in widths: below the first completed, above the second the sum
constexpr double kNoSpread = 1e-4; // thickness in widths below which a direction has no linear term

/// a with what it does to the unit vector n replaced by s n': n' and s from what a does to the plane across n.
Mat3d with_normal_column(const Mat3d& a, const Vec3d& n) {
    const Vec3d t = n.unitOrthogonal();
    const Vec3d across = (a * t).cross(a * n.cross(t)); // the deformed normal; its length is the area ratio
    const double area = across.norm();
    const Vec3d column = area > 0 ? Vec3d(std::sqrt(area) * across / area) : Vec3d(Vec3d::Zero());
    return a + (column - a * n) * n.transpose();
}

/// The least rotation that takes the unit vector a to the unit vector b, by half its angle: they are of length 1 to the
/// last bits, or turns by nearly 180 degrees go wrong. Eigen's own way takes ten seconds to compile.
Mat3d least_rotation(const Vec3d& a, const Vec3d& b) {
    const double cosine = a.dot(b);
    if (cosine < -1 + 1e-12) { // a half turn about any axis across
        const Vec3d axis = a.unitOrthogonal();
        return 2 * axis * axis.transpose() - Mat3d::Identity();
    }
    const double w = std::sqrt((1 + cosine) / 2);
    Eigen::Quaterniond turn;
    turn.w() = w;
    turn.vec() = a.cross(b) / (2 * w);
    return turn.toRotationMatrix();
}

/// a with what it does across the unit vector t replaced by the least rotation that takes t to a t, scaled like a t.
Mat3d turned_with_line(const Mat3d& a, const Vec3d& t) {
    const Vec3d moved = a * t;
    const double stretch = moved.norm();
    if (!(stretch > 0)) return moved * t.transpose();
    const Mat3d turn = least_rotation(t.normalized(), moved / stretch);
    return moved * t.transpose() + stretch * turn * (Mat3d::Identity() - t * t.transpose());
}

/// A set of points in axes of its own: along which it spreads most first, about the vertex, in units of its size.
struct LocalSet {
    double size = 0;           ///< root of the mean squared distance from the mean
    Mat3d axes;                ///< columns
    Vec3d spread;              ///< root of the mean square along each axis, in sizes
    std::vector<Vec3d> points; ///< the vertex itself first

    LocalSet(std::span<const Vec3f> positions, Index vertex, std::span<const Index> neighbours) {
        const Vec3d centre = positions[vertex].cast<double>();
        points.push_back(Vec3d::Zero());
        for (Index j : neighbours) points.push_back(positions[j].cast<double>() - centre);
        Vec3d mean = Vec3d::Zero();
        for (const Vec3d& p : points) mean += p / double(points.size());
        Mat3d covariance = Mat3d::Zero();
        for (const Vec3d& p : points) covariance += (p - mean) * (p - mean).transpose() / double(points.size());
        size = std::sqrt(covariance.trace());
        if (!(size > 0)) return;

        const SymmetricEigen<double, 3> eigen = symmetric_eigen(Mat3d(covariance / (size * size)));
        axes = eigen.vectors.rowwise().reverse();
        spread = eigen.values.reverse().cwiseMax(0).cwiseSqrt();
        for (Vec3d& p : points) p = axes.transpose() * p / size;
    }

    /// Directions with a linear term.
    int rank() const { return spread[1] < kNoSpread * spread[0] ? 1 : spread[2] < kNoSpread * spread[1] ? 2 : 3; }
};

/// The gradient at the first point of the interpolant, as a weight for each point's value: rows of three.
Eigen::MatrixXd gradient_weights(const LocalSet& set) {
    const Eigen::Index n = static_cast<Eigen::Index>(set.points.size()), rank = set.rank();
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(n + 1 + rank, n + 1 + rank);
    Eigen::MatrixXd right = Eigen::MatrixXd::Zero(n + 1 + rank, 3);
    for (Eigen::Index a = 0; a < n; ++a) {
        const Vec3d& p = set.points[static_cast<std::size_t>(a)];
        for (Eigen::Index b = 0; b <= a; ++b) {
            const Vec3d& q = set.points[static_cast<std::size_t>(b)];
            const double squared = (p - q).squaredNorm(), dot = p.dot(q);
            matrix(a, b) = matrix(b, a) = squared * std::sqrt(squared) + kQuadratics * dot * dot;
        }
        matrix(a, a) += kRidge;
        matrix(a, n) = matrix(n, a) = 1;
        matrix.row(a).tail(rank) = p.head(rank).transpose();
        matrix.col(a).tail(rank) = p.head(rank);
        right.row(a) = -3 * p.norm() * p.transpose();
    }
    for (Eigen::Index k = 0; k < rank; ++k) right(n + 1 + k, k) = 1;
    return solve_general(matrix, right).topRows(n);
}

} // namespace

GradientFit::GradientFit(const Mesh& driver, const RunContext& context) : rest_(driver.positions) {
    const IndexLists neighbours = space_neighbours(driver, vertex_normals(driver, driver.positions, context), context);
    const std::size_t count = rest_.size();
    term_offsets_ = neighbours.offsets;
    terms_.assign(neighbours.items.size(), {});
    flatness_.assign(count, {});
    rest_error_.assign(count, Mat3f::Identity());
    parallel_for(context, count, 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) solve(static_cast<Index>(i), neighbours);
    });
    const std::vector<Mat3f> at_rest = sum(rest_, context);
    for (std::size_t i = 0; i < count; ++i) rest_error_[i] += -at_rest[i];
}

void GradientFit::solve(Index vertex, const IndexLists& neighbours) {
    const LocalSet set(rest_, vertex, neighbours[vertex]);
    if (!(set.size > 0)) return;
    const Eigen::MatrixXd weights = gradient_weights(set);
    for (std::size_t k = 0; k < neighbours[vertex].size(); ++k) {
        const Vec3d weight = set.axes * weights.row(static_cast<Eigen::Index>(k) + 1).transpose() / set.size;
        terms_[term_offsets_[vertex] + k] = {neighbours[vertex][k], weight};
    }
    const int rank = set.rank();
    const auto completed_share = [&](int axis) {
        return rank < axis + 1 ? 1 : float(1 - smoothstep(kFlat, kSolid, set.spread[axis] / set.spread[axis - 1]));
    };
    flatness_[vertex] = {set.axes.col(0).cast<float>(), set.axes.col(2).cast<float>(), completed_share(1),
                         completed_share(2)};
    rest_error_[vertex] = (set.axes.leftCols(rank) * set.axes.leftCols(rank).transpose()).cast<float>();
}

std::vector<Mat3f> GradientFit::sum(std::span<const Vec3f> positions, const RunContext& context) const {
    std::vector<Mat3f> gradients(rest_.size());
    parallel_for(context, gradients.size(), 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const Vec3d centre = positions[i].cast<double>();
            Mat3d a = Mat3d::Zero();
            for (std::size_t k = term_offsets_[i]; k < term_offsets_[i + 1]; ++k)
                a += (positions[terms_[k].vertex].cast<double>() - centre) * terms_[k].weight.transpose();
            gradients[i] = a.cast<float>();
        }
    });
    return gradients;
}

Mat3f GradientFit::complete(const Mat3f& gradient, const Flatness& flatness) {
    if (flatness.off_plane == 0) return gradient;
    Mat3d a = gradient.cast<double>();
    if (flatness.beside_line > 0) a += flatness.beside_line * (turned_with_line(a, flatness.line.cast<double>()) - a);
    a += flatness.off_plane * (with_normal_column(a, flatness.normal.cast<double>()) - a);
    return a.cast<float>();
}

std::vector<Mat3f> GradientFit::fit(std::span<const Vec3f> positions, const RunContext& context) const {
    std::vector<Mat3f> gradients = sum(positions, context);
    for (std::size_t i = 0; i < gradients.size(); ++i)
        gradients[i] = complete(gradients[i] + rest_error_[i], flatness_[i]);
    return gradients;
}

} // namespace filigree
