// Meshes in files: OBJ, PLY, STL, OFF, glTF.
#pragma once

#include "filigree/core/result.h"
#include "filigree/core/run_context.h"
#include "filigree/mesh/mesh.h"

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace filigree {

enum class MeshFormat { obj, ply, stl, off, gltf };

/// A mesh and what could not be kept or had to be mended while reading it, one sentence each.
struct MeshFile {
    Mesh mesh;
    std::vector<std::string> warnings;
};

/// The format a file name's extension stands for (any case), or `unsupported` with the list of those we know.
Result<MeshFormat> mesh_format(const std::filesystem::path& path);

/// Reads a mesh; "-" reads standard input (the format is then found from the content). The format comes from the
/// content where it can be told, else from the extension. Vertex and face order are the file's. A mesh without faces is
/// read (as points) with a warning. What comes back passes check_mesh.
/// Errors: not_found, bad_file ("cow.obj:214: ..."), unsupported, out_of_memory, cancelled.
/// Cost: one pass; memory a small multiple of the file.
Result<MeshFile> read_mesh(const std::filesystem::path& path, const RunContext& context);

/// The same from bytes in memory; `name` stands in messages, and its extension decides where the content cannot.
Result<MeshFile> read_mesh(std::string_view bytes, const std::string& name, const RunContext& context);

struct WriteMeshOptions {
    std::optional<MeshFormat> format = std::nullopt; ///< unset: from the file name's extension
    bool ascii = false;                              ///< PLY and STL: text instead of binary
    bool big_endian = false;                         ///< PLY: binary, most significant byte first
    /// GLB: the mesh's own path; colours and textures from the material libraries beside it are embedded. Empty: no
    /// library is looked for.
    std::filesystem::path materials_beside = {};
};

/// Writes a mesh through a temporary file beside `path` and a rename, so that `path` is either whole or untouched;
/// "-" writes standard output and needs `options.format`. Embedded materials go beside an OBJ x.obj as x.mtl and
/// x_NAME.png or .jpg; other files that have these names already are not replaced (x_2.mtl). Returns the warnings: one
/// sentence that lists what the format cannot hold, and one for each texture that is missing.
/// Errors: unsuitable (check_mesh refuses the mesh, whose numbers a deformation may have taken too far), unsupported,
/// unwritable, out_of_memory, cancelled.
Result<std::vector<std::string>> write_mesh(const Mesh& mesh, const std::filesystem::path& path,
                                            const WriteMeshOptions& options, const RunContext& context);
/// The bytes of a file of that format into `bytes` (options.format does not count here). Same warnings; errors:
/// usage (check_mesh refuses the mesh), unsupported, out_of_memory, cancelled.
Result<std::vector<std::string>> write_mesh(const Mesh& mesh, MeshFormat format, std::string& bytes,
                                            const WriteMeshOptions& options, const RunContext& context);

} // namespace filigree
