#include "restored_error.h"

#include "filigree/mesh/mesh_distance.h"

namespace filigree::studio {

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
