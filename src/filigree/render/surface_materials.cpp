#include "filigree/render/surface_materials.h"

#include "filigree/io/mesh/material_file.h"

#include <map>

namespace filigree {

namespace {

/// How messages call a picture inside the mesh's file.
std::string texture_name(const MeshMaterial& material, const std::filesystem::path& mesh_path) {
    const std::string texture = "the texture of the material '" + material.name + "'";
    return mesh_path.empty() ? texture : mesh_path.string() + ", " + texture;
}

void decode(std::span<const MeshMaterial> materials, const std::filesystem::path& mesh_path, SurfaceMaterials& loaded) {
    using Source = std::pair<std::filesystem::path, const std::string*>;
    std::map<Source, const Picture*> known;
    for (const MeshMaterial& material : materials) {
        SurfaceMaterial& surface = loaded.materials.emplace_back(SurfaceMaterial{material.color, nullptr});
        if (!material.has_picture()) continue;
        const auto [entry, is_new] = known.try_emplace({material.picture, material.picture_bytes.get()}, nullptr);
        if (is_new) {
            Result<Picture> picture = material.picture_bytes
                                          ? decode_picture(*material.picture_bytes, texture_name(material, mesh_path))
                                          : read_picture(material.picture);
            if (!picture) loaded.warnings.push_back(picture.error().message);
            if (picture) loaded.pictures.push_back(std::make_shared<Picture>(std::move(*picture)));
            entry->second = picture ? loaded.pictures.back().get() : nullptr;
        }
        surface.picture = entry->second;
    }
}

} // namespace

SurfaceMaterials decoded_materials(std::span<const MeshMaterial> materials) {
    SurfaceMaterials loaded;
    decode(materials, {}, loaded);
    return loaded;
}

SurfaceMaterials load_surface_materials(const Mesh& mesh, const std::filesystem::path& mesh_path) {
    SurfaceMaterials loaded;
    if (mesh.materials.empty()) return loaded;
    MeshMaterials found = read_materials(mesh, mesh_path);
    loaded.warnings = std::move(found.warnings);
    if (mesh.uvs.empty())
        for (MeshMaterial& material : found.materials) {
            material.picture.clear();
            material.picture_bytes = nullptr;
        }
    decode(found.materials, mesh_path, loaded);
    return loaded;
}

} // namespace filigree
