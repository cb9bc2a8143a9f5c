// The levels of a model as GLB: alternatives of one node [MSFT_lod].
#include "filigree/io/glb_parts.h"
#include "filigree/io/gltf_export.h"

#include <algorithm>
#include <new>

namespace filigree {

namespace {

using Json = GlbBuilder::Json;

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

class LevelsWriter {
public:
    LevelsWriter(const Model& model, const std::filesystem::path& materials_beside)
        : model_(model), found_(find_glb_materials(model.mesh, materials_beside)), warnings_(found_.warnings) {
        if (!model.mesh.materials.empty()) vertex_materials_ = vertex_materials(model.mesh);
    }

    Result<std::vector<std::string>> write(const std::filesystem::path& path, const RunContext& context) {
        const unsigned finest = model_.finest_level();
        std::vector<std::size_t> nodes;
        for (unsigned k = finest + 1; k-- > 0;) {
            if (context.is_cancelled()) return cancelled_error();
            nodes.push_back(add_level(k));
            context.report("Writing levels", static_cast<double>(finest + 1 - k) / (finest + 2));
        }
        Json& first = builder_.json["nodes"][nodes[0]];
        first["extensions"]["MSFT_lod"]["ids"] = std::vector<std::size_t>(nodes.begin() + 1, nodes.end());
        first["extras"]["MSFT_screencoverage"] = screen_coverages();
        builder_.json["extensionsUsed"] = {"MSFT_lod"};
        builder_.json["scenes"].push_back({{"nodes", Json::array({nodes[0]})}});
        builder_.json["scene"] = 0;
        if (const Status written = builder_.write(path, context); !written) return written.error();
        return warnings_;
    }

private:
    /// The level's node; with several objects, a node above theirs.
    std::size_t add_level(unsigned k) {
        Mesh mesh = level_mesh(model_, k);
        if (k < model_.finest_level() && !model_.mesh.materials.empty())
            mesh.materials = nearby_materials(mesh, model_.levels[k], model_.mesh.materials, vertex_materials_);
        const GlbParts parts = make_glb_parts(mesh);
        const std::vector<std::size_t> nodes = add_glb_nodes(builder_, parts, mesh, materials_for(parts));
        if (k == model_.finest_level()) tell_losses(mesh, parts);
        std::size_t node = nodes[0];
        if (nodes.size() > 1) {
            node = builder_.json["nodes"].size();
            builder_.json["nodes"].push_back({{"children", nodes}});
        }
        builder_.json["nodes"][node]["name"] = "level " + std::to_string(k);
        return node;
    }

    /// Levels share their materials, but one without UVs cannot have pictures, and one without colours is greyer.
    const GlbMaterials& materials_for(const GlbParts& parts) {
        const std::pair<bool, bool> kind(parts.uvs.empty(), parts.has_colors);
        const auto known = std::find_if(added_.begin(), added_.end(), [&](const auto& a) { return a.first == kind; });
        if (known != added_.end()) return known->second;
        GlbMaterials materials = add_glb_materials(builder_, parts, found_.materials);
        if (added_.empty()) // what the finest level lacks; that coarser ones have no pictures is in the manual
            warnings_.insert(warnings_.end(), materials.warnings.begin(), materials.warnings.end());
        added_.emplace_back(kind, std::move(materials));
        return added_.back().second;
    }

    void tell_losses(const Mesh& mesh, const GlbParts& parts) {
        std::string lost;
        for (std::size_t i = 0; i < parts.lost.size(); ++i)
            lost += (i == 0 ? "" : i + 1 < parts.lost.size() ? ", " : " and ") + parts.lost[i];
        if (!lost.empty()) warnings_.insert(warnings_.begin(), "GLB cannot hold " + lost + "; left out.");
        const bool by_corner =
            (!mesh.uvs.empty() && !mesh.uvs.per_vertex()) || (!mesh.normals.empty() && !mesh.normals.per_vertex());
        if (by_corner && model_.finest_level() > 0)
            warnings_.emplace_back("UVs and normals of corners are in the finest level alone.");
    }

    /// Down to which part of the screen each level is shown: as far as the next one has triangles for. The last never
    /// goes away.
    std::vector<double> screen_coverages() const {
        std::vector<double> coverages;
        for (unsigned k = model_.finest_level(); k-- > 0;)
            coverages.push_back(static_cast<double>(model_.levels[k].face_count()) /
                                static_cast<double>(std::max<std::size_t>(1, model_.mesh.face_count())));
        coverages.push_back(0);
        return coverages;
    }

    const Model& model_;
    MeshMaterials found_;
    std::vector<std::string> warnings_;
    std::vector<Index> vertex_materials_;
    std::vector<std::pair<std::pair<bool, bool>, GlbMaterials>> added_;
    GlbBuilder builder_;
};

} // namespace

Result<std::vector<std::string>> write_levels_glb(const Model& model, const std::filesystem::path& path,
                                                  const std::filesystem::path& materials_beside,
                                                  const RunContext& context) {
    try {
        return LevelsWriter(model, materials_beside).write(path, context);
    } catch (const std::bad_alloc&) {
        return Error{ErrorCode::out_of_memory, path.string() + ": does not fit into memory."};
    }
}

} // namespace filigree
