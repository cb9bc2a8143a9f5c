#include "filigree/hierarchy/pose_error.h"

#include <algorithm>
#include <cmath>

namespace filigree {

namespace {

constexpr float kOpposite = -0.5f; // cosine up to which two edges go in opposite directions
// Of what leaving out shows; see test PoseError.IsWithinAFactorOfTwo.
constexpr double kShareFromPositions = 0.151, kShareFromGradients = 0.0703;

std::vector<std::vector<Index>> edges_at_vertices(const Mesh& mesh) {
    std::vector<std::vector<Index>> edges(mesh.vertex_count());
    for (std::size_t f = 0; f < mesh.face_count(); ++f) {
        const std::span<const Index> face = mesh.face(f);
        for (std::size_t k = 0; k < face.size(); ++k) {
            const Index a = face[k], b = face[(k + 1) % face.size()];
            edges[a].push_back(b), edges[b].push_back(a);
        }
    }
    for (auto& list : edges) {
        std::sort(list.begin(), list.end());
        list.erase(std::unique(list.begin(), list.end()), list.end());
    }
    return edges;
}

} // namespace

PoseError::PoseError(const Model& model) {
    const auto* detail = std::get_if<BlendDetail>(&model.detail);
    if (!detail) return;
    const Mesh driver = level_mesh(model, 0);
    rest_ = driver.positions;
    vertices_.assign(rest_.size(), 0);
    for (std::size_t c = 0; c < detail->cells.size(); ++c)
        for (Index r = detail->cell_offsets[c]; r < detail->cell_offsets[c + 1]; ++r) {
            vertices_[detail->cells[c][0]] += 1 - double(detail->u[r]) - double(detail->v[r]);
            vertices_[detail->cells[c][1]] += double(detail->u[r]);
            vertices_[detail->cells[c][2]] += double(detail->v[r]);
        }

    const std::vector<std::vector<Index>> edges = edges_at_vertices(driver);
    for (Index i = 0; i < rest_.size(); ++i)
        for (Index first : edges[i]) {
            const Vec3f to_first = rest_[first] - rest_[i];
            Index second = kNoIndex;
            float least = kOpposite;
            for (Index other : edges[i]) {
                const Vec3f to_other = rest_[other] - rest_[i];
                const float lengths = to_first.norm() * to_other.norm();
                if (!(lengths > 0) || to_first.dot(to_other) >= least * lengths) continue;
                least = to_first.dot(to_other) / lengths;
                second = other;
            }
            if (second == kNoIndex || second < first) continue; // each pair once, from its lower end
            const Vec3f way = rest_[second] - rest_[first];
            triples_.push_back({i, first, second, std::clamp(-to_first.dot(way) / way.squaredNorm(), 0.0f, 1.0f)});
        }
}

PoseError::Estimate PoseError::estimate(const Pose& pose, std::span<const Mat3f> gradients) const {
    std::vector<double> squared(rest_.size(), 0), pairs(rest_.size(), 0);
    for (const Triple& t : triples_) {
        const double b = double(t.share);
        const Mat3d first = gradients[t.first].cast<double>(), second = gradients[t.second].cast<double>();
        const Mat3d between = (1 - b) * first + b * second;
        const Vec3d p = rest_[t.vertex].cast<double>();
        const Vec3d told = (1 - b) * (pose.positions[t.first].cast<double>() +
                                      0.5 * (first + between) * (p - rest_[t.first].cast<double>())) +
                           b * (pose.positions[t.second].cast<double>() +
                                0.5 * (second + between) * (p - rest_[t.second].cast<double>()));
        squared[t.vertex] += (told - pose.positions[t.vertex].cast<double>()).squaredNorm();
        ++pairs[t.vertex];
    }
    const double share = pose.gradients.empty() ? kShareFromPositions : kShareFromGradients;
    Estimate result;
    double sum = 0, vertices = 0;
    for (std::size_t i = 0; i < rest_.size(); ++i) {
        const double mean = squared[i] / std::max(pairs[i], 1.0);
        sum += vertices_[i] * mean;
        vertices += vertices_[i];
        result.local.push_back(float(share * std::sqrt(mean)));
    }
    result.rms = vertices > 0 ? share * std::sqrt(sum / vertices) : 0;
    return result;
}

} // namespace filigree
