// The levels of a model as GLB: alternatives of one node [MSFT_lod].
#include "filigree/file.h"

#include "filigree/io/glb_levels.h"
#include "filigree/io/losses.h"

#include <new>

namespace filigree {

namespace {

using Json = GlbBuilder::Json;

class LevelsWriter {
public:
    LevelsWriter(const Model& model, const std::filesystem::path& materials_beside)
        : model_(model), levels_(model, materials_beside) {}

    Result<std::vector<std::string>> write(const std::filesystem::path& path, const RunContext& context) {
        const unsigned finest = model_.finest_level();
        std::vector<std::size_t> nodes;
        for (unsigned k = finest + 1; k-- > 0;) {
            if (context.is_cancelled()) return cancelled_error();
            const Result<std::size_t> node = add_level(k, context);
            if (!node) return node.error();
            nodes.push_back(*node);
            context.report("Writing levels", static_cast<double>(finest + 1 - k) / (finest + 2));
        }
        Json& first = builder_.json["nodes"][nodes[0]];
        first["extensions"]["MSFT_lod"]["ids"] = std::vector<std::size_t>(nodes.begin() + 1, nodes.end());
        first["extras"]["MSFT_screencoverage"] = levels_.screen_coverages(finest, nodes.size());
        builder_.json["extensionsUsed"] = {"MSFT_lod"};
        builder_.json["scenes"].push_back({{"nodes", Json::array({nodes[0]})}});
        builder_.json["scene"] = 0;
        if (const Status written = builder_.write(path, context); !written) return written.error();
        std::vector<std::string> warnings = levels_.warnings();
        warnings.insert(warnings.begin(), losses_.begin(), losses_.end());
        return warnings;
    }

private:
    /// The level's node; with several objects, a node above theirs.
    Result<std::size_t> add_level(unsigned k, const RunContext& context) {
        const Mesh mesh = levels_.mesh(k);
        const Result<GlbParts> made = make_glb_parts(mesh, {}, context);
        if (!made) return made.error();
        const GlbParts& parts = *made;
        const std::vector<std::size_t> nodes =
            add_glb_nodes(builder_, parts, mesh, levels_.add_materials(builder_, parts));
        if (k == model_.finest_level()) tell_losses(mesh, parts);
        std::size_t node = nodes[0];
        if (nodes.size() > 1) {
            node = builder_.json["nodes"].size();
            builder_.json["nodes"].push_back({{"children", nodes}});
        }
        builder_.json["nodes"][node]["name"] = "level " + std::to_string(k);
        return node;
    }

    void tell_losses(const Mesh& mesh, const GlbParts& parts) {
        if (!parts.lost.empty()) losses_.push_back(cannot_hold("GLB", parts.lost));
        const bool by_corner =
            (!mesh.uvs.empty() && !mesh.uvs.per_vertex()) || (!mesh.normals.empty() && !mesh.normals.per_vertex());
        if (by_corner && model_.finest_level() > 0)
            losses_.emplace_back("UVs and normals of corners are in the finest level alone.");
    }

    const Model& model_;
    GlbLevels levels_;
    std::vector<std::string> losses_; ///< a sentence each
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
