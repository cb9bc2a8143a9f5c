// A model's animation as GLB, as a skin.
#pragma once

#include "filigree/core/result.h"
#include "filigree/core/run_context.h"
#include "filigree/hierarchy/model.h"
#include "filigree/hierarchy/pose.h"
#include "filigree/hierarchy/restore.h"
#include "filigree/io/gltf_export_report.h"

#include <filesystem>
#include <optional>

namespace filigree {

enum class KeyInterpolation { linear, cubic };

struct SkinOptions {
    RestoreOptions restore = {}; ///< law, thin shell, level
    /// Keys a second; unset: the poses' own rate. Between frames poses are interpolated linearly.
    std::optional<double> key_rate = {};
    KeyInterpolation interpolation = KeyInterpolation::linear; ///< cubic is ignored by Blender
    /// Three influences a vertex and a rest shape with its detail doubled (plays in everything), or six, one joint more
    /// for each edge of the driver, and the true rest shape (for Blender; three.js drops the last two).
    unsigned influences = 3;
    bool full_precision = false; ///< float rotations and weights; else int16 and uint16, 3e-6 of the diagonal
    bool compress = false;       ///< EXT_meshopt_compression and KHR_mesh_quantization, which viewers have to know
    bool all_levels = false;     ///< coarser levels too, as MSFT_lod, on the same joints
    ExportNormals normals = ExportNormals::keep;
    std::filesystem::path materials_beside = {}; ///< where libraries are looked for: the mesh's or model's path
};

/// The model's animation as a plain glTF 2.0 skin (docs/exchange.md): no extension, and the mesh at rest while nothing
/// plays. The error is measured by reading the file's own bytes, and stored in asset.extras.filigree.
/// Errors: unsuitable (no frames), mismatch (a pose of another driver), usage (level, rates),
/// unwritable, unsupported (4 GiB), out_of_memory, cancelled. Cost: a few restores a key. Memory: the file once, and
/// what the reader makes of its meshes.
Result<ExportReport> write_skin_glb(const Model& model, const FrameSource<Pose>& poses, const SkinOptions& options,
                                    const std::filesystem::path& path, const RunContext& context);

} // namespace filigree
