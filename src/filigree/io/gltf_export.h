// Models as GLB for other programs: levels, and animations as a skin or as morph targets.
#pragma once

#include "filigree/core/result.h"
#include "filigree/core/run_context.h"
#include "filigree/hierarchy/model.h"
#include "filigree/hierarchy/pose.h"
#include "filigree/hierarchy/restore.h"
#include "filigree/mesh/mesh_animation.h"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace filigree {

/// Static levels as nodes that MSFT_lod names, finest first. Returns warnings (what glTF cannot hold).
/// Errors: unwritable, unsupported, out_of_memory, cancelled.
Result<std::vector<std::string>> write_levels_glb(const Model& model, const std::filesystem::path& path,
                                                  const std::filesystem::path& materials_beside,
                                                  const RunContext& context);

enum class KeyInterpolation { linear, cubic };
enum class ExportNormals {
    keep,  ///< the mesh's own; computed from its faces where it has none
    leave, ///< none: viewers shade flat, which stays right under stretch
};

struct SkinOptions {
    RestoreOptions restore; ///< law, thin shell, level
    /// Keys a second; unset: the poses' own rate. Between frames poses are interpolated linearly.
    std::optional<double> key_rate = {};
    KeyInterpolation interpolation = KeyInterpolation::linear; ///< cubic is ignored by Blender
    /// Three influences a vertex and a rest shape with its detail doubled (plays in everything), or six, one joint more
    /// for each edge of the driver, and the true rest shape (for Blender; three.js drops the last two).
    unsigned influences = 3;
    bool full_precision = false; ///< float rotations and weights; else int16 and uint16, 3e-6 of the diagonal
    bool all_levels = false;     ///< coarser levels too, as MSFT_lod, on the same joints
    ExportNormals normals = ExportNormals::keep;
    std::filesystem::path materials_beside; ///< where material libraries are looked for: the mesh's or model's path
};

struct ExportReport {
    std::size_t bytes = 0, vertices = 0, joints = 0, keys = 0;
    double seconds = 0; ///< of the animation
    /// Largest and RMS distance of the file, evaluated as a viewer would, from our own restore, as fractions of the
    /// diagonal at the first key: at keys, and between them (at the poses' own frames where keys are sparser; else
    /// half way, against the restore of the driver half way).
    double error_at_keys = 0, error_between_keys = 0;
    double rms_at_keys = 0, rms_between_keys = 0;
    std::size_t moments = 0;         ///< keys, and moments between them
    std::size_t moments_checked = 0; ///< of these, how many were evaluated: all, unless there are very many
    /// 95th percentile, over driver vertices and keys, of how far normals may be off, in degrees, in viewers that turn
    /// them with the skin matrix (three.js, Babylon.js): atan r - atan(1/r) of the stretch ratio r.
    double normal_error_degrees = 0;
    std::vector<std::string> warnings;
};

/// The model's animation as a plain glTF 2.0 skin (docs/exchange.md): no extension, and the mesh at rest while nothing
/// plays. The error is measured by reading the file's own bytes, and stored in asset.extras.filigree.
/// Errors: unsuitable (reference code; no frames), mismatch (a pose of another driver), usage (level, rates),
/// unwritable, unsupported (4 GiB), out_of_memory, cancelled. Cost: a few restores a key.
Result<ExportReport> write_skin_glb(const Model& model, const PoseStream& poses, const SkinOptions& options,
                                    const std::filesystem::path& path, const RunContext& context);

struct MorphOptions {
    ExportNormals normals = ExportNormals::keep;
    bool morph_normals = false; ///< a normal a vertex and frame too: right shading, twice the size
    std::filesystem::path materials_beside;
};

/// Any mesh animation as morph targets, one a frame; streamed, so memory is a few frames. Errors: as above.
Result<ExportReport> write_morph_glb(const MeshAnimation& animation, const MorphOptions& options,
                                     const std::filesystem::path& path, const RunContext& context);

} // namespace filigree
