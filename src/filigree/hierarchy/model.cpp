#include "filigree/hierarchy/model.h"

namespace filigree {

Mesh level_mesh(const Model& model, unsigned level) {
    if (level >= model.finest_level()) return model.mesh;
    const Mesh& full = model.mesh;
    const Level& source = model.levels[level];
    Mesh mesh;
    mesh.origin = full.origin;
    mesh.face_offsets = source.face_offsets;
    mesh.corners = source.corners;
    const auto pick = [&](const auto& from, auto& to) {
        to.reserve(source.vertices.size());
        for (Index v : source.vertices) to.push_back(from[v]);
    };
    pick(full.positions, mesh.positions);
    if (!full.uvs.empty() && full.uvs.per_vertex()) pick(full.uvs.values, mesh.uvs.values);
    if (!full.normals.empty() && full.normals.per_vertex()) pick(full.normals.values, mesh.normals.values);
    if (!full.colors.empty()) pick(full.colors, mesh.colors);
    mesh.colors_have_alpha = full.colors_have_alpha;
    for (const VertexScalar& scalar : full.scalars) {
        mesh.scalars.push_back({scalar.name, {}});
        pick(scalar.values, mesh.scalars.back().values);
    }
    return mesh;
}

std::vector<Vec3f> driver_positions(const Model& model) {
    std::vector<Vec3f> positions;
    positions.reserve(model.driver().vertices.size());
    for (Index v : model.driver().vertices) positions.push_back(model.mesh.positions[v]);
    return positions;
}

} // namespace filigree
