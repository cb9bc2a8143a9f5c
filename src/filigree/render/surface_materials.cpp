#include "filigree/render/surface_materials.h"

#include "filigree/io/material_file.h"

#include <map>

namespace filigree {

SurfaceMaterials load_surface_materials(const Mesh& mesh, const std::filesystem::path& mesh_path) {
    SurfaceMaterials loaded;
    if (mesh.materials.empty()) return loaded;
    MeshMaterials found = read_materials(mesh, mesh_path);
    loaded.warnings = std::move(found.warnings);
    std::map<std::filesystem::path, const Picture*> known;
    for (const MeshMaterial& material : found.materials) {
        SurfaceMaterial& surface = loaded.materials.emplace_back(SurfaceMaterial{material.color, nullptr});
        if (material.picture.empty() || mesh.uvs.empty()) continue;
        if (!known.contains(material.picture)) {
            Result<Picture> picture = read_picture(material.picture);
            if (!picture) loaded.warnings.push_back(picture.error().message);
            if (picture) loaded.pictures.push_back(std::make_shared<Picture>(std::move(*picture)));
            known[material.picture] = picture ? loaded.pictures.back().get() : nullptr;
        }
        surface.picture = known[material.picture];
    }
    return loaded;
}

} // namespace filigree
