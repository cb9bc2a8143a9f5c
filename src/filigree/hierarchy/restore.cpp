#include "filigree/hierarchy/restore.h"

#include "filigree/mesh/normals.h"

#include <mutex>

namespace filigree {

struct Restorer::Content {
    const Model* model = nullptr;
    RestoreOptions options;
    unsigned level = 0;
    HeightLaw law = HeightLaw::proportional;
    Mesh rest;                           ///< the level at rest, with split normals
    std::vector<Index> vertices;         ///< ids in the finest mesh; empty at the finest level
    std::vector<Index> vertex_of_normal; ///< of rest.normals.values, in the level's own ids

    // blend code
    mutable std::once_flag gradient_fit_made;
    mutable std::optional<GradientFit> gradient_fit; ///< made for the first pose without gradients
    std::optional<BlendRestorer> blend;              ///< positions, and normals where there is one a vertex
    std::optional<BlendRestorer> blend_normals;      ///< normals alone, where corners have their own

    // reference code
    std::optional<ReferenceRestorer> reference;

    bool has_vertex_normals() const { return !rest.normals.empty() && rest.normals.per_vertex(); }
    Status prepare_blend(const RunContext& context);
    const GradientFit& fit(unsigned threads) const;
    std::vector<Mat3f> gradients(const Pose& pose, const RunContext& context) const;
};

namespace {

std::vector<Vec3f> unit(std::vector<Vec3f> normals) {
    for (Vec3f& n : normals) n = n.cast<double>().normalized().cast<float>();
    return normals;
}

} // namespace

/// Not for a pose's own context: cancelled half way, it would stay half made.
const GradientFit& Restorer::Content::fit(unsigned threads) const {
    std::call_once(gradient_fit_made, [&] {
        gradient_fit.emplace(level_mesh(*model, 0), options.thin_shell ? NormalColumn::shell : NormalColumn::fitted,
                             RunContext(threads));
    });
    return *gradient_fit;
}

Status Restorer::Content::prepare_blend(const RunContext& context) {
    const BlendDetail& detail = std::get<BlendDetail>(model->detail);
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
    if (!blend) return {};
    if (pose.gradients.empty() && pose.ghosts.empty()) return fit(context.threads()).fit(pose.positions, law, context);
    std::vector<Mat3f> given = pose.gradients.empty()
                                   ? fit(context.threads()).fit_to_ghosts(pose.positions, pose.ghosts, context)
                                   : pose.gradients;
    if (options.thin_shell) fit(context.threads()).make_shell(given, law);
    return given;
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
    if (!pose.ghosts.empty() && pose.ghosts.size() != driver) return wrong(pose.ghosts.size(), "ghost points");
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
    content->options = options;
    content->level = *level;
    if (context.is_cancelled()) return cancelled_error();
    content->rest = level_mesh(model, content->level);
    if (content->level < model.finest_level()) content->vertices = model.levels[content->level].vertices;
    content->vertex_of_normal = split_shared_normals(content->rest);
    if (context.is_cancelled()) return cancelled_error();
    if (model.code() == DetailCode::blend) {
        content->law = options.law.value_or(HeightLaw::proportional);
        if (Status prepared = content->prepare_blend(context); !prepared) return prepared.error();
    } else {
        content->law = options.law.value_or(HeightLaw::inverse);
        content->reference.emplace(std::get<ReferenceDetail>(model.detail), content->law, context);
        if (context.is_cancelled()) return cancelled_error();
    }
    return Restorer(std::move(content));
}

std::size_t Restorer::vertex_count() const { return content_->rest.vertex_count(); }

std::vector<Vec3f> Restorer::rest_ghosts() const {
    return content_->blend ? content_->fit(0).rest_ghosts() : std::vector<Vec3f>{};
}

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
    if (content.blend) {
        content.blend->restore(pose.positions, content.gradients(pose, context), out, {}, true, context);
        return Success{};
    }
    if (content.vertices.empty()) { // the finest level: ids and slots are the same
        content.reference->restore(pose.positions, content.level, out, context);
        return Success{};
    }
    std::vector<Vec3f> all = content.model->mesh.positions; // a damaged level may name others than come
    content.reference->restore(pose.positions, content.level, all, context);
    for (std::size_t v = 0; v < out.size(); ++v) out[v] = all[content.vertices[v]];
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
    if (content.blend && gradients.size() != pose.positions.size())
        return Error{ErrorCode::mismatch, "There are " + std::to_string(gradients.size()) + " gradients for " +
                                              std::to_string(pose.positions.size()) + " driver vertices."};
    if (context.is_cancelled()) return cancelled_error();
    Mesh mesh = content.rest;
    if (content.blend) {
        const bool with_normals = content.has_vertex_normals();
        content.blend->restore(pose.positions, gradients, mesh.positions,
                               with_normals ? std::span(mesh.normals.values) : std::span<Vec3f>{}, true, context);
        if (content.blend_normals)
            content.blend_normals->restore(pose.positions, gradients, {}, mesh.normals.values, true, context);
        return mesh;
    }
    Result<std::vector<Vec3f>> restored = positions(pose, context);
    if (!restored) return restored.error();
    mesh.positions = std::move(*restored);
    if (!mesh.normals.empty()) {
        const std::vector<Vec3f> normals = vertex_normals(mesh, mesh.positions, context);
        for (std::size_t i = 0; i < mesh.normals.values.size(); ++i)
            if (content.vertex_of_normal[i] != kNoIndex) mesh.normals.values[i] = normals[content.vertex_of_normal[i]];
    }
    return mesh;
}

} // namespace filigree
