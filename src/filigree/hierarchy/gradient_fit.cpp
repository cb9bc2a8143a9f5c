// The plane part of the gradient comes from how the ring's vertices moved, the normal part from the ring's own relief
// where it has some (the z column) and else from the normal. The quadratic terms take up curvature, so that it does not
// leak into the linear ones.
#include "filigree/hierarchy/gradient_fit.h"

#include "filigree/core/dense_solve.h"
#include "filigree/core/parallel_for.h"
#include "filigree/mesh/normals.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

constexpr double kQuadraticRidge = 1e-4; // times the neighbour count, in units of the ring's own size
constexpr double kLinearRidge = 1e-9;    // the same; keeps degenerate rings solvable
constexpr double kSoftNormal = 0.003;    // the same; pull of the z column towards s n'
constexpr double kHardNormal = 1e4;      // the same; z column as good as given
constexpr double kGhostLength = 0.1;     // of a ghost point from its vertex, in mean edge lengths
constexpr std::size_t kMaxRing = 48;     // neighbours a fit uses at most: more add cost, no accuracy

using Row6 = Eigen::Matrix<double, 6, 1>;

/// Columns: two unit tangents and the normal.
Mat3d tangent_basis(const Vec3d& normal) {
    Mat3d basis;
    basis.col(0) = normal.unitOrthogonal();
    basis.col(1) = normal.cross(basis.col(0));
    basis.col(2) = normal;
    return basis;
}

/// For each vertex those that share a face with it, ascending.
std::vector<std::vector<Index>> neighbour_lists(const Mesh& mesh) {
    std::vector<std::vector<Index>> neighbours(mesh.vertex_count());
    for (std::size_t f = 0; f < mesh.face_count(); ++f)
        for (Index a : mesh.face(f))
            for (Index b : mesh.face(f))
                if (a != b) neighbours[a].push_back(b);
    for (auto& list : neighbours) {
        std::sort(list.begin(), list.end());
        list.erase(std::unique(list.begin(), list.end()), list.end());
    }
    return neighbours;
}

} // namespace

GradientFit::GradientFit(const Mesh& driver, const RunContext& context) {
    driver_.positions = driver.positions;
    driver_.face_offsets = driver.face_offsets;
    driver_.corners = driver.corners;
    normals_ = vertex_normals(driver_, driver_.positions, context);
    rest_areas_ = ring_areas(driver_.positions);

    find_rings();
    soft_ = solve(kSoftNormal, context);
    hard_ = solve(kHardNormal, context);
}

void GradientFit::find_rings() {
    const std::vector<std::vector<Index>> neighbours = neighbour_lists(driver_);
    const std::size_t count = driver_.vertex_count();
    ring_offsets_ = {0};
    edge_lengths_.assign(count, 0);
    std::vector<Index> seen(count, kNoIndex);
    for (Index i = 0; i < count; ++i) {
        const std::size_t begin = ring_.size();
        seen[i] = i;
        const auto take = [&](Index j) {
            if (seen[j] == i || ring_.size() - begin >= kMaxRing) return;
            seen[j] = i;
            ring_.push_back(j);
        };
        const std::size_t step = neighbours[i].size() / kMaxRing + 1; // spread over a fan larger than the cap
        for (std::size_t k = 0; k < neighbours[i].size(); k += step) take(neighbours[i][k]);
        const std::size_t one_ring = ring_.size();
        for (std::size_t k = begin; k < one_ring && ring_.size() - begin < kMaxRing; ++k)
            for (Index j : neighbours[ring_[k]]) {
                if (ring_.size() - begin >= kMaxRing) break; // a fan may have any number
                take(j);
            }
        for (std::size_t k = begin; k < one_ring; ++k)
            edge_lengths_[i] +=
                (driver_.positions[ring_[k]] - driver_.positions[i]).cast<double>().norm() / double(one_ring - begin);
        ring_offsets_.push_back(static_cast<Index>(ring_.size()));
    }
}

