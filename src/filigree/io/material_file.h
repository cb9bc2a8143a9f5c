// Materials of a mesh: embedded in it, or the colours and pictures that an OBJ's .mtl names.
#pragma once

#include "filigree/mesh.h"
#include "filigree/result.h"

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace filigree {

/// One material for each of mesh.materials.names: the embedded ones, else from the libraries that the mesh names,
/// looked for beside `mesh_path`; and one sentence for whatever was missing or not understood (a library, a material, a
/// texture). Names that lead out of the mesh's folder are not followed. Never fails: a mesh can be drawn without its
/// materials. Meshes are not checked here: only their names and materials are read.
struct MeshMaterials {
    std::vector<MeshMaterial> materials;
    std::vector<std::string> warnings;
};
MeshMaterials read_materials(const Mesh& mesh, const std::filesystem::path& mesh_path);
/// The same with pictures as bytes; those that cannot be read are left out, with a sentence.
MeshMaterials read_materials_and_pictures(const Mesh& mesh, const std::filesystem::path& mesh_path);

/// mesh.materials.names as an OBJ can hold them: on one line, without blanks around them, none empty, none twice.
std::vector<std::string> obj_material_names(const Mesh& mesh);

/// The embedded materials of a mesh as the files that go beside its OBJ x.obj: x.mtl, and x_NAME.png or .jpg for each
/// picture, NAME being that of its material. Nothing is written. A name that a file has already gets a number (x_2.mtl)
/// unless that file is a library we wrote, or a picture that one names.
struct MaterialLibrary {
    struct File {
        std::string name;
        std::shared_ptr<const std::string> bytes;
    };
    std::string name;        ///< of the library
    std::vector<File> files; ///< pictures, then the library
    std::vector<std::string> warnings;
};
MaterialLibrary make_material_library(const Mesh& mesh, const std::filesystem::path& obj_path);

/// How a picture's file begins: ".png", ".jpg", or "" for what is neither.
std::string_view picture_extension(std::string_view bytes);

} // namespace filigree
