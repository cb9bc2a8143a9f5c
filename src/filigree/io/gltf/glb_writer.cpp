// Static meshes as GLB.
#include "filigree/io/gltf/glb_parts.h"
#include "filigree/io/mesh/mesh_formats.h"

namespace filigree {

Result<WriteNotes> write_glb(const Mesh& mesh, const WriteMeshOptions& options, std::string& bytes,
                             const RunContext& context) {
    WriteNotes notes;
    GlbBuilder builder;
    {
        const Result<GlbParts> made = make_glb_parts(mesh, {}, context);
        if (!made) return made.error();
        const GlbParts& parts = *made;
        notes.lost = parts.lost;
        MeshMaterials materials = find_glb_materials(mesh, options.materials_beside);
        notes.warnings = std::move(materials.warnings);
        const GlbMaterials added = add_glb_materials(builder, parts, materials.materials);
        notes.warnings.insert(notes.warnings.end(), added.warnings.begin(), added.warnings.end());
        const std::vector<std::size_t> nodes = add_glb_nodes(builder, parts, mesh, added);
        builder.json["scene"] = 0;
        builder.json["scenes"].push_back({{"nodes", nodes}});
    }
    Result<std::string> file = builder.bytes();
    if (!file) return file.error();
    bytes = *std::move(file);
    return notes;
}

} // namespace filigree