GradientFit::Weights GradientFit::solve(double normal_weight, const RunContext& context) const {
    Weights weights;
    const std::size_t count = driver_.vertex_count();
    weights.alpha.assign(ring_.size(), Vec3d::Zero());
    weights.beta.assign(count, Vec3d::Zero());
    parallel_for(context, count, 256, [&](std::size_t begin, std::size_t end) {
        std::vector<Row6> rows;
        for (std::size_t i = begin; i < end; ++i) {
            const std::size_t ring_begin = ring_offsets_[i], ring_end = ring_offsets_[i + 1];
            const Vec3d normal = normals_[i].cast<double>();
            if (ring_begin == ring_end || normal.squaredNorm() == 0) continue;
            const Mat3d basis = tangent_basis(normal.normalized());
            const Vec3d centre = driver_.positions[i].cast<double>();
            double size = 0;
            for (std::size_t k = ring_begin; k < ring_end; ++k)
                size += (driver_.positions[ring_[k]].cast<double>() - centre).squaredNorm();
            const double m = double(ring_end - ring_begin);
            size = std::sqrt(size / m);
            if (!(size > 0)) continue;

            rows.clear();
            Eigen::Matrix<double, 6, 6> normal_matrix = Eigen::Matrix<double, 6, 6>::Zero();
            for (std::size_t k = ring_begin; k < ring_end; ++k) {
                const Vec3d x = basis.transpose() * (driver_.positions[ring_[k]].cast<double>() - centre) / size;
                Row6 row;
                row << x[0], x[1], x[2], x[0] * x[0], x[0] * x[1], x[1] * x[1];
                normal_matrix += row * row.transpose();
                rows.push_back(row);
            }
            for (int d = 0; d < 6; ++d) normal_matrix(d, d) += m * (d < 3 ? kLinearRidge : kQuadraticRidge);
            normal_matrix(2, 2) += m * normal_weight;

            // The first three rows of the inverse: how the linear terms depend on the right-hand side.
            const Eigen::Matrix<double, 6, 3> inverse = inverse_columns(normal_matrix);
            for (std::size_t k = ring_begin; k < ring_end; ++k)
                weights.alpha[k] = basis * (inverse.transpose() * rows[k - ring_begin]) / size;
            weights.beta[i] = basis * (m * normal_weight * inverse.row(2).transpose());
        }
    });
    std::vector<Vec3d> columns(count);
    for (std::size_t i = 0; i < count; ++i) columns[i] = normals_[i].cast<double>().normalized();
    weights.rest_error.assign(count, Mat3d::Zero());
    const std::vector<Mat3f> at_rest = apply(weights, driver_.positions, columns, context);
    for (std::size_t i = 0; i < count; ++i) weights.rest_error[i] = Mat3d::Identity() - at_rest[i].cast<double>();
    return weights;
}

std::vector<Mat3f> GradientFit::apply(const Weights& weights, std::span<const Vec3f> positions,
                                      std::span<const Vec3d> columns, const RunContext& context) const {
    std::vector<Mat3f> gradients(driver_.vertex_count());
    parallel_for(context, gradients.size(), 1024, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            Mat3d a = weights.rest_error[i] + columns[i] * weights.beta[i].transpose();
            const Vec3d centre = positions[i].cast<double>();
            for (std::size_t k = ring_offsets_[i]; k < ring_offsets_[i + 1]; ++k)
                a += (positions[ring_[k]].cast<double>() - centre) * weights.alpha[k].transpose();
            gradients[i] = a.cast<float>();
        }
    });
    return gradients;
}

std::vector<double> GradientFit::ring_areas(std::span<const Vec3f> positions) const {
    std::vector<double> areas(positions.size(), 0);
    for (std::size_t f = 0; f < driver_.face_count(); ++f) {
        const std::span<const Index> face = driver_.face(f);
        const double doubled_area = doubled_area_vector(positions, face).norm();
        for (Index v : face) areas[v] += doubled_area;
    }
    return areas;
}

std::vector<Mat3f> GradientFit::fit(std::span<const Vec3f> positions, NormalColumn normal_column, HeightLaw law,
                                    const RunContext& context) const {
    const std::vector<Vec3f> normals = vertex_normals(driver_, positions, context);
    const std::vector<double> areas = law == HeightLaw::keep ? rest_areas_ : ring_areas(positions);
    std::vector<Vec3d> columns(positions.size());
    for (std::size_t i = 0; i < columns.size(); ++i)
        columns[i] = height_law_scale(law, rest_areas_[i], areas[i]) * normals[i].cast<double>().normalized();
    return apply(normal_column == NormalColumn::shell ? hard_ : soft_, positions, columns, context);
}

std::vector<Mat3f> GradientFit::fit_to_ghosts(std::span<const Vec3f> positions, std::span<const Vec3f> ghosts,
                                              const RunContext& context) const {
    const std::vector<Vec3f> rest = rest_ghosts();
    std::vector<Vec3d> columns(positions.size(), Vec3d::Zero());
    for (std::size_t i = 0; i < columns.size(); ++i) {
        const double length = (rest[i] - driver_.positions[i]).cast<double>().norm();
        if (length > 0) columns[i] = (ghosts[i] - positions[i]).cast<double>() / length;
    }
    return apply(hard_, positions, columns, context);
}

void GradientFit::make_shell(std::span<Mat3f> gradients, HeightLaw law) const {
    for (std::size_t i = 0; i < gradients.size(); ++i) {
        const Vec3d n = normals_[i].cast<double>().normalized();
        if (n.squaredNorm() == 0) continue;
        const Mat3d a = gradients[i].cast<double>();
        const Mat3d basis = tangent_basis(n);
        const Vec3d across =
            (a * basis.col(0)).cross(a * basis.col(1)); // the deformed normal; its length is the area ratio
        const double area = across.norm();
        const Vec3d column = area > 0 ? Vec3d(height_law_scale(law, 1, area) * across / area) : Vec3d(Vec3d::Zero());
        gradients[i] = (a + (column - a * n) * n.transpose()).cast<float>();
    }
}

std::vector<Vec3f> GradientFit::rest_ghosts() const {
    std::vector<Vec3f> ghosts = driver_.positions;
    for (std::size_t i = 0; i < ghosts.size(); ++i)
        ghosts[i] += (kGhostLength * edge_lengths_[i] * normals_[i].cast<double>().normalized()).cast<float>();
    return ghosts;
}

} // namespace filigree
