#include "filigree/present/level_shape.h"

#include "filigree/mesh.h"
#include "filigree/mesh/ray_hit.h"

#include <algorithm>

namespace filigree {

namespace {

/// Some of the finest mesh's vertices, evenly by index, as a mesh without faces.
Mesh some_vertices(const Mesh& mesh, std::size_t most) {
    Mesh some;
    some.origin = mesh.origin;
    const std::size_t count = std::min(mesh.vertex_count(), most);
    for (std::size_t i = 0; i < count; ++i) some.positions.push_back(mesh.positions[i * mesh.vertex_count() / count]);
    return some;
}

/// How far nearly all of `points` are from a level.
std::optional<double> deviation_of(const Mesh& points, const Mesh& level, const RunContext& context) {
    constexpr double kNearlyAll = 0.97;
    Result<std::vector<float>> distances = distances_to_surface(points, level, context);
    if (!distances || distances->empty()) return std::nullopt;
    const auto at = distances->begin() + static_cast<std::ptrdiff_t>(kNearlyAll * double(distances->size() - 1));
    std::nth_element(distances->begin(), at, distances->end());
    return *at;
}

} // namespace

Result<std::shared_ptr<const LevelShape>> LevelShape::make(std::shared_ptr<const Model> model, RestoreOptions restore,
                                                           unsigned level, const RunContext& context) {
    auto shape = std::make_shared<LevelShape>();
    restore.level = level;
    Result<Restorer> restorer = Restorer::create(*model, restore, context);
    if (!restorer) return restorer.error();
    shape->restorer_ = std::move(restorer).value();
    shape->vertex_count_ = shape->restorer_->vertex_count();
    const bool is_finest = level == model->finest_level();
    if (!is_finest) shape->vertices_ = model->levels[level].vertices;
    Result<Triangulation> cut = triangulate(is_finest ? model->mesh : level_mesh(*model, level), context);
    if (!cut) return cut.error();
    shape->triangles_ = std::move(cut->triangles);
    shape->model_ = std::move(model);
    return std::shared_ptr<const LevelShape>(std::move(shape));
}

std::optional<Index> LevelShape::vertex_of(Index finest) const {
    if (vertices_.empty()) return finest < vertex_count_ ? std::optional(finest) : std::nullopt;
    const auto found = std::ranges::lower_bound(vertices_, finest);
    if (found == vertices_.end() || *found != finest) return std::nullopt;
    return static_cast<Index>(found - vertices_.begin());
}

std::vector<Vec3f> LevelShape::positions(const Pose& pose, const RunContext& context) const {
    Result<std::vector<Vec3f>> restored = restorer_->positions(pose, context);
    return restored ? std::move(restored).value() : std::vector<Vec3f>();
}

std::optional<Picked> LevelShape::pick(std::span<const Vec3f> positions, Camera::Ray ray,
                                       const std::optional<ClipPlane>& clip) const {
    if (positions.empty()) return std::nullopt;
    const Vec3d& origin = model_->mesh.origin;
    constexpr int kMostLayers = 8; // of what is clipped away in front of what is not
    for (int layer = 0; layer < kMostLayers; ++layer) {
        const std::optional<RayHit> hit =
            first_hit(positions, triangles_, ray.origin - origin, ray.direction, RunContext());
        if (!hit) return std::nullopt;
        const Vec3d place = ray.origin + hit->distance * ray.direction;
        if (clip && clip->normal.dot(place) > clip->offset) {
            ray.origin = place + 1e-9 * std::max(1.0, hit->distance) * ray.direction;
            continue;
        }
        Eigen::Index corner = 0;
        hit->barycentric.maxCoeff(&corner);
        return Picked{place, finest_vertex(triangles_[hit->triangle][static_cast<std::size_t>(corner)])};
    }
    return std::nullopt;
}

LevelFacts level_facts(const Model& model, unsigned level) {
    const LevelCounts counts = level_counts(model, level);
    LevelFacts facts;
    facts.triangles = counts.triangles();
    facts.vertices = counts.vertices;
    if (level == model.finest_level()) facts.deviation = 0;
    return facts;
}

Result<std::vector<std::optional<double>>> level_deviations(const Model& model, const RunContext& context) {
    constexpr std::size_t kProbes = 20'000; // vertices: enough for a percentile
    const Mesh points = some_vertices(model.mesh, kProbes);
    std::vector<std::optional<double>> deviations;
    for (unsigned level = 0; level < model.finest_level(); ++level)
        deviations.push_back(deviation_of(points, level_mesh(model, level), context));
    if (context.is_cancelled()) return cancelled_error();
    return deviations;
}

} // namespace filigree
