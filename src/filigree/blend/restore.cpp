#include "filigree/restore.h"

#include "filigree/blend/blend_code.h"
#include "filigree/blend/gradient_fit.h"
#include "filigree/mesh/normals.h"

#include "runtime/rt_kernel.h"

#include <mutex>

namespace filigree {

struct Restorer::Content {
    const Model* model = nullptr;
    Mesh rest;                           ///< the level at rest, with split normals
    std::vector<Index> vertices;         ///< ids in the finest mesh; empty at the finest level
    std::vector<Index> vertex_of_normal; ///< of rest.normals.values, in the level's own ids

    mutable std::once_flag gradient_fit_made;
    mutable std::optional<GradientFit> gradient_fit; ///< made for the first pose without gradients
    std::optional<BlendRestorer> blend;              ///< positions, and normals where there is one a vertex
    std::optional<BlendRestorer> blend_normals;      ///< normals alone, where corners have their own

    bool has_vertex_normals() const { return !rest.normals.empty() && rest.normals.per_vertex(); }
    Status prepare(const RunContext& context);
    const GradientFit& fit(unsigned threads) const;
    std::vector<Mat3f> gradients(const Pose& pose, const RunContext& context) const;
};

namespace {

std::vector<Vec3f> unit(std::vector<Vec3f> normals) {
    for (Vec3f& n : normals) flg_unit(n.data());
    return normals;
}

} // namespace

/// Not for a pose's own context: cancelled half way, it would stay half made.
const GradientFit& Restorer::Content::fit(unsigned threads) const {
    std::call_once(gradient_fit_made, [&] { gradient_fit.emplace(level_mesh(*model, 0), RunContext(threads)); });
    return *gradient_fit;
}

Status Restorer::Content::prepare(const RunContext& context) {
    const BlendDetail& detail = model->detail;
    const std::span<const Vec3f> positions = model->mesh.positions;
    const std::span<const Index> driver = model->driver().vertices;

    std::vector<BlendRestorer::Item> items(rest.vertex_count());
    const auto finest_id = [&](Index v) { return vertices.empty() ? v : vertices[v]; };
    for (Index v = 0; v < items.size(); ++v) items[v] = {finest_id(v), v};
    blend.emplace(detail, positions, driver, items,
                  has_vertex_normals() ? unit(rest.normals.values) : std::vector<Vec3f>{}, context);
    if (context.is_cancelled()) return cancelled_error();
    if (rest.normals.empty() || has_vertex_normals()) return Success{};

    items.clear();
    std::vector<Vec3f> normals;
    for (Index i = 0; i < vertex_of_normal.size(); ++i) {
        if (vertex_of_normal[i] == kNoIndex) continue;
        items.push_back({finest_id(vertex_of_normal[i]), i});
        normals.push_back(rest.normals.values[i]);
    }
    blend_normals.emplace(detail, positions, driver, items, unit(std::move(normals)), context);
    if (context.is_cancelled()) return cancelled_error();
    return Success{};
}

std::vector<Mat3f> Restorer::Content::gradients(const Pose& pose, const RunContext& context) const {
    if (!pose.gradients.empty()) return pose.gradients;
    return fit(context.threads()).fit(pose.positions, context);
}

Result<unsigned> restored_level(const Model& model, const RestoreOptions& options) {
    if (options.level && *options.level > model.finest_level())
        return Error{ErrorCode::usage, "The model has levels 0 to " + std::to_string(model.finest_level()) +
                                           "; there is no level " + std::to_string(*options.level) + "."};
    return options.level.value_or(model.finest_level());
}

Status check_pose(const Model& model, const Pose& pose) { return check_pose(model.driver().vertices.size(), pose); }

Status check_pose(std::size_t driver, const Pose& pose) {
    const auto wrong = [&](std::size_t count, const char* what) {
        return Error{ErrorCode::mismatch,
                     "The pose has " + std::to_string(count) + " " + what + " and the model's driver " +
                         std::to_string(driver) +
                         " vertices; it is of another model, or of a driver whose vertices were changed."};
    };
    if (pose.positions.size() != driver) return wrong(pose.positions.size(), "vertices");
    if (!pose.gradients.empty() && pose.gradients.size() != driver) return wrong(pose.gradients.size(), "gradients");
    return Success{};
}

Restorer::Restorer(std::unique_ptr<Content> content) : content_(std::move(content)) {}
Restorer::Restorer(Restorer&&) noexcept = default;
Restorer& Restorer::operator=(Restorer&&) noexcept = default;
Restorer::~Restorer() = default;

Result<Restorer> Restorer::create(const Model& model, const RestoreOptions& options, const RunContext& context) {
    const Result<unsigned> level = restored_level(model, options);
    if (!level) return level.error();
    auto content = std::make_unique<Content>();
    content->model = &model;
    if (context.is_cancelled()) return cancelled_error();
    content->rest = level_mesh(model, *level);
    if (*level < model.finest_level()) content->vertices = model.levels[*level].vertices;
    content->vertex_of_normal = split_shared_normals(content->rest);
    if (context.is_cancelled()) return cancelled_error();
    if (Status prepared = content->prepare(context); !prepared) return prepared.error();
    return Restorer(std::move(content));
}

std::size_t Restorer::vertex_count() const { return content_->rest.vertex_count(); }

Result<std::vector<Mat3f>> Restorer::gradients(const Pose& pose, const RunContext& context) const {
    if (Status status = check_pose(*content_->model, pose); !status) return status.error();
    return content_->gradients(pose, context);
}

Result<std::vector<Vec3f>> Restorer::positions(const Pose& pose, const RunContext& context) const {
    std::vector<Vec3f> restored(vertex_count());
    if (Status status = positions(pose, restored, context); !status) return status.error();
    return restored;
}

Status Restorer::positions(const Pose& pose, std::span<Vec3f> out, const RunContext& context) const {
    const Content& content = *content_;
    if (Status status = check_pose(*content.model, pose); !status) return status.error();
    if (out.size() != vertex_count())
        return Error{ErrorCode::mismatch, "There is room for " + std::to_string(out.size()) +
                                              " positions and the level has " + std::to_string(vertex_count()) + "."};
    if (context.is_cancelled()) return cancelled_error();
    content.blend->restore(pose.positions, content.gradients(pose, context), out, {}, true, context);
    return Success{};
}

Result<Mesh> Restorer::mesh(const Pose& pose, const RunContext& context) const {
    if (Status status = check_pose(*content_->model, pose); !status) return status.error();
    if (context.is_cancelled()) return cancelled_error();
    return mesh(pose, content_->gradients(pose, context), context);
}

Result<Mesh> Restorer::mesh(const Pose& pose, std::span<const Mat3f> gradients, const RunContext& context) const {
    const Content& content = *content_;
    if (Status status = check_pose(*content.model, pose); !status) return status.error();
    if (gradients.size() != pose.positions.size())
        return Error{ErrorCode::mismatch, "There are " + std::to_string(gradients.size()) + " gradients for " +
                                              std::to_string(pose.positions.size()) + " driver vertices."};
    if (context.is_cancelled()) return cancelled_error();
    Mesh mesh = content.rest;
    const bool with_normals = content.has_vertex_normals();
    content.blend->restore(pose.positions, gradients, mesh.positions,
                           with_normals ? std::span(mesh.normals.values) : std::span<Vec3f>{}, true, context);
    if (content.blend_normals)
        content.blend_normals->restore(pose.positions, gradients, {}, mesh.normals.values, true, context);
    return mesh;
}

} // namespace filigree
