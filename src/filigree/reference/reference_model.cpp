#include "filigree/reference.h"

#include "filigree/mesh/normals.h"
#include "filigree/reference/reference_code.h"

namespace filigree {

Result<ReferenceModel> strip_to_reference(Mesh mesh, const ReferenceOptions& options, const RunContext& context) {
    Result<ReferenceDetail> detail = encode_reference(mesh, options, context);
    if (!detail) return detail.error();
    ReferenceModel model{.mesh = std::move(mesh), .levels = {}, .detail = std::move(*detail)};
    const ReferenceRestorer restorer(model.detail, HeightLaw::keep, context);
    std::vector<Index> local(model.mesh.vertex_count(), kNoIndex);
    for (unsigned k = 0; k < model.detail.patches.levels; ++k) {
        Level level;
        level.vertices = restorer.level_vertices(k);
        for (Index i = 0; i < level.vertices.size(); ++i) local[level.vertices[i]] = i;
        for (const auto& quad : restorer.level_quads(k)) {
            for (const Index v : quad) level.corners.push_back(local[v]);
            level.face_offsets.push_back(static_cast<Index>(level.corners.size()));
        }
        model.levels.push_back(std::move(level));
    }
    split_shared_normals(model.mesh);
    return model;
}

Result<Mesh> restore_reference(const ReferenceModel& model, std::span<const Vec3f> driver,
                               const ReferenceRestoreOptions& options, const RunContext& context) {
    const unsigned level = options.level.value_or(model.finest_level());
    if (level > model.finest_level())
        return Error{ErrorCode::usage, "The model has levels 0 to " + std::to_string(model.finest_level()) +
                                           "; there is no level " + std::to_string(level) + "."};
    if (driver.size() != model.driver().vertices.size())
        return Error{ErrorCode::mismatch, "The pose has " + std::to_string(driver.size()) +
                                              " vertices and the model's driver " +
                                              std::to_string(model.driver().vertices.size()) + "."};
    if (context.is_cancelled()) return cancelled_error();
    const ReferenceRestorer restorer(model.detail, options.law, context);
    if (context.is_cancelled()) return cancelled_error();
    Mesh mesh = level_mesh(model, level);
    const std::vector<Index> vertex_of_normal = split_shared_normals(mesh);
    std::vector<Vec3f> restored = model.mesh.positions; // by the finest mesh's ids
    restorer.restore(driver, level, restored, context);
    if (level == model.finest_level())
        mesh.positions = std::move(restored);
    else
        for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
            mesh.positions[v] = restored[model.levels[level].vertices[v]];
    if (mesh.normals.empty()) return mesh;
    const std::vector<Vec3f> normals = vertex_normals(mesh, mesh.positions, context);
    for (std::size_t i = 0; i < mesh.normals.values.size(); ++i)
        if (vertex_of_normal[i] != kNoIndex) mesh.normals.values[i] = normals[vertex_of_normal[i]];
    return mesh;
}

Mesh level_mesh(const ReferenceModel& model, unsigned level) {
    return level >= model.finest_level() ? model.mesh : level_mesh(model.mesh, model.levels[level]);
}

std::vector<Vec3f> driver_positions(const ReferenceModel& model) {
    std::vector<Vec3f> positions;
    for (const Index v : model.driver().vertices) positions.push_back(model.mesh.positions[v]);
    return positions;
}

std::string check_model(const ReferenceModel& model) {
    if (std::string wrong = check_mesh(model.mesh); !wrong.empty()) return wrong;
    if (model.levels.empty()) return "there is no driver";
    for (const Level& level : model.levels)
        if (std::string wrong = check_level(level, model.mesh.vertex_count()); !wrong.empty()) return wrong;
    if (model.detail.patches.levels != model.levels.size() ||
        model.detail.rest_driver.size() != model.driver().vertices.size())
        return "levels and patches differ";
    return check_reference(model.detail, model.mesh.vertex_count());
}

} // namespace filigree
