#include "filigree/hierarchy/pose_error.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

/// Shares of what positions miss, and of what gradients differ by.
struct Shares {
    double positions, gradients;
};
constexpr Shares kFromPositions = {0.210, 0.0526}, kFromGradients = {0.177, 0.0372};

} // namespace

PoseError::PoseError(const Model& model) : rest_(driver_positions(model)) {
    const auto* detail = std::get_if<BlendDetail>(&model.detail);
    if (!detail) return;
    cells_ = detail->cells;
    for (std::size_t c = 0; c < cells_.size(); ++c) {
        Load load{};
        for (Index r = detail->cell_offsets[c]; r < detail->cell_offsets[c + 1]; ++r) {
            const double u = double(detail->u[r]), v = double(detail->v[r]);
            const double b[] = {1 - u - v, u, v};
            Vec3d foot = Vec3d::Zero();
            for (int k = 0; k < 3; ++k) foot += b[k] * rest_[cells_[c][k]].cast<double>();
            const double height = (model.mesh.positions[detail->order[r]].cast<double>() - foot).squaredNorm();
            for (int k = 0; k < 3; ++k) {
                const double between = 4 * b[k] * b[(k + 1) % 3];
                load.vertices[k] += between * between;
                load.heights[k] += between * between * height;
            }
            ++load.count;
        }
        loads_.push_back(load);
    }
}

PoseError::Estimate PoseError::estimate(const Pose& pose, std::span<const Mat3f> gradients) const {
    const Shares& share = pose.gradients.empty() ? kFromPositions : kFromGradients;
    const auto error_of_edge = [&](Index a, Index b, double vertices, double heights) {
        const Mat3d at_a = gradients[a].cast<double>(), at_b = gradients[b].cast<double>();
        const Vec3d told = 0.5 * (at_a + at_b) * (rest_[b] - rest_[a]).cast<double>();
        const Vec3d missed = (pose.positions[b] - pose.positions[a]).cast<double>() - told;
        return share.positions * share.positions * vertices * missed.squaredNorm() +
               share.gradients * share.gradients * heights * (at_b - at_a).squaredNorm();
    };
    std::vector<double> squared(rest_.size(), 0), counts(rest_.size(), 0);
    double sum = 0, count = 0;
    for (std::size_t c = 0; c < cells_.size(); ++c) {
        double of_cell = 0;
        for (int k = 0; k < 3; ++k)
            of_cell += error_of_edge(cells_[c][k], cells_[c][(k + 1) % 3], loads_[c].vertices[k], loads_[c].heights[k]);
        for (Index corner : cells_[c]) {
            squared[corner] += of_cell;
            counts[corner] += loads_[c].count;
        }
        sum += of_cell;
        count += loads_[c].count;
    }
    Estimate result;
    result.diagonal = bounds(pose.positions).diagonal();
    result.rms = std::sqrt(sum / std::max(count, 1.0));
    for (std::size_t i = 0; i < rest_.size(); ++i)
        result.local.push_back(float(std::sqrt(squared[i] / std::max(counts[i], 1.0))));
    return result;
}

std::vector<float> vertex_errors(const Model& model, std::span<const float> local) {
    const auto* detail = std::get_if<BlendDetail>(&model.detail);
    if (!detail) return {};
    std::vector<float> errors(model.mesh.vertex_count());
    for (std::size_t c = 0; c < detail->cells.size(); ++c) {
        const auto& [i, j, k] = detail->cells[c];
        for (Index r = detail->cell_offsets[c]; r < detail->cell_offsets[c + 1]; ++r) {
            const float u = detail->u[r], v = detail->v[r];
            errors[detail->order[r]] = (1 - u - v) * local[i] + u * local[j] + v * local[k];
        }
    }
    return errors;
}

} // namespace filigree
