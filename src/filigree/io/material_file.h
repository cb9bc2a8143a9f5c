// Materials of OBJ files: the colours and pictures that a .mtl names.
#pragma once

#include "filigree/core/result.h"
#include "filigree/mesh/mesh.h"

#include <filesystem>
#include <string>
#include <vector>

namespace filigree {

/// What we use of a material.
struct MeshMaterial {
    std::string name;
    /// Diffuse (Kd), sRGB 0 to 1. White beside a texture when the file says nothing or black, as some programs do.
    Vec3f color = {0.8f, 0.8f, 0.8f};
    std::filesystem::path picture; ///< diffuse texture (map_Kd), ready to be opened; empty: none
};

/// One material for each of mesh.materials.names, from the libraries that the mesh names, looked for beside
/// `mesh_path`; and one sentence for whatever was missing or not understood (a library, a material, a texture). Names
/// that lead out of the mesh's folder are not followed. Never fails: a mesh can be drawn without its materials.
struct MeshMaterials {
    std::vector<MeshMaterial> materials;
    std::vector<std::string> warnings;
};
MeshMaterials read_materials(const Mesh& mesh, const std::filesystem::path& mesh_path);

} // namespace filigree
