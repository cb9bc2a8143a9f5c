#include "filigree/io/gltf/glb_levels.h"

#include <algorithm>

namespace filigree {

namespace {

/// The first material that a face around each vertex of the finest mesh has.
std::vector<Index> vertex_materials(const Mesh& mesh) {
    std::vector<Index> of_vertex(mesh.vertex_count(), kNoIndex);
    for (std::size_t f = 0; f < mesh.face_count(); ++f)
        for (const Index v : mesh.face(f))
            if (of_vertex[v] == kNoIndex) of_vertex[v] = mesh.materials.of_face[f];
    return of_vertex;
}

/// Faces of coarser levels have no labels of their own: each takes the material that most of its vertices are near.
FaceLabels nearby_materials(const Mesh& coarse, const Level& level, const FaceLabels& fine,
                            std::span<const Index> of_vertex) {
    FaceLabels labels{fine.names, {}};
    for (std::size_t f = 0; f < coarse.face_count(); ++f) {
        Index best = kNoIndex;
        std::ptrdiff_t most = 0;
        const std::span<const Index> face = coarse.face(f);
        const auto material = [&](Index v) { return of_vertex[level.vertices[v]]; };
        for (const Index v : face) {
            const std::ptrdiff_t count =
                std::count_if(face.begin(), face.end(), [&](Index other) { return material(other) == material(v); });
            if (count > most) most = count, best = material(v);
        }
        labels.of_face.push_back(best);
    }
    return labels;
}

} // namespace

GlbLevels::GlbLevels(const Model& model, const std::filesystem::path& materials_beside)
    : model_(model), found_(find_glb_materials(model.mesh, materials_beside)), warnings_(found_.warnings) {
    if (!model.mesh.materials.empty()) vertex_materials_ = vertex_materials(model.mesh);
}

Mesh GlbLevels::mesh(unsigned level) const {
    Mesh mesh = level_mesh(model_, level);
    if (level < model_.finest_level() && !model_.mesh.materials.empty())
        mesh.materials = nearby_materials(mesh, model_.levels[level], model_.mesh.materials, vertex_materials_);
    return mesh;
}

const GlbMaterials& GlbLevels::add_materials(GlbBuilder& builder, const GlbParts& parts) {
    const std::pair<bool, bool> kind(parts.uvs.empty(), parts.has_colors);
    const auto known = std::find_if(added_.begin(), added_.end(), [&](const auto& a) { return a.first == kind; });
    if (known != added_.end()) return known->second;
    GlbMaterials materials = add_glb_materials(builder, parts, found_.materials);
    if (added_.empty()) // what the finest level lacks; that coarser ones have no pictures is in the manual
        warnings_.insert(warnings_.end(), materials.warnings.begin(), materials.warnings.end());
    added_.emplace_back(kind, std::move(materials));
    return added_.back().second;
}

std::vector<double> GlbLevels::screen_coverages(unsigned top, std::size_t count) const {
    const auto faces = [&](unsigned level) { return level_counts(model_, level).faces; };
    std::vector<double> coverages;
    for (unsigned k = 1; k < count; ++k)
        coverages.push_back(static_cast<double>(faces(top - k)) /
                            static_cast<double>(std::max<std::size_t>(1, faces(top))));
    coverages.push_back(0);
    return coverages;
}

} // namespace filigree
