// A mesh's colours and textures from the libraries it names, ready to be drawn.
#pragma once

#include "filigree/render.h"

#include <filesystem>
#include <memory>
#include <span>

namespace filigree {

/// What SurfaceOptions::materials takes. Has to outlive the drawable's upload.
struct SurfaceMaterials {
    std::vector<SurfaceMaterial> materials;         ///< empty, or one a name in mesh.materials
    std::vector<std::shared_ptr<Picture>> pictures; ///< that the materials point to
    std::vector<std::string> warnings;              ///< a sentence for whatever was missing
};

/// Of materials whose pictures are bytes, such as a mesh's embedded ones.
SurfaceMaterials decoded_materials(std::span<const MeshMaterial> materials);

/// As read_materials, with the pictures. Never fails: a mesh can be drawn without them. The mesh is not checked.
SurfaceMaterials load_surface_materials(const Mesh& mesh, const std::filesystem::path& mesh_path);

} // namespace filigree
