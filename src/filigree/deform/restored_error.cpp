#include "filigree/deform/restored_error.h"

namespace filigree {

Result<VertexDistance> restored_error(const Model& model, const RestoreOptions& restore, const Pose& pose,
                                      std::span<const Vec3f> full, const RunContext& context) {
    context.report("measuring the error", 0);
    if (full.size() != model.vertex_count())
        return Error{ErrorCode::mismatch, "There are " + std::to_string(full.size()) + " places for " +
                                              std::to_string(model.vertex_count()) + " vertices."};
    const unsigned number = restore.level.value_or(model.finest_level());
    if (model.driver_is_behind && number < model.finest_level())
        return Error{ErrorCode::unsuitable,
                     "The driver was made elsewhere, and nothing says where its vertices should be; "
                     "the finest level's error is known."};
    const Mesh level = level_mesh(model, number);
    std::vector<Vec3f> chosen;
    if (number < model.finest_level()) {
        for (const Index v : model.levels[number].vertices) chosen.push_back(full[v]);
        full = chosen;
    }
    if (pose.positions.empty()) return vertex_distance(level, level.positions, full, context);
    const Result<Restorer> restorer = Restorer::create(model, restore, context);
    if (!restorer) return restorer.error();
    const Result<std::vector<Vec3f>> restored = restorer->positions(pose, context);
    if (!restored) return restored.error();
    if (context.is_cancelled()) return cancelled_error();
    return vertex_distance(level, *restored, full, context);
}

} // namespace filigree
