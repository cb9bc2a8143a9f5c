// Point caches: positions of a mesh's vertices, frame after frame, without its faces. PC2, MDD, numbered meshes.
#pragma once

#include "filigree/core/result.h"
#include "filigree/core/run_context.h"
#include "filigree/hierarchy/pose.h"
#include "filigree/mesh/mesh_animation.h"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace filigree {

enum class AnimationFormat {
    pc2,      ///< .pc2 (PointCache 2): little-endian float
    mdd,      ///< .mdd (Motion Designer): big-endian float, with times
    numbered, ///< a folder of NAME_0001.ply and so on, or a path with #### for the number
    usda,     ///< .usda, text with time samples: for small cases
    glb,      ///< .glb, morph targets
};

/// The format that an output's or input's name stands for. Errors: unsupported, with the list.
Result<AnimationFormat> animation_format(const std::filesystem::path& path);

struct PoseFileOptions {
    std::optional<double> frames_per_second = {}; ///< for files that do not say (PC2, numbered); unset: 60
    std::string animation;                        ///< glTF: by name; empty: the first
};

/// Poses of a driver that another program moved, opened for reading frame by frame: PC2, MDD, numbered meshes (with
/// gradients where a PLY has f00 .. f22), an animated glTF sampled at the frame rate, or the poses of a .fil. Sizes are
/// held against the file's length when it is opened; only one frame is in memory (a .fil: all).
/// points: the driver's vertices; origin: the mesh's. Errors: not_found, bad_file, mismatch (other number of points),
/// unsupported, usage (no such animation).
Result<PoseStream> open_poses(const std::filesystem::path& path, std::size_t points, const Vec3d& origin,
                              const PoseFileOptions& options, const RunContext& context);

/// Any of those as the animation of `rest`, which must outlive it.
Result<MeshAnimation> open_animation(const std::filesystem::path& path, const Mesh& rest,
                                     const PoseFileOptions& options, const RunContext& context);

/// Writes every frame, one in memory at a time, whole or not at all. World coordinates (the origin is added) in 32-bit
/// floats; a warning says when that loses digits. Numbered meshes are PLY in a folder, or what the #### name ends in.
/// Same errors as write_mesh, and cancelled. Cost: writing; memory one frame.
Result<std::vector<std::string>> write_animation(const MeshAnimation& animation, const std::filesystem::path& path,
                                                 const RunContext& context);

} // namespace filigree
