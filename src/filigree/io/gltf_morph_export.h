// A mesh's animation as GLB, as morph targets.
#pragma once

#include "filigree/core/result.h"
#include "filigree/core/run_context.h"
#include "filigree/io/gltf_export_report.h"
#include "filigree/mesh/mesh_animation.h"

#include <filesystem>

namespace filigree {

struct MorphOptions {
    ExportNormals normals = ExportNormals::keep;
    bool morph_normals = false;                  ///< a normal a vertex and frame too: right shading, twice the size
    bool compress = false;                       ///< as of SkinOptions; the whole file is in memory then
    std::filesystem::path materials_beside = {}; ///< where libraries are looked for: the mesh's path
};

/// Any mesh animation as morph targets, one a frame; streamed, so memory is a few frames.
/// Errors: unsuitable (no frames), those of the animation, unwritable, unsupported (4 GiB), out_of_memory, cancelled.
Result<ExportReport> write_morph_glb(const MeshAnimation& animation, const MorphOptions& options,
                                     const std::filesystem::path& path, const RunContext& context);

} // namespace filigree
