#include "restored_error.h"

#include "filigree/mesh/normals.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace filigree::studio {

namespace {

/// As the library's mesh_distance, which would also measure surface to surface.
VertexDistance vertex_distance(const Mesh& faces, std::span<const Vec3f> a, std::span<const Vec3f> b,
                               const RunContext& context) {
    VertexDistance result;
    double sum_of_squares = 0;
    for (std::size_t v = 0; v < a.size(); ++v) {
        const double distance = (a[v].cast<double>() - b[v].cast<double>()).norm();
        sum_of_squares += distance * distance;
        result.per_vertex.push_back(static_cast<float>(distance));
        if (result.max_vertex == kNoIndex || distance > result.max) {
            result.max = distance;
            result.max_vertex = static_cast<Index>(v);
        }
    }
    if (!a.empty()) result.rms = std::sqrt(sum_of_squares / double(a.size()));

    const std::vector<Vec3f> normals_a = vertex_normals(faces, a, context),
                             normals_b = vertex_normals(faces, b, context);
    std::vector<double> angles;
    for (std::size_t v = 0; v < a.size(); ++v) {
        const Vec3d m = normals_a[v].cast<double>(), n = normals_b[v].cast<double>();
        if (!m.isZero(0) && !n.isZero(0))
            angles.push_back(std::atan2(m.cross(n).norm(), m.dot(n)) * 180 / std::numbers::pi);
    }
    if (angles.empty()) return result;
    for (const double angle : angles) result.normal_mean_deg += angle / double(angles.size());
    std::sort(angles.begin(), angles.end());
    result.normal_max_deg = angles.back();
    result.normal_p95_deg = angles[std::size_t(std::ceil(0.95 * double(angles.size()))) - 1];
    return result;
}

} // namespace

Result<VertexDistance> restored_error(const State& state, const Pose& pose, std::span<const Vec3f> full,
                                      const RunContext& context) {
    context.report("measuring the error", 0);
    const Model& model = *state.model;
    const Mesh level = level_mesh(model, state.level());
    std::vector<Vec3f> chosen;
    if (state.level() < model.finest_level()) {
        for (const Index v : model.levels[state.level()].vertices) chosen.push_back(full[v]);
        full = chosen;
    }
    if (pose.positions.empty()) return vertex_distance(level, level.positions, full, context);
    const Result<Restorer> restorer = Restorer::create(model, state.restore, context);
    if (!restorer) return restorer.error();
    const Result<std::vector<Vec3f>> restored = restorer->positions(pose, context);
    if (!restored) return restored.error();
    if (context.is_cancelled()) return cancelled_error();
    return vertex_distance(level, *restored, full, context);
}

} // namespace filigree::studio
