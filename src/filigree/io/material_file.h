// Materials of a mesh: embedded in it, or the colours and pictures that an OBJ's .mtl names.
#pragma once

#include "filigree/core/result.h"
#include "filigree/mesh/mesh.h"

#include <filesystem>
#include <string>
#include <vector>

namespace filigree {

/// One material for each of mesh.materials.names: the embedded ones, else from the libraries that the mesh names,
/// looked for beside `mesh_path`; and one sentence for whatever was missing or not understood (a library, a material, a
/// texture). Names that lead out of the mesh's folder are not followed. Never fails: a mesh can be drawn without its
/// materials.
struct MeshMaterials {
    std::vector<MeshMaterial> materials;
    std::vector<std::string> warnings;
};
MeshMaterials read_materials(const Mesh& mesh, const std::filesystem::path& mesh_path);

} // namespace filigree
